"""The path that a solve begins with, from a guess in any form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import check_path, stretched, with_turns
from hovi.discrete.node_continuity import require_continuous
from hovi.discrete.state import State
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
    return _turned_path(problem, motion, turns) if turns.any() else path


def _turned_path(problem: TrajectoryProblem, guess: Trajectory, turns: Array) -> DiscretePath:
    """A motion on the problem's grid. turns: full turns that it makes beyond its own, (nv,)."""
    T = problem.grid.duration
    curve = stretched(guess, T, problem.ld.k)
    return problem.path(with_turns(curve, problem.coordinates, T, turns) if turns.any() else curve)


def _says_turns(problem: TrajectoryProblem) -> bool:
    """Whether the angle of a continuous joint at the goal says its full turns."""
    goal = problem.goal
    return isinstance(goal, State) and bool(says_turns(goal, problem.coordinates).any())


def _turns_left(problem: TrajectoryProblem, guess: Trajectory) -> Array:
    """Full turns of continuous joints by which a guess ends too early, shape (nv,).

    They are known where the angle of the goal says its turns.
    """
    start, goal, on = problem.start, problem.goal, problem.coordinates
    if not (isinstance(goal, State) and _says_turns(problem)):
        return np.zeros(on.nv)
    first, last = guess.positions([0.0, guess.duration])
    q0, q1 = problem.ends[0]
    change = on.difference(q0, guess.q[0]) + last - first + on.difference(guess.q[-1], q1)
    return turns_after(goal, start, on, q0, change)
