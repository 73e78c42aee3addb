"""An external wrench on a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca

from hovi.effects.effect import Effect
from hovi.effects.expressions.frame_motion import frame_motion, require_frame
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.effects.expressions.time_vector import TimeVector, in_words, time_vector
from hovi.errors import SceneError, nearest
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

AXES = ("world", "frame")


@dataclass(frozen=True)
class Wrench(Effect):
    """tau -= J(q)^T (f, m), for a wrench (f, m) on the robot. [Featherstone2008, sec. 5.3]

    frame: a frame of the robot; the force acts at its origin.
    force: f, in [N]. moment: m, in [N m]. Each component is a number or a formula of t.
    axes: "world" or "frame", the axes of the components.
    """

    frame: str
    force: TimeVector = (0.0, 0.0, 0.0)
    moment: TimeVector = (0.0, 0.0, 0.0)
    axes: str = "world"
    key: ClassVar[str] = "wrench"

    def check(self, robot: Robot) -> None:
        """Raise SceneError for an unknown frame."""
        require_frame(robot, self.key, self.frame)

    def check_values(self) -> None:
        """Raise SceneError for unknown axes, and for invalid components."""
        if self.axes not in AXES:
            raise SceneError(f"effect 'wrench': axes {self.axes!r}: {nearest(self.axes, AXES)}")
        for name in ("force", "moment"):
            time_vector(f"effect 'wrench': {name}", getattr(self, name), ca.SX.sym("t"))

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """-J^T (f, m)."""
        f = time_vector("effect 'wrench': force", self.force, symbols.t)
        m = time_vector("effect 'wrench': moment", self.moment, symbols.t)
        motion = frame_motion(robot, symbols, self.frame)
        if self.axes == "frame":
            f, m = motion.rotation @ f, motion.rotation @ m
        return -motion.joint_torque(f, None if m.is_zero() else m)

    def describe(self) -> str:
        """One line for the description of a scene."""
        return (
            f"wrench: force {in_words(self.force)} N, moment {in_words(self.moment)} N m "
            f"at {self.frame} in the axes of the {self.axes}"
        )
