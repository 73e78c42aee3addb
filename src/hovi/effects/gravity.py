"""Gravity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hovi.effects.effect import Effect
from hovi.errors import SceneError

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot import Robot


@dataclass(frozen=True)
class Gravity(Effect):
    """The generalised gravity g(q) of RNEA, for a uniform field along -z of the world.

    acceleration: in [m/s^2].
    """

    acceleration: float = 9.81
    key: ClassVar[str] = "gravity"

    def check(self, robot: Robot) -> None:
        """Refuse an acceleration that is not a finite number."""
        if not np.isfinite(self.acceleration):
            raise SceneError(
                f"effect 'gravity': acceleration must be finite, got {self.acceleration}; "
                "leave the effect out for a scene without gravity."
            )

    def configure(self, model: pin.Model) -> None:
        """Gravity is simulated by Pinocchio itself."""
        model.gravity.linear = np.array([0.0, 0.0, -self.acceleration])

    def describe(self) -> str:
        """One line for the account of a scene."""
        return f"gravity: {self.acceleration} m/s^2 along -z"
