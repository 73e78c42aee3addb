"""Costs on velocities and accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import casadi as ca

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.joint_values import JointValues, in_words, joint_values
from hovi.effects.expressions.symbols import SceneSymbols

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class VelocityCost(Effect):
    """V = 1/2 sum_i w_i v_i^2.

    weight: w, 0 or more, per [(rad/s)^2] or [(m/s)^2].
    """

    weight: JointValues
    key: ClassVar[str] = "velocity_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and negative weights."""
        joint_values(robot, "effect 'velocity_cost': weight", self.weight, 0)

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """The weighted squares of the velocities."""
        weight = joint_values(robot, "effect 'velocity_cost': weight", self.weight, 0)
        return ca.dot(ca.DM(weight), symbols.v**2) / 2

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"velocity_cost: {in_words(self.weight, 'per (rad/s)^2')}"


@dataclass(frozen=True)
class AccelerationCost(Effect):
    """V = 1/2 sum_i w_i a_i^2: motions tend to splines for large weights.

    weight: w, 0 or more, per [(rad/s^2)^2] or [(m/s^2)^2].
    """

    weight: JointValues
    key: ClassVar[str] = "acceleration_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and negative weights."""
        joint_values(robot, "effect 'acceleration_cost': weight", self.weight, 0)

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """The weighted squares of the accelerations."""
        weight = joint_values(robot, "effect 'acceleration_cost': weight", self.weight, 0)
        return ca.dot(ca.DM(weight), symbols.a**2) / 2

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"acceleration_cost: {in_words(self.weight, 'per (rad/s^2)^2')}"
