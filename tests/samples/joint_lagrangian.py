"""Lagrangians of a robot's joints that are neither compiled nor have outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class JointLagrangian(Lagrangian):
    """L(q, v, a) of the joints of a scene's robot."""

    scene: Scene
    order: ClassVar[int] = 2

    @property
    def nq(self) -> int:
        return self.scene.robot.nq

    @property
    def nv(self) -> int:
        return self.scene.robot.nv
