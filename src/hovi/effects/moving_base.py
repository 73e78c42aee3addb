"""A base with prescribed motion: a robot on a ship, a train, a shaking table."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca

from hovi.effects.effect import Effect
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.effects.expressions.time_vector import TimeVector, in_words, time_vector
from hovi.errors import SceneError
from hovi.robot.space.joint_kinds import FLOATING, kind_of
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class MovingBase(Effect):
    """tau = the joints' rows of RNEA for the robot on six additional joints with prescribed motion.

    These rows contain all inertial forces of a moving frame (its acceleration, Euler, Coriolis and
    centrifugal forces) and gravity rotating in the base frame. [Featherstone2008, sec. 9.2]

    position: of the base in the world, in [m]. rotation: (roll, pitch, yaw) about the world's
        axes, R = Rz(yaw) Ry(pitch) Rx(roll) as in a URDF, in [rad]. Each component is a number or
        a formula of t.
    """

    position: TimeVector = (0.0, 0.0, 0.0)
    rotation: TimeVector = (0.0, 0.0, 0.0)
    key: ClassVar[str] = "moving_base"

    def check_values(self) -> None:
        """Raise SceneError for invalid components."""
        for name in ("position", "rotation"):
            time_vector(f"effect 'moving_base': {name}", getattr(self, name), ca.SX.sym("t"))

    def check(self, robot: Robot) -> None:
        """Raise SceneError for a floating base."""
        for name, joint in list(zip(robot.model.names, robot.model.joints, strict=True))[1:]:
            if kind_of(joint) is FLOATING:
                raise SceneError(
                    f"effect 'moving_base': joint {name!r} of robot {robot.name!r} floats, so that "
                    "its base cannot be prescribed; load the robot with free_flyer=False."
                )

    def base(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """(x, y, z, yaw, pitch, roll) at time t."""
        position = time_vector("effect 'moving_base': position", self.position, symbols.t)
        rotation = time_vector("effect 'moving_base': rotation", self.rotation, symbols.t)
        return ca.vertcat(position, rotation[2], rotation[1], rotation[0])

    def describe(self) -> str:
        """One line for the description of a scene."""
        return (
            f"moving_base: position {in_words(self.position)} m, roll, pitch and yaw "
            f"{in_words(self.rotation)} rad"
        )
