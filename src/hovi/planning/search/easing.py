"""What makes a scene easier to plan on, and is never part of an answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from hovi.effects import Effect

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class HeavierRotors(Effect):
    """The same inertia on every joint, beside what the joints have: M(q) + inertia * 1.

    With much of it the least effort is nearly that of a cubic spline, which has one minimum.

    inertia: in [kg m^2], or [kg] at sliding joints.
    """

    inertia: float
    key: ClassVar[str] = "heavier_rotors"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Rotors are simulated by Pinocchio itself."""
        model.armature = model.armature + self.inertia

    def describe(self) -> str:
        """One line for the account of a scene."""
        return f"{self.inertia:.3g} kg m^2 or kg on every joint, to make planning easier"


@dataclass(frozen=True)
class WeakerGravity(Effect):
    """A share of the scene's gravity.

    share: from 0 to 1.
    """

    share: float
    key: ClassVar[str] = "weaker_gravity"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Gravity is simulated by Pinocchio itself."""
        model.gravity.linear = self.share * model.gravity.linear

    def describe(self) -> str:
        """One line for the account of a scene."""
        return f"{100 * self.share:.0f} % of gravity, to make planning easier"
