"""Dry joint friction: smoothed Coulomb and Stribeck friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect
from hovi.effects.expressions.joint_values import (
    JointValues,
    in_words,
    joint_values,
    of_urdf,
    require_one_source,
)
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class DryFriction(Effect):
    """tau_i += (F_c + (F_s - F_c) exp(-(v_i/v_s)^2)) tanh(v_i/w), with the sign of v_i smoothed.

    [ArmstrongDupontCanudas1994, sec. 2]

    coulomb: F_c, 0 or more, in [N m] or [N]. static: F_s, at least F_c; F_c by default.
    stribeck_velocity: v_s, in [rad/s] or [m/s]. width: w, the velocity over which the sign
        changes, in [rad/s] or [m/s]: at v = w it is tanh(1) = 0.76.
    from_urdf: use the `friction` of the URDF for F_c.
    """

    coulomb: JointValues | None = None
    static: JointValues | None = None
    stribeck_velocity: float = 0.1
    width: float = 0.05
    from_urdf: bool = False
    key: ClassVar[str] = "dry_friction"

    def check_values(self) -> None:
        """Raise SceneError for widths that are not positive."""
        for name in ("stribeck_velocity", "width"):
            value = getattr(self, name)
            if not 0 < value < np.inf:
                raise SceneError(
                    f"effect 'dry_friction': {name} must be positive and finite, got {value:g}."
                )

    def check(self, robot: Robot) -> None:
        """Raise SceneError for negative friction, and F_s < F_c."""
        coulomb, static = self.values(robot)
        below = np.flatnonzero(static < coulomb)
        if len(below):
            i = below[0]
            raise SceneError(
                f"effect 'dry_friction': static friction of joint {robot.coordinate_names[i]!r} "
                f"must not be below Coulomb's {coulomb[i]:g}, got {static[i]:g}."
            )

    def values(self, robot: Robot) -> tuple[Array, Array]:
        """F_c and F_s of every joint coordinate, shape (nv,) each."""
        require_one_source(self.key, "coulomb", self.coulomb, self.from_urdf)
        if self.coulomb is None:
            coulomb = of_urdf(robot, self.key, "friction", robot.friction)
        else:
            coulomb = joint_values(robot, "effect 'dry_friction': coulomb", self.coulomb, 0)
        if self.static is None:
            return coulomb, coulomb
        return coulomb, joint_values(robot, "effect 'dry_friction': static", self.static, 0)

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """The friction of every joint."""
        coulomb, static = self.values(robot)
        v = symbols.v
        level = ca.SX(ca.DM(coulomb))
        if np.any(static > coulomb):
            rise = ca.DM(static - coulomb)
            level = level + rise * ca.exp(-((v / self.stribeck_velocity) ** 2))
        return level * ca.tanh(v / self.width)

    def describe(self) -> str:
        """One line for the description of a scene."""
        line = f"dry_friction: {in_words(self.coulomb, 'N m (N)')}"
        if self.static is not None:
            line += f", {in_words(self.static, 'N m (N)')} when starting"
            line += f" (Stribeck velocity {self.stribeck_velocity:g} rad/s)"
        return f"{line}; sign smoothed over {self.width:g} rad/s (m/s)"
