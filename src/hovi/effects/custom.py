"""A user-defined effect from formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, ClassVar

import casadi as ca

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.formula import Number, expression
from hovi.effects.expressions.formula_symbols import joint_symbols
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError, nearest
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class Custom(Effect):
    """Torques and a cost, each a formula of q["joint"], v["joint"], a["joint"] and t.

    Joints with nq != nv have no q["joint"]. In Python, a subclass of Effect can use any CasADi
    expression instead of a formula.

    torque_of: added to tau, by joint, in [N m] or [N].
    cost: added to the cost.
    """

    torque_of: Mapping[str, Number] = field(default_factory=dict)
    cost: Number = 0.0
    key: ClassVar[str] = "custom"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.TORQUE, Touch.COST)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and invalid formulas."""
        symbols = SceneSymbols.of(robot)
        self.torque(robot, symbols)
        self.potential(robot, symbols)

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """The formulas for the joint torques."""
        names, rows = robot.coordinate_names, [ca.SX(0)] * robot.nv
        for joint, given in self.torque_of.items():
            if joint not in names:
                raise SceneError(
                    f"effect 'custom': robot {robot.name!r} has no joint {joint!r}: "
                    f"{nearest(joint, names)}"
                )
            what = f"effect 'custom': torque_of joint {joint!r}"
            rows[names.index(joint)] = expression(what, given, joint_symbols(robot, symbols))
        return ca.vertcat(*rows) if self.torque_of else None

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """The formula for the cost."""
        cost = expression("effect 'custom': cost", self.cost, joint_symbols(robot, symbols))
        return None if cost.is_zero() else cost

    def describe(self) -> str:
        """One line for the description of a scene."""
        parts = [f"tau of {joint} += {given}" for joint, given in self.torque_of.items()]
        parts += [] if self.cost == 0 else [f"cost += {self.cost}"]
        return "custom: " + ("; ".join(parts) or "nothing")
