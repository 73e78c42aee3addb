"""Drag of a moving or resting fluid on a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np

from hovi.effects.effect import Effect
from hovi.effects.expressions.frame_motion import frame_motion, require_frame
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.effects.expressions.time_vector import TimeVector, in_words, time_vector
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class Drag(Effect):
    """The force F = -(rho A |u| / 2 + c) u on a frame with velocity u relative to the fluid.

    |u| is smoothed as sqrt(u^2 + w^2) - w, so that the force is twice differentiable at rest.
    [Batchelor1967, sec. 5.11]

    frame: a frame of the robot; the force acts at its origin.
    area: A, drag coefficient times area, in [m^2]. density: rho, in [kg/m^3].
    linear: c, in [N s/m]. wind: velocity of the fluid in the world, in [m/s], each component a
        number or a formula of t. width: w, in [m/s].
    """

    frame: str
    area: float = 0.0
    density: float = 1.204
    linear: float = 0.0
    wind: TimeVector = (0.0, 0.0, 0.0)
    width: float = 1e-2
    key: ClassVar[str] = "drag"

    def check(self, robot: Robot) -> None:
        """Raise SceneError for an unknown frame."""
        require_frame(robot, self.key, self.frame)

    def check_values(self) -> None:
        """Raise SceneError for negative values, and for invalid components of the wind."""
        for name in ("area", "density", "linear"):
            value = getattr(self, name)
            if not 0 <= value < np.inf:
                raise SceneError(
                    f"effect 'drag': {name} must be finite and 0 or more, got {value:g}."
                )
        if not 0 < self.width < np.inf:
            raise SceneError(
                f"effect 'drag': width must be positive and finite, got {self.width:g}."
            )
        time_vector("effect 'drag': wind", self.wind, ca.SX.sym("t"))

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """-J^T F."""
        motion = frame_motion(robot, symbols, self.frame)
        u = motion.velocity - time_vector("effect 'drag': wind", self.wind, symbols.t)
        strength = ca.SX(self.linear)
        if self.area * self.density > 0:
            speed = ca.sqrt(ca.sumsqr(u) + self.width**2) - self.width
            strength = strength + 0.5 * self.density * self.area * speed
        return motion.joint_torque(strength * u)

    def describe(self) -> str:
        """One line for the description of a scene."""
        return (
            f"drag: area {self.area:g} m^2 in {self.density:g} kg/m^3, linear {self.linear:g} "
            f"N s/m on {self.frame}, wind {in_words(self.wind)} m/s"
        )
