"""The motion of a frame: placement, velocity, and the joint torques of a wrench on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca

from hovi.dynamics.symbolic_dynamics import functions_of
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError, nearest
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class FrameMotion:
    """A frame in the world as expressions of a scene's symbols.

    rotation: R of the frame, (3, 3). position: p of its origin, (3,) in [m].
    velocity: dp/dt, (3,) in [m/s]. rate: q', (nq,).
    """

    symbols: SceneSymbols
    rate: ca.SX
    rotation: ca.SX
    position: ca.SX
    velocity: ca.SX

    def joint_torque(self, force: ca.SX, moment: ca.SX | None = None) -> ca.SX:
        """J^T (f, m): the joint torques equivalent to a wrench on the frame, (nv,).

        By virtual work, f . dp + m . dw = (J^T (f, m)) . dq, where the rotation dw satisfies
        m . dw = 1/2 <[m] R, dR>. [Featherstone2008, sec. 5.3]

        force: at the frame's origin, world axes, (3,) in [N]. moment: (3,) in [N m].
        """
        q, v = self.symbols.q, self.symbols.v
        pulled = ca.jtimes(self.position, q, force, True)
        if moment is not None:
            turned = ca.vec(ca.skew(moment) @ self.rotation) / 2
            pulled += ca.jtimes(ca.vec(self.rotation), q, turned, True)
        return ca.jtimes(self.rate, v, pulled, True)


def frame_motion(robot: Robot, symbols: SceneSymbols, frame: str) -> FrameMotion:
    """The motion of a frame, including that of a moving base.

    frame: one of robot.frame_names.
    """
    q, t, base = symbols.q, symbols.t, symbols.base
    R, p = functions_of(robot).frame_placement(frame)(q)
    rate = configuration_rate(robot.model, q, symbols.v)
    if base is None:
        return FrameMotion(symbols, rate, R, p, ca.jtimes(p, q, rate))
    turn = base_rotation(base)
    R, p = turn @ R, base[:3] + turn @ p
    velocity = ca.jtimes(p, q, rate) + ca.jtimes(p, t, ca.SX(1))
    return FrameMotion(symbols, rate, R, p, velocity)


def base_rotation(base: ca.SX) -> ca.SX:
    """R = Rz(yaw) Ry(pitch) Rx(roll) of (x, y, z, yaw, pitch, roll), (3, 3)."""
    (cz, sz), (cy, sy), (cx, sx) = ((ca.cos(x), ca.sin(x)) for x in ca.vertsplit(base[3:]))
    rows = (
        ca.horzcat(cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx),
        ca.horzcat(sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx),
        ca.horzcat(-sy, cy * sx, cy * cx),
    )
    return ca.vertcat(*rows)


def require_frame(robot: Robot, effect: str, frame: str) -> None:
    """Raise SceneError for a frame that the robot does not have."""
    if frame not in robot.frame_names:
        hint = nearest(frame, robot.frame_names)
        raise SceneError(f"effect {effect!r}: robot {robot.name!r} has no frame {frame!r}: {hint}")
