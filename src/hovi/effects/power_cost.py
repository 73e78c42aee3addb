"""A cost on mechanical power."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.joint_values import JointValues, in_words, joint_values
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class PowerCost(Effect):
    """sum_i w_i |tau_i v_i|: the power of drives that do not recover energy.

    |P| is smoothed as sqrt(P^2 + s^2) - s.

    weight: w, 0 or more, per [W]. width: s, in [W].
    """

    weight: JointValues
    width: float = 0.1
    key: ClassVar[str] = "power_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and negative weights."""
        joint_values(robot, "effect 'power_cost': weight", self.weight, 0)

    def check_values(self) -> None:
        """Raise SceneError for a nonpositive width."""
        if not 0 < self.width < np.inf:
            raise SceneError(
                f"effect 'power_cost': width must be positive and finite, got {self.width:g} W."
            )

    def running_cost(self, robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> ca.SX:
        """The weighted smoothed power."""
        weight = joint_values(robot, "effect 'power_cost': weight", self.weight, 0)
        power = ca.sqrt((tau * symbols.v) ** 2 + self.width**2) - self.width
        return ca.dot(ca.DM(weight), power)

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"power_cost: {in_words(self.weight, 'per W')}, smoothed over {self.width:g} W"
