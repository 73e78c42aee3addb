"""Weights of the joint torques in the cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.joint_values import JointValues, in_words, joint_values
from hovi.errors import SceneError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class EffortWeight(Effect):
    """R of the cost 1/2 tau^T diag(R) tau; without this effect R = 1.

    weight: R, positive, per [(N m)^2] or [N^2]; in a table, joints that are left out have weight 1.
    """

    weight: JointValues
    key: ClassVar[str] = "effort_weight"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints and weights that are not positive."""
        self.effort_weight(robot)

    def effort_weight(self, robot: Robot) -> Array:
        """R, shape (nv,)."""
        given = self.weight
        if isinstance(given, dict):
            given = dict.fromkeys(robot.coordinate_names, 1.0) | given
        weight = joint_values(robot, "effect 'effort_weight': weight", given)
        for name, value in zip(robot.coordinate_names, weight, strict=True):
            if value <= 0:
                raise SceneError(
                    f"effect 'effort_weight': weight of joint {name!r} must be positive, "
                    f"got {value:g}."
                )
        return weight

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"effort_weight: {in_words(self.weight, 'times the squared torque')}"
