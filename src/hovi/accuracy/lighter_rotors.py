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
"""Rotor inertia of the easiest problem, relative to the largest diagonal entry of M."""
ROTOR_REDUCTION = 10.0
"""Factor by which the rotor inertia is reduced from one to the next."""
LAST_ROTOR_RATIO = 0.1
"""Smallest rotor inertia, relative to the smallest eigenvalue of M."""


def lighter_rotors(job: Job) -> list[Job]:
    """The job with rotor inertia c on every joint, M(q) + c 1, with c decreasing to zero.

    The easiest one first, without the job itself; none where rotors change no cost.
    """
    if not job.lagrangian().needs_torques:
        return []
    robot = job.scene.robot
    q, _ = job.start.on(robot, "start")
    M = MassMatrix(job.scene.model)(q[None])[0]
    inertia = FIRST_ROTOR_RATIO * float(M.diagonal().max())
    least = LAST_ROTOR_RATIO * float(np.linalg.eigvalsh(M)[0])
    easier = []
    while inertia > least:
        effects = [*job.scene.effects, HeavierRotors(inertia)]
        scene = dataclasses.replace(job.scene, effects=effects)
        easier.append(dataclasses.replace(job, scene=scene))
        inertia /= ROTOR_REDUCTION
    return easier


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
        return f"{self.inertia:.3g} kg m^2 or kg on every joint"
