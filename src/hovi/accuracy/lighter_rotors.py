"""Rotors that become lighter: a sequence of easier problems, each solution the guess of the next.

With heavy rotors the action is nearly that of a spline, which has a single minimum.
[AllgowerGeorg2003]
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hovi.effects import Effect
from hovi.planning.search.job import Job
from hovi.robot.mass_matrix import MassMatrix
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


FIRST_ROTOR_RATIO = 10.0
"""Rotor inertia of the first stage, relative to the largest diagonal entry of the mass matrix."""
ROTOR_REDUCTION = 10.0
"""Factor by which the rotor inertia is reduced from stage to stage."""
LAST_ROTOR_RATIO = 0.1
"""Smallest rotor inertia, relative to the smallest eigenvalue of the mass matrix."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One of the problems, and a few words on how it differs from the last one."""

    name: str
    job: Job


def lighter_rotors(job: Job) -> list[Stage]:
    """Rotor inertia c on every joint, M(q) + c 1, with c decreasing to zero.

    The easiest problem first, without the job itself; none where rotors change no cost.
    """
    if not job.lagrangian().needs_torques:
        return []
    robot = job.scene.robot
    q, _ = job.start.on(robot, "start")
    M = MassMatrix(job.scene.model)(q[None])[0]
    inertia = FIRST_ROTOR_RATIO * float(M.diagonal().max())
    least = LAST_ROTOR_RATIO * float(np.linalg.eigvalsh(M)[0])
    stages = []
    while inertia > least:
        effects = [*job.scene.effects, HeavierRotors(inertia)]
        scene = dataclasses.replace(job.scene, effects=effects)
        name = f"rotors of {inertia:.2g} kg m^2"
        stages.append(Stage(name, dataclasses.replace(job, scene=scene)))
        inertia /= ROTOR_REDUCTION
    return stages


@dataclass(frozen=True)
class HeavierRotors(Effect):
    """The same additional inertia on every joint: M(q) + inertia * 1.

    inertia: in [kg m^2], or [kg] at sliding joints.
    """

    inertia: float
    key: ClassVar[str] = "heavier_rotors"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Rotor inertia is part of Pinocchio's model."""
        model.armature = model.armature + self.inertia

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"{self.inertia:.3g} kg m^2 or kg on every joint, to begin with"
