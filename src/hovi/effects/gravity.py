"""Uniform gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hovi.checks.directions import unit_vector
from hovi.effects.effect import Effect, Touch, bracketed
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class Gravity(Effect):
    """The generalized gravity g(q) of RNEA, for a uniform field.

    acceleration: 0 or more, in [m/s^2]. direction: of the field in the world frame, any nonzero
        vector.
    """

    acceleration: float = 9.81
    direction: tuple[float, float, float] = (0.0, 0.0, -1.0)
    key: ClassVar[str] = "gravity"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.MODEL,)

    def check_values(self) -> None:
        """Raise SceneError for a negative or infinite acceleration, and an invalid direction."""
        if not np.isfinite(self.acceleration):
            raise SceneError(
                f"effect 'gravity': acceleration must be finite, got {self.acceleration:g}; "
                "leave the effect out for a scene without gravity."
            )
        if self.acceleration < 0:
            raise SceneError(
                f"effect 'gravity': acceleration must be 0 or more, got {self.acceleration:g} "
                "m/s^2, which pulls upwards; set the `direction` instead, (0, 0, -1) by default."
            )
        finite = len(self.direction) == 3 and np.isfinite(self.direction).all()
        if not finite or not any(self.direction):
            raise SceneError(
                f"effect 'gravity': direction must be three finite numbers that are not all zero, "
                f"got {bracketed(self.direction)}."
            )

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Set the gravity of the model, which RNEA includes."""
        model.gravity.linear = self.acceleration * unit_vector(np.array(self.direction))

    def describe(self) -> str:
        """One line for the description of a scene."""
        if self.direction == (0.0, 0.0, -1.0):
            return f"gravity: {self.acceleration} m/s^2 along -z"
        along = ", ".join(f"{x:g}" for x in self.direction)
        return f"gravity: {self.acceleration} m/s^2 along ({along})"
