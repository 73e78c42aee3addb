"""A motion that keeps its distances, from one that was found without them."""

from __future__ import annotations

import dataclasses

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import STOPPED, Reason
from hovi.optimize.start import Start
from hovi.planning.solver.first_multipliers import first_multipliers, first_penalty
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.methods.bounded_search import (
    Bounded,
    BoundedSearch,
)
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.planning.solver.near.push_out import pushed_out
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

AHEAD = 0.06
"""Distance beyond the least one up to which pairs get rows at first, in [m]."""
KEPT = 0.03
"""Distance beyond the least one up to which pairs keep their rows after a rough motion, in [m]."""
FIRST_MU = 0.1
"""First barrier parameter from a motion that was moved, relative to the cost's mean density."""
ROUGH_STEPS = 100
"""Maximum number of steps from a motion that was moved to a rough one."""
ROUGH_VIOLATION = 0.05
"""Largest violation of a bound, relative to its range, from which a rough motion is solved on."""
DETOUR = 1.05
"""Cost of a rough motion, relative to that of one without distances, above which it is a detour."""


def cleared_motion(search: BoundedSearch, guess: DiscretePath) -> Bounded:
    """A motion within limits that keeps its distances, from a guess that may keep neither.

    It is solved without distances, until it can be seen whether it keeps them. If it does not, it
    is moved out of the obstacles, and so is the guess if that takes a detour. The better rough
    motion, by bounds and then by cost, is solved to its end.
    """
    assert search.near is not None
    free = _without_distances(search, guess)
    if not search.near.blocked and free.why is not Reason.DIVERGED:
        return free
    rough = [_rough_with_distances(search, free.x)]
    if rough[0] is None or rough[0].rank > (False, DETOUR * abs(free.outputs.value)):
        rough.append(_rough_with_distances(search, guess))
    best = min(filter(None, rough), key=lambda each: each.rank, default=None)
    if best is not None:
        return best.solved(search)
    raise_if_late()  # or more time might lead to one
    return dataclasses.replace(free, why=Reason.DIVERGED)


def _without_distances(search: BoundedSearch, guess: DiscretePath) -> Bounded:
    """The solution, unless its distances are too small: then a rough motion without them."""
    near = search.near
    assert near is not None
    near.probing, guess = True, guess if search.free is None else search.free
    if not search.problem.constrained:
        return search.solve(Start(guess))

    search.near = None
    rough, _ = _rough(search, guess, first_multipliers(search.problem, guess), None)
    search.near = near
    near.extend(search.problem, rough.x, AHEAD)
    return rough if near.blocked or rough.why in STOPPED else search.solve(Start(rough.x))


@dataclass(frozen=True, eq=False)
class _Rough:
    """A rough motion with distances, its rows, and multipliers of constraints, if there are any."""

    ended: Bounded
    multipliers: Multipliers | None
    rows: LimitRows
    near: ClearanceRows

    @property
    def rank(self) -> tuple[bool, float]:
        """Whether it does not keep its bounds yet, and the action."""
        return not self.ended.feasible, self.ended.outputs.value

    def solved(self, search: BoundedSearch) -> Bounded:
        """The solve from there to the end, with rows of pairs that are near."""
        x, barrier = self.ended.x, self.ended.z
        near, kept = self.near.thinned(x, KEPT)
        points = len(barrier.s) - len(self.near.order)
        search.rows, search.near = self.rows, near
        search.multipliers = self.multipliers
        if self.ended.why in STOPPED:
            return search.solve(Start(x))
        return search.solve(Start(x, barrier.of(np.append(np.arange(points), points + kept))))


def _rough_with_distances(search: BoundedSearch, path: DiscretePath) -> _Rough | None:
    """A rough motion near a path that is moved out of obstacles; None if there is none."""
    problem, distances = search.problem, search.problem.distances
    assert distances is not None
    search.rows, search.near = search.coarse_rows(), search.no_near_rows()
    moved = pushed_out(problem, path, distances, search.near.least)
    if moved is None:
        return None
    search.near.extend(problem, moved, AHEAD)
    search.near.watchful = True
    known = first_multipliers(problem, moved) if problem.constrained else None
    ended, known = _rough(search, moved, known, FIRST_MU)
    if ended.why is Reason.DIVERGED or ended.violation > ROUGH_VIOLATION:
        return None
    return _Rough(ended, known, search.rows, search.near)


def _rough(
    search: BoundedSearch,
    path: DiscretePath,
    known: Multipliers | None,
    mu: float | None,
) -> tuple[Bounded, Multipliers | None]:
    """A solve up to a large barrier parameter, and the multipliers of equations then.

    Equations are missed by a little, at a price.

    known: multipliers of constraints. mu: the first such parameter, None for a start at the guess.
    """
    criteria = search.remaining_criteria().rough()
    criteria = dataclasses.replace(
        criteria, max_iterations=min(ROUGH_STEPS, criteria.max_iterations)
    )
    objective = search.objective(known)
    if known is not None:  # near obstacles, steps that satisfy equations at once lead to fewer ways
        objective.penalty = first_penalty(search.problem, path)
    start = Start(path) if mu is None else search.start_at(path, mu, objective)
    ended = search.minimized(objective, start, criteria)
    if known is not None:
        objective.hold(objective.penalty * objective.residual(ended.x))
    return ended, objective.action.multipliers
