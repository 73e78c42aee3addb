"""A payload: a rigid body fixed to a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pinocchio as pin

from hovi.effects.effect import Effect, Touch, bracketed
from hovi.effects.expressions.frame_motion import require_frame
from hovi.errors import SceneError
from hovi.robot.model import frame_named
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class Payload(Effect):
    """A rigid body fixed to a frame: its spatial inertia is added to that of the link.

    [Featherstone2008, sec. 2.13]

    frame: a frame of the robot. mass: in [kg].
    center: its center of mass in the frame, in [m].
    inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about that center in the frame's axes, in [kg m^2];
        a point mass by default.
    """

    frame: str
    mass: float
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    key: ClassVar[str] = "payload"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.MODEL,)

    def check(self, robot: Robot) -> None:
        """Raise SceneError for an unknown or fixed frame."""
        require_frame(robot, self.key, self.frame)
        if frame_named(robot.model, self.frame).parentJoint == 0:
            raise SceneError(
                f"effect 'payload': frame {self.frame!r} is fixed to the base, where a payload "
                "changes nothing; name a frame that a joint moves."
            )

    def check_values(self) -> None:
        """Raise SceneError for an invalid mass, center or inertia."""
        if not 0 <= self.mass < np.inf:
            raise SceneError(
                f"effect 'payload': mass must be finite and 0 or more, got {self.mass:g} kg."
            )
        if len(self.center) != 3 or not np.isfinite(self.center).all():
            raise SceneError(
                f"effect 'payload': center must be three finite numbers, got "
                f"{bracketed(self.center)}."
            )
        if len(self.inertia) != 6:
            raise SceneError(
                "effect 'payload': inertia needs six numbers (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), got "
                f"{len(self.inertia)}."
            )
        tensor = self._tensor()
        if not np.isfinite(tensor).all() or np.linalg.eigvalsh(tensor)[0] < -1e-12 * tensor.max():
            raise SceneError(
                "effect 'payload': inertia (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) must be finite and must "
                f"not have a negative principal value, got {bracketed(self.inertia)}."
            )

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Add the inertia of the body to the model."""
        frame = frame_named(model, self.frame)
        model.inertias[frame.parentJoint] += frame.placement.act(self.body)

    @property
    def body(self) -> pin.Inertia:
        """Its mass, center and inertia about it, in the frame."""
        return pin.Inertia(self.mass, np.array(self.center), self._tensor())

    def describe(self) -> str:
        """One line for the description of a scene."""
        center = ", ".join(f"{x:g}" for x in self.center)
        return f"payload: {self.mass:g} kg at {self.frame}, center ({center}) m"

    def _tensor(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        xx, yy, zz, xy, xz, yz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)
