"""What an effect is: something a scene simulates because it was named."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import casadi as ca

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot import Robot


@dataclass(frozen=True)
class SceneSymbols:
    """The CasADi symbols that an effect's expressions are written in.

    q: shape (nq,). v, a: shape (nv,). t: a number, in [s].
    """

    q: ca.SX
    v: ca.SX
    a: ca.SX
    t: ca.SX

    @classmethod
    def of(cls, robot: Robot) -> SceneSymbols:
        """New symbols for a robot."""
        sym = ca.SX.sym
        return cls(sym("q", robot.nq), sym("v", robot.nv), sym("a", robot.nv), sym("t"))

    def columns(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        """(q, v, a, t)."""
        return self.q, self.v, self.a, self.t


@dataclass(frozen=True)
class Effect(ABC):
    """An opt-in part of a scene; a field of the dataclass is a key in the scene file."""

    key: ClassVar[str]
    """Name of the effect's table in a scene file."""

    def check(self, robot: Robot) -> None:
        """Raise SceneError when the effect does not fit the robot."""

    def configure(self, model: pin.Model) -> None:
        """Change the scene's own copy of the model, for what Pinocchio simulates itself."""

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """What it adds to tau = M a + C + g + ..., a column of nv in [N m] or [N]; or None."""
        return None

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """What it adds to the cost, V of L~ = 1/2 |tau|^2 + V, a number; or None."""
        return None

    @abstractmethod
    def describe(self) -> str:
        """One line: the effect and its numbers with units."""
