"""Armature: rotor inertia reflected through the gears."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.joint_values import (
    JointValues,
    in_words,
    joint_values,
    of_urdf,
    require_one_source,
)
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class Armature(Effect):
    """M(q) += diag(I), I_i = rotor inertia times gear ratio squared. [Featherstone2008, sec. 9.6]

    inertia: I, 0 or more, in [kg m^2] or [kg].
    from_urdf: use the armature of the robot's model instead.
    """

    inertia: JointValues | None = None
    from_urdf: bool = False
    key: ClassVar[str] = "armature"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.MODEL,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for negative values, unknown joints, or a model without armature."""
        self.values(robot)

    def values(self, robot: Robot) -> npt.NDArray[np.float64]:
        """I of every joint coordinate, shape (nv,)."""
        require_one_source(self.key, "inertia", self.inertia, self.from_urdf)
        if self.inertia is None:
            return of_urdf(robot, self.key, "armature", robot.armature)
        return joint_values(robot, "effect 'armature': inertia", self.inertia, 0)

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Set the armature of the model, which RNEA includes."""
        model.armature = self.values(robot)

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"armature: {in_words(self.inertia, 'kg m^2 (kg)')}"
