"""Joint springs."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np

from hovi.effects.effect import Effect
from hovi.effects.expressions.joint_positions import positions, require_positions
from hovi.effects.expressions.joint_values import JointValues, in_words, joint_values
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class JointSprings(Effect):
    """tau_i += k_i (q_i - rest_i), the torque against a linear spring.

    stiffness: k, 0 or more, in [N m/rad] or [N/m]. rest: in [rad] or [m].
    """

    stiffness: JointValues
    rest: JointValues = 0.0
    key: ClassVar[str] = "joint_springs"

    def check(self, robot: Robot) -> None:
        """Raise SceneError for negative stiffness, unknown joints, and joints with nq != nv."""
        what = "effect 'joint_springs'"
        stiffness = joint_values(robot, f"{what}: stiffness", self.stiffness, 0)
        joint_values(robot, f"{what}: rest", self.rest)
        require_positions(robot, what, np.flatnonzero(stiffness))

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """k (q - rest)."""
        stiffness = joint_values(robot, "effect 'joint_springs': stiffness", self.stiffness, 0)
        rest = joint_values(robot, "effect 'joint_springs': rest", self.rest)
        return ca.DM(stiffness) * (positions(robot, symbols.q) - ca.DM(rest))

    def describe(self) -> str:
        """One line for the description of a scene."""
        return (
            f"joint_springs: {in_words(self.stiffness, 'N m/rad (N/m)')}, "
            f"at rest at {in_words(self.rest, 'rad (m)')}"
        )
