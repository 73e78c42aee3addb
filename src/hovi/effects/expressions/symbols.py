"""The CasADi symbols of a scene: position, velocity, acceleration and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class SceneSymbols:
    """The CasADi symbols in the expressions of effects.

    q: shape (nq,). v, a: shape (nv,). t: scalar, in [s].
    base: pose of the base at t, (x, y, z, yaw, pitch, roll) in [m] and [rad]; None if it is fixed.
    """

    q: ca.SX
    v: ca.SX
    a: ca.SX
    t: ca.SX
    base: ca.SX | None = None

    @classmethod
    def of(cls, robot: Robot) -> SceneSymbols:
        """New symbols for a robot."""
        sym = ca.SX.sym
        return cls(sym("q", robot.nq), sym("v", robot.nv), sym("a", robot.nv), sym("t"))

    def columns(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """(q, v, a, t)."""
        return self.q, self.v, self.a, self.t
