"""A cost on the distance to a reference motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.formula import Number, expression
from hovi.effects.expressions.joint_positions import positions, require_positions
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError, nearest
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class ReferenceCost(Effect):
    """V = w/2 sum over the named joints of (q_i - r_i(t))^2.

    reference: r by joint name, a number or a formula of t, in [rad] or [m].
    weight: w, 0 or more, per [rad^2] or [m^2].
    """

    reference: Mapping[str, Number]
    weight: float = 1.0
    key: ClassVar[str] = "reference_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check_values(self) -> None:
        """Raise SceneError for a negative weight."""
        if not 0 <= self.weight < np.inf:
            raise SceneError(
                f"effect 'reference_cost': weight must be finite and 0 or more, got "
                f"{self.weight:g}."
            )

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and invalid formulas."""
        names = robot.coordinate_names
        for joint in self.reference:
            if joint not in names:
                raise SceneError(
                    f"effect 'reference_cost': robot {robot.name!r} has no joint {joint!r}: "
                    f"{nearest(joint, names)}"
                )
        named = np.array([names.index(joint) for joint in self.reference], dtype=np.intp)
        require_positions(robot, "effect 'reference_cost'", named)
        self.potential(robot, SceneSymbols.of(robot))

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """The weighted squared distance."""
        q = positions(robot, symbols.q)
        distance = ca.SX(0)
        for joint, given in self.reference.items():
            what = f"effect 'reference_cost': reference of joint {joint!r}"
            reference = expression(what, given, {"t": symbols.t})
            distance += (q[robot.coordinate_names.index(joint)] - reference) ** 2
        return self.weight / 2 * distance

    def describe(self) -> str:
        """One line for the description of a scene."""
        reference = ", ".join(f"{joint} at {given}" for joint, given in self.reference.items())
        return f"reference_cost: {reference}; {self.weight:g} per rad^2 (m^2)"
