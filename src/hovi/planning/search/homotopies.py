"""Homotopies: sequences of easier problems, each solution the guess for the next.

A homotopy is a family of jobs in one parameter that starts where the action has few stationary
motions and ends at the job itself. [AllgowerGeorg2003]
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Effect
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits
from hovi.planning.search.job import Job
from hovi.robot.mass_matrix import MassMatrix
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
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
GRAVITY_FRACTIONS = 0.0, 0.25, 0.5, 0.75
"""Gravity of the stages, relative to the job's."""
SHORTER_DURATIONS = 0.125, 0.25, 0.5
LONGER_DURATIONS = 2.0, 1.5, 1.25, 1.1
"""Durations of the stages, relative to the job's: shorter without limits, longer with them."""
MIN_INTERVALS = 6
"""Minimum number of intervals of the coarsest grid."""
RANGE_RATIOS = 8.0, 4.0, 2.0, 1.5, 1.25, 1.1
"""Ranges of relaxed limits, relative to the job's."""


@dataclass(frozen=True, eq=False)
class Stage:
    """One job of a homotopy, and a few words on how it differs from the last one."""

    name: str
    job: Job


Goal = TypeVar("Goal", State, State | FrameGoal)
Homotopy = Callable[[Job], list[Stage]]
"""The stages, easiest first, without the job itself; empty if the homotopy does not apply."""


def lighter_rotors(job: Job) -> list[Stage]:
    """Rotor inertia c on every joint, M(q) + c 1, with c decreasing to zero."""
    if not job.lagrangian().needs_torques:
        return []  # rotors change no cost
    robot = job.scene.robot
    q, _ = job.start.on(robot, "start")
    M = MassMatrix(job.scene.model)(q[None])[0]
    inertia = FIRST_ROTOR_RATIO * float(M.diagonal().max())
    least = LAST_ROTOR_RATIO * float(np.linalg.eigvalsh(M)[0])
    stages = []
    while inertia > least:
        scene = _with_effect(job.scene, HeavierRotors(inertia))
        stages.append(
            Stage(f"rotors of {inertia:.2g} kg m^2", dataclasses.replace(job, scene=scene))
        )
        inertia /= ROTOR_REDUCTION
    return stages


def growing_gravity(job: Job) -> list[Stage]:
    """Gravity increasing from zero."""
    if not job.scene.model.gravity.linear.any():
        return []
    return [
        Stage(
            f"{100 * fraction:.0f} % of gravity",
            dataclasses.replace(job, scene=_with_effect(job.scene, WeakerGravity(fraction))),
        )
        for fraction in GRAVITY_FRACTIONS
    ]


def other_durations(job: Job) -> list[Stage]:
    """Durations from shorter ones, or from longer ones with limits; velocities in proportion."""
    limited = bool(job.limits.bounded.any())
    return [
        Stage(f"a duration of {factor * job.grid.duration:.4g} s", _with_duration(job, factor))
        for factor in (LONGER_DURATIONS if limited else SHORTER_DURATIONS)
    ]


def finer_grids(job: Job) -> list[Stage]:
    """Grids from a few intervals of galerkin-2, doubled in each stage."""
    N = job.grid.intervals
    stages = []
    while N >= 2 * MIN_INTERVALS:
        N = (N + 1) // 2
        grid = Grid.uniform(job.grid.duration, N, galerkin(2, job.grid.order))
        if job.node_times:
            try:
                grid = grid.with_nodes(job.node_times)
            except InputError:  # too few nodes for the via points
                break
        stages.append(Stage(f"{N} intervals", job.on(grid)))
    return stages[::-1]


def narrowing_limits(job: Job) -> list[Stage]:
    """Limits from wider ranges."""
    if not job.limits.bounded.any():
        return []
    return [
        Stage(
            f"limits {factor:g} times as wide",
            job.with_options(limits=_widened(job.limits, factor)),
        )
        for factor in RANGE_RATIOS
    ]


def _with_effect(scene: Scene, effect: Effect) -> Scene:
    return dataclasses.replace(scene, effects=[*scene.effects, effect])


def _widened(limits: Limits, factor: float) -> Limits:
    """Limits whose ranges are `factor` times as wide, with the same centers."""
    if limits.parts:
        return Limits.of_segments([_widened(p, factor) for p in limits.parts], limits.ends)
    more = (factor - 1) / 2 * limits.ranges
    return dataclasses.replace(limits, lower=limits.lower - more, upper=limits.upper + more)


def _with_duration(job: Job, factor: float) -> Job:
    """The job with its duration times `factor`, and velocities of its ends in proportion."""
    grid = Grid(factor * job.grid.steps, job.grid.schemes)
    via = tuple(
        dataclasses.replace(each, time=factor * each.time, goal=_rescaled(each.goal, factor))
        for each in job.via
    )
    start, goal, limits = _rescaled(job.start, factor), _rescaled(job.goal, factor), job.limits
    if limits.parts:
        ends = [factor * end for end in limits.ends]
        job = job.with_options(limits=Limits.of_segments(limits.parts, ends))
    return dataclasses.replace(job.with_options(via=via), grid=grid, start=start, goal=goal)


def _rescaled(state: Goal, factor: float) -> Goal:
    """A state with its velocity divided by `factor`; task-space goals are unchanged."""
    if isinstance(state, FrameGoal) or state.v is None:
        return state
    return dataclasses.replace(state, v=np.asarray(state.v) / factor)


@dataclass(frozen=True)
class HeavierRotors(Effect):
    """The same additional inertia on every joint: M(q) + inertia * 1.

    For large inertia the problem is close to a cubic spline, which has a single minimum.

    inertia: in [kg m^2], or [kg] at sliding joints.
    """

    inertia: float
    key: ClassVar[str] = "heavier_rotors"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Rotor inertia is part of Pinocchio's model."""
        model.armature = model.armature + self.inertia

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"{self.inertia:.3g} kg m^2 or kg on every joint, for continuation"


@dataclass(frozen=True)
class WeakerGravity(Effect):
    """The scene's gravity times a fraction.

    fraction: from 0 to 1.
    """

    fraction: float
    key: ClassVar[str] = "weaker_gravity"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Gravity is part of Pinocchio's model."""
        model.gravity.linear = self.fraction * model.gravity.linear

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"{100 * self.fraction:.0f} % of gravity, for continuation"
