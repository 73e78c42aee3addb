"""The path that a solve begins with, from a guess in any form."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve, check_path, joined, stretched, with_turns
from hovi.discrete.node_continuity import require_continuous
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.notation.goal_turns import says_turns, turns_after
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]


def guess_path(problem: TrajectoryProblem, guess: str | Trajectory | DiscretePath) -> DiscretePath:
    """A guess as a path on the problem's grid, with the problem's boundary data."""
    coordinates, grid = problem.coordinates, problem.grid
    if isinstance(guess, DiscretePath):
        if problem.ld.k == 2:
            check_path(guess, grid, coordinates)
        else:
            grid.require_path(guess, coordinates.nq, coordinates.nv)
            require_continuous(guess, grid, coordinates.curved_space)
        return problem.moved(guess)
    if isinstance(guess, str):
        return problem.guess(guess)
    if guess.v.shape[1] != coordinates.nv:
        raise InputError(
            f"the guess has {guess.v.shape[1]} velocities, but {coordinates.owner} has "
            f"{coordinates.nv}; use a motion of the same one."
        )
    return _turned_path(problem, guess, _turns_left(problem, guess))


def turned_on(problem: TrajectoryProblem, path: DiscretePath) -> DiscretePath:
    """The path of a similar problem with the full turns that a goal says; itself if it has them."""
    if not _says_turns(problem):
        return path
    motion = problem.trajectory(path)
    turns = _turns_left(problem, motion)
    return _turned_path(problem, motion, turns) if np.any(turns) else path


def _turned_path(
    problem: TrajectoryProblem, guess: Trajectory, turns: Sequence[Array]
) -> DiscretePath:
    """A motion on the problem's grid.

    turns: full turns that it makes beyond its own up to each seam, and up to the end, (nv,) each.
    """
    T, on = problem.grid.duration, problem.coordinates
    curve = stretched(guess, T, problem.ld.k)
    if not np.any(turns):
        return problem.path(curve)
    times = np.array([0.0, *(each.time for each in problem.holds), T])
    pieces = [
        with_turns(partial(_from, curve, begin), on, end - begin, more)
        for (begin, end), more in zip(pairwise(times), turns, strict=True)
    ]
    return problem.path(joined(pieces, times[:-1]))


def _from(curve: Curve, begin: float, t: Array) -> tuple[Array, ...]:
    """A curve from a time on."""
    return curve(begin + np.asarray(t))


def _says_turns(problem: TrajectoryProblem) -> bool:
    """Whether the angle of a continuous joint at a goal says its full turns."""
    return any(says_turns(goal, problem.coordinates).any() for goal in problem.goals)


def _turns_left(problem: TrajectoryProblem, guess: Trajectory) -> list[Array]:
    """Full turns of continuous joints that a guess lacks up to each seam and the end, (nv,) each.

    They are known where the angle of a goal says its turns.
    """
    start, on, q0, holds = problem.start, problem.coordinates, problem.ends[0][0], problem.holds
    left = [np.zeros(on.nv) for _ in (*holds, problem.goal)]
    if not _says_turns(problem):
        return left
    ratio = guess.duration / problem.grid.duration
    t = np.array([0.0, *(ratio * each.time for each in holds), guess.duration])
    at, q = guess.positions(t), [*(each.q for each in holds), problem.ends[0][1]]
    begin = on.difference(q0, guess.q[0]) - at[0]
    for i, goal in enumerate(problem.goals):
        change = begin + at[i + 1] + on.difference(guess.configurations(t[i + 1])[0], q[i])
        change = change + 2 * np.pi * np.sum(left, axis=0)
        left[i] = turns_after(goal, start, on, q0, change)
    return left
