"""Costs on velocities, accelerations and jerks."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.joint_values import JointValues, in_words, joint_values
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


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
        self.weights(robot)

    def weights(self, robot: Robot) -> Array:
        """w, shape (nv,)."""
        return joint_values(robot, "effect 'acceleration_cost': weight", self.weight, 0)

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """The weighted squares of the accelerations."""
        return ca.dot(ca.DM(self.weights(robot)), symbols.a**2) / 2

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"acceleration_cost: {in_words(self.weight, 'per (rad/s^2)^2')}"


@dataclass(frozen=True)
class JerkCost(Effect):
    """1/2 sum_i w_i j_i^2 with the jerk j = da/dt: accelerations and torques are continuous.

    The scene's Lagrangian is one of order 3, and accelerations at both ends are data: zero, or
    those of `State(q, v, a=...)`.

    weight: w, positive at every joint, per [(rad/s^3)^2] or [(m/s^3)^2]. Of the motion of least
        effort, it smooths times up to about sqrt(w) / M at a joint of inertia M.
    """

    weight: JointValues
    key: ClassVar[str] = "jerk_cost"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and weights that are not positive."""
        self.jerk_weight(robot)

    def jerk_weight(self, robot: Robot) -> Array:
        """w, shape (nv,)."""
        weight = joint_values(robot, "effect 'jerk_cost': weight", self.weight, 0)
        for name, value in zip(robot.coordinate_names, weight, strict=True):
            if value == 0:
                raise SceneError(
                    f"effect 'jerk_cost': weight of joint {name!r} must be positive, as otherwise "
                    "nothing determines its jerk; name every joint, or give one number for all."
                )
        return weight

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"jerk_cost: {in_words(self.weight, 'per (rad/s^3)^2')}"
