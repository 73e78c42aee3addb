"""The initial guesses of a search: a direct one, and paths around obstacles that it is deep in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.planning.paths.ompl_paths import has_ompl
from hovi.planning.paths.path_guess import DEEP, depth_of, path_guesses
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError

MAX_PATHS = 8
"""Maximum number of starts from paths."""
PATH_FRACTION = 0.2
"""Fraction of the time limit for finding paths."""


@dataclass(frozen=True, eq=False)
class FirstGuesses:
    """A direct guess, how deep in obstacles it is, in [m], and guesses along paths around them.

    branches: guesses to other configurations at the goal. isolated: whether these, and that of the
        direct guess, are isolated there. obstacles: whether there are any, besides links.
    """

    direct: DiscretePath
    depth: float = -np.inf
    paths: tuple[DiscretePath, ...] = ()
    branches: tuple[DiscretePath, ...] = ()
    isolated: bool = False
    obstacles: bool = True

    @property
    def all(self) -> tuple[DiscretePath, ...]:
        """The paths, then the direct guess, then those to other branches."""
        return (*self.paths, self.direct, *self.branches)

    def sentence(self, by_path: bool, success: bool) -> str:
        """What the message of a solution says of its guess, "" if nothing.

        by_path: whether the solution began as one of the paths.
        """
        if self.depth < DEEP:
            return ""
        around = "around the obstacles" if self.obstacles else "on which links keep apart"
        if not has_ompl():
            where = "in obstacles" if self.obstacles else "where a link is in another"
            known = f"The direct guess is {self.depth:.2g} m deep {where}"
            extra = f"with OMPL (pip install 'hovi[obstacles]') a path {around} is tried first."
            return "" if success else f"{known}: {extra}"
        if not self.paths:
            found = f"OMPL found no path {around}"
            return f"{found}; the direct guess led here." if success else f"{found}."
        if not success:
            return f"Neither OMPL's paths {around} nor the direct guess led to a minimum."
        led = f"A path {around} by OMPL" if by_path else "The direct guess, no path by OMPL,"
        return f"{led} led here."


def first_guesses(
    problem: TrajectoryProblem,
    direct: DiscretePath,
    starts: int,
    seed: int,
    deadline: Deadline,
    progress: Callable[[str, float], None],
) -> FirstGuesses:
    """The guesses with which a search begins.

    Where the direct one is deep in obstacles and OMPL is installed, one path for every start but
    the last, and for a single one. seed: of all paths. deadline: of the search.
    """
    try:
        depth = depth_of(problem, direct)
    except OutOfTimeError:  # which the solve from it reports
        return FirstGuesses(direct)
    obstacles = problem.clearance is not None and len(problem.clearance.obstacles) > 0
    if depth < DEEP or not has_ompl():
        return FirstGuesses(direct, depth, obstacles=obstacles)
    progress("looking for paths around the obstacles", 0.0)
    paths = _drawn(problem, direct, deadline, min(max(starts - 1, 1), MAX_PATHS), seed)
    return FirstGuesses(direct, depth, paths, obstacles=obstacles)


def _drawn(
    problem: TrajectoryProblem, direct: DiscretePath, deadline: Deadline, count: int, seed: int
) -> tuple[DiscretePath, ...]:
    """So many paths, or those that are found in their fraction of the time that is left."""
    paths = list[DiscretePath]()
    try:
        with deadline.part(PATH_FRACTION).in_force():
            for path in path_guesses(problem, direct, count, seed):
                paths.append(path)
    except OutOfTimeError:
        pass
    return tuple(paths)
