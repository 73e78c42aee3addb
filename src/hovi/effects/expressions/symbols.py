"""The CasADi symbols of a scene: position, velocity, acceleration and time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca

from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class SceneSymbols:
    """The CasADi symbols in the expressions of effects.

    q: shape (nq,). v, a: shape (nv,). t: scalar, in [s].
    base: pose of the base at t, (x, y, z, yaw, pitch, roll) in [m] and [rad]; None if it is fixed.
    model: the scene's, with gravity, armature and payload; None where only formulas are checked.
    """

    q: ca.SX
    v: ca.SX
    a: ca.SX
    t: ca.SX
    base: ca.SX | None = None
    model: pin.Model | None = None

    @classmethod
    def of(cls, robot: Robot, model: pin.Model | None = None) -> SceneSymbols:
        """New symbols for a robot. model: of its scene."""
        sym = ca.SX.sym
        q, v, a = sym("q", robot.nq), sym("v", robot.nv), sym("a", robot.nv)
        return cls(q, v, a, sym("t"), None, model)

    def columns(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """(q, v, a, t)."""
        return self.q, self.v, self.a, self.t
