"""The path that a solve begins with, from a guess in any form."""

from __future__ import annotations

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import check_path, stretched
from hovi.discrete.node_continuity import require_continuous
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem


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
    return problem.path(stretched(guess, grid.duration, problem.ld.k))
