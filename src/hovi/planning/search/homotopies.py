"""Ways to a hard job: easier versions of it in order, each a guess for the next.

A way is a family of jobs in one parameter, which starts where the action has few stationary
motions and ends at the job itself. [AllgowerGeorg2003]
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Effect
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import Limits
from hovi.planning.search.job import Job
from hovi.robot.mass_matrix import MassMatrix
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


HEAVIEST = 10.0
"""First rotors, over the largest inertia that a joint of the robot moves."""
LIGHTER = 10.0
"""By which factor rotors become lighter from rung to rung."""
LIGHTEST = 0.1
"""Last rotors, over the least eigenvalue of the mass matrix."""
GRAVITY = 0.0, 0.25, 0.5, 0.75
SHORTER = 0.125, 0.25, 0.5
LONGER = 2.0, 1.5, 1.25, 1.1
"""Durations over the job's: shorter for effort alone, longer where limits bind."""
FEWEST = 6
"""Intervals of the coarsest grid, at least."""
ROOM = 8.0, 4.0, 2.0, 1.5, 1.25, 1.1
"""Ranges of relaxed limits over those of the job."""


@dataclass(frozen=True, eq=False)
class Rung:
    """One job of a way, and what is easier about it in a few words."""

    name: str
    job: Job


Goal = TypeVar("Goal", State, State | FrameGoal)
Way = Callable[[Job], list[Rung]]
"""Rungs from the easiest; none where the way leads nowhere. The job itself is not among them."""


def lighter_rotors(job: Job) -> list[Rung]:
    """From joints on which heavy rotors turn: M(q) + c 1, c falling to zero.

    Torque limits wait for the last rung.
    """
    robot = job.scene.robot
    q, _ = job.start.on(robot, "start")
    M = MassMatrix(job.scene.model)(q[None])[0]
    inertia = HEAVIEST * float(M.diagonal().max())
    least = LIGHTEST * float(np.linalg.eigvalsh(M)[0])
    free = _without_torque_limits(job)
    rungs = []
    while inertia > least:
        scene = _eased(job.scene, HeavierRotors(inertia))
        rungs.append(
            Rung(f"rotors of {inertia:.2g} kg m^2", dataclasses.replace(free, scene=scene))
        )
        inertia /= LIGHTER
    return rungs


def growing_gravity(job: Job) -> list[Rung]:
    """From weightlessness."""
    if not job.scene.model.gravity.linear.any():
        return []
    return [
        Rung(
            f"{100 * share:.0f} % of gravity",
            dataclasses.replace(job, scene=_eased(job.scene, WeakerGravity(share))),
        )
        for share in GRAVITY
    ]


def other_durations(job: Job) -> list[Rung]:
    """From a shorter time, or from a longer one where limits bind; velocities in proportion."""
    limited = bool(job.limits.bounded.any())
    return [
        Rung(f"a duration of {share * job.grid.duration:.4g} s", _lasting(job, share))
        for share in (LONGER if limited else SHORTER)
    ]


def finer_grids(job: Job) -> list[Rung]:
    """From few intervals of galerkin-2, doubled each time."""
    N = job.grid.intervals
    rungs = []
    while N >= 2 * FEWEST:
        N = (N + 1) // 2
        grid = Grid.uniform(job.grid.duration, N, galerkin(2))
        if job.via:
            try:
                grid = grid.with_nodes([via.time for via in job.via])
            except InputError:  # too few nodes for the via points
                break
        rungs.append(Rung(f"{N} intervals", job.on(grid)))
    return rungs[::-1]


def narrowing_limits(job: Job) -> list[Rung]:
    """From limits of wider ranges."""
    if not job.limits.bounded.any():
        return []
    return [
        Rung(
            f"limits {share:g} times as wide",
            job.with_options(limits=_widened(job.limits, share)),
        )
        for share in ROOM
    ]


def _eased(scene: Scene, effect: Effect) -> Scene:
    return dataclasses.replace(scene, effects=[*scene.effects, effect])


def _without_torque_limits(job: Job) -> Job:
    lower, upper = job.limits.lower.copy(), job.limits.upper.copy()
    lower[3], upper[3] = -np.inf, np.inf
    return job.with_options(limits=Limits(lower, upper, job.limits.tolerance))


def _widened(limits: Limits, share: float) -> Limits:
    """Limits whose ranges are `share` times as wide, about the same middle."""
    more = (share - 1) / 2 * limits.ranges
    return Limits(limits.lower - more, limits.upper + more, limits.tolerance)


def _lasting(job: Job, share: float) -> Job:
    """The job in another time, its ends passed through faster or slower in proportion."""
    grid = Grid(share * job.grid.steps, job.grid.schemes)
    via = tuple(Via(share * each.time, _passed(each.goal, share)) for each in job.via)
    start, goal = _passed(job.start, share), _passed(job.goal, share)
    return dataclasses.replace(job.with_options(via=via), grid=grid, start=start, goal=goal)


def _passed(state: Goal, share: float) -> Goal:
    """A state passed through faster by 1/share; goals of frames leave the velocity free."""
    if isinstance(state, FrameGoal) or state.v is None:
        return state
    return dataclasses.replace(state, v=np.asarray(state.v) / share)


@dataclass(frozen=True)
class HeavierRotors(Effect):
    """The same inertia on every joint, beside what the joints have: M(q) + inertia * 1.

    With much of it the least effort is nearly that of a cubic spline, which has one minimum.

    inertia: in [kg m^2], or [kg] at sliding joints.
    """

    inertia: float
    key: ClassVar[str] = "heavier_rotors"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Rotors are simulated by Pinocchio itself."""
        model.armature = model.armature + self.inertia

    def describe(self) -> str:
        """One line for the account of a scene."""
        return f"{self.inertia:.3g} kg m^2 or kg on every joint, to make planning easier"


@dataclass(frozen=True)
class WeakerGravity(Effect):
    """A share of the scene's gravity.

    share: from 0 to 1.
    """

    share: float
    key: ClassVar[str] = "weaker_gravity"

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Gravity is simulated by Pinocchio itself."""
        model.gravity.linear = self.share * model.gravity.linear

    def describe(self) -> str:
        """One line for the account of a scene."""
        return f"{100 * self.share:.0f} % of gravity, to make planning easier"
