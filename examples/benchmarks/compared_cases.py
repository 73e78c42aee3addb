"""Shared by side_by_side.py: what a problem is on which two checkouts are compared.

Everything is asked of hovi by the names that users import, so that any later version can be asked
the same, and every success is judged by outside_judge.py and task_world.py, without hovi.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from outside_judge import Asked, denial, oracle_model

Array = npt.NDArray[np.float64]

ALONE = {"self_collision": False, "processes": 1}
"""Options of all plans of arms: they are judged by their limits, and tasks by distances as well."""


@dataclass(frozen=True)
class Group:
    """Problems that are run one after the other in one process.

    kind: their class. names: of its cases. profiled: whether calls of the first one are counted.
    limit: of a case's processor time, in [s].
    """

    kind: str
    name: str
    names: tuple[str, ...]
    profiled: bool = False
    limit: float = 60.0


@dataclass(frozen=True)
class Outcome:
    """What became of a case. motion: None if there is none, as for a case that judges itself."""

    success: bool
    status: str
    message: str = ""
    nit: int | None = None
    cost: float | None = None
    motion: Any = field(default=None, repr=False)
    solution: Any = field(default=None, repr=False)


@dataclass(frozen=True)
class Case:
    """A problem, or a study of several.

    names: of its outcomes. solve: what is measured. outcomes: of what that returns.
    judge: says why a success is none, or "".
    """

    names: tuple[str, ...]
    solve: Callable[[], Any]
    judge: Callable[[Outcome], str]
    outcomes: Callable[[Any], Sequence[Outcome]] = lambda found: (outcome(found),)


@dataclass(frozen=True)
class Family:
    """A class of problems: its groups, fewer for a quick look, and the cases of a group by seed."""

    groups: Callable[[bool], list[Group]]
    cases: Callable[[Group, int], Iterator[Case]]


def outcome(solution: Any) -> Outcome:
    """The outcome of a solution."""
    return Outcome(
        bool(solution.success),
        str(solution.status),
        str(solution.message),
        int(solution.nit),
        float(solution.cost),
        solution.trajectory,
        solution,
    )


def bounds_of(robot: Any) -> tuple[Array, Array]:
    """The limits of a URDF on q, v, a and tau, shape (4, nv) each."""
    free = np.full(robot.nv, np.inf)
    v = np.where(robot.velocity_limit > 0, robot.velocity_limit, np.inf)
    tau = np.where(robot.effort_limit > 0, robot.effort_limit, np.inf)
    q = (robot.lower, robot.upper) if robot.vector_joints else (-free, free)
    return np.array([q[0], -v, -free, -tau]), np.array([q[1], v, free, tau])


def no_bounds(robot: Any) -> tuple[Array, Array]:
    """No limits, shape (4, nv) each."""
    free = np.full((4, robot.nv), np.inf)
    return -free, free


def asked_between(
    scene: Any, start: Any, goal: Any, duration: float, limits: str, **more: Any
) -> Asked:
    """What is asked of a motion between two states (q, v) of an arm under gravity."""
    robot = scene.robot
    lower, upper = bounds_of(robot) if limits == "urdf" else no_bounds(robot)
    parts = [(duration, oracle_model(robot.model))]
    return Asked(parts, [(0.0, *start), (np.inf, *goal)], lower, upper, **more)


def judged_motion(asked: Asked, samples: int | None = None) -> Callable[[Outcome], str]:
    """A judge of a motion by what is asked of it."""
    more = {} if samples is None else {"samples": samples}
    return lambda found: denial(found.motion, found.cost, asked, **more)


def at_rest(q: Any) -> tuple[Array, Array]:
    """A configuration and no velocity, for robots whose nv their model says later."""
    q = np.asarray(q, dtype=float)
    return q, np.zeros(1)
