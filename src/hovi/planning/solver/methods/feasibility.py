"""A feasible motion at the quadrature points, or the reason for infeasibility."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from hovi.discrete.grid import DiscretePath
from hovi.optimize.barrier import Barrier
from hovi.optimize.ended import STOPPED, Reason
from hovi.optimize.start import Start
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.first_multipliers import first_multipliers
from hovi.planning.solver.limits.restored_motion import locally_infeasible, restored_motion
from hovi.planning.solver.methods.bounded_search import EXACT_TOLERANCES, Bounded, BoundedSearch
from hovi.planning.solver.methods.cleared_motion import cleared_motion

NEARBY_MU = 1e-2
"""First barrier parameter from a motion that nearly is a solution, relative to the mean density of
the objective: a larger one moves it away from its bounds, and perhaps to another minimum."""
SHIFT_LEVEL = 1.0
"""Barrier parameter where a moved problem is begun, relative to the largest move of an output."""
SHIFT_LEVELS = 1e-5, 3e-2
"""Least and largest barrier parameter where a moved problem is begun, relative to the mean
density."""
WARM_SHIFT = 1e-3
"""Largest move of an output, as a fraction of its range, for a start at the old solution."""
NEWTON_SHIFT, NEWTON_STEPS = 0.1, 20
"""Largest move of an output, as a fraction of its range, for whole Newton steps from the old
solution, and the maximum number of these."""
WARM_BARRIER, WARM_DECREASE = 1e-7, 3e-7
"""Least last barrier parameter of a solve from the old solution, relative to the mean density, and
the predicted decrease at which it ends, relative to the cost: the cost exceeds its minimum by less
than 1e-6."""
WARM_MARGIN = 1e-6
"""Least distance of the slacks of a solve from the old solution from their bounds."""
WARM_STEPS = 100
"""Maximum number of steps from a motion that nearly is a solution, without obstacles."""


def feasible_motion(search: BoundedSearch) -> tuple[Bounded, str]:
    """A motion from the guess within bounds at points and control points, or why there is none."""
    ended = _solved_nearby(search)
    if ended is None and search.near is not None:
        search.near = search.no_near_rows()
        ended = cleared_motion(search, search.guess)
    elif ended is None:
        ended = search.solve(Start(search.guess))
        if ended.why is Reason.DIVERGED and search.margins.values.any():
            # next to what is given at a bound a margin leaves no room: intervals are halved instead
            search.margins = search.no_margins()
            search.margins.fixed = True
            ended = search.solve(Start(search.guess))
    failed = ended.why is Reason.DIVERGED
    if search.near is not None and failed:
        missed = search.too_close if ended.feasible else search.worst
        return ended, missed(ended.x)
    if search.near is not None or not failed or _satisfies(search, ended):
        return ended, ""
    reason = locally_infeasible(search, ended)
    if reason or ended.why in STOPPED:
        return ended, reason
    return restored_motion(search, ended)


def _satisfies(search: BoundedSearch, ended: Bounded) -> bool:
    """Whether a motion is within its bounds and satisfies its equations."""
    return ended.feasible and not search.unsatisfied(ended.x)


def _solved_nearby(search: BoundedSearch) -> Bounded | None:
    """The solution near a guess that is taken to be near one; None if it is not, or that fails."""
    if not search.start.near:
        return None
    whole = search.criteria
    most, along = whole.max_iterations, search.along
    if search.near is None:  # beyond, a solve from the guess is shorter
        most = min(WARM_STEPS, most)
    search.criteria = dataclasses.replace(whole, max_iterations=most)
    ended = solved_from(search, search.guess) if along is None else _solved_along(search, along)
    search.criteria = whole
    if ended.settled and not search.unmet:
        return ended
    search.multipliers, search.unmet = None, ""
    return None


def _solved_along(search: BoundedSearch, along: CentralPath) -> Bounded:
    """Solve near the solution of a central path, from it if that suffices, else further back."""
    _adopt(search, along)
    level = search.level
    if level is None:
        ended = _followed(search, along)
        if ended is not None:
            return ended
        moved = search.problem.moved(along.last)
        shift = _shift(search, along.last, moved)
        level = float(np.clip(SHIFT_LEVEL * shift, *SHIFT_LEVELS))
        if along.barrier is not None and shift <= WARM_SHIFT:
            ended = _solved_warm(search, along.barrier, moved)
            if ended.settled:
                return ended
            _adopt(search, along)
    return _solved_from_level(search, along, level)


def _shift(search: BoundedSearch, path: DiscretePath, moved: DiscretePath) -> float:
    """How far outputs move to the ends and equations of the problem, relative to their ranges.

    By the first-order step to the equations. path: the known motion. moved: between other ends.
    """
    objective = search.objective(search.known_multipliers(moved), tolerances=EXACT_TOLERANCES)
    y = objective.outputs(moved).y
    change = y - objective.outputs(path).y
    residual = objective.residual(moved)
    if len(residual) > 0:
        model = objective.model(moved, *Barrier.inactive(objective.bounds, y).condensed(y))
        factor = model.factor(0.0)
        if factor is None:
            return math.inf
        change += objective.push(model.correction(factor, residual), model)
    return float(np.max(np.abs(change), initial=0.0))


def _adopt(search: BoundedSearch, along: CentralPath) -> None:
    """Take over the rows and multipliers of a similar problem on as many intervals."""
    if along.rows is not None:
        search.rows = along.rows.copied()
    if along.margins is not None and along.margins.shape == search.margins.values.shape:
        search.margins.values = along.margins
    if along.near is not None and search.near is not None:
        search.near = along.near.on(search.problem)
    if along.conditions is not None:
        known = first_multipliers(search.problem, along.last)
        if [len(each) for each in known.conditions] == [len(each) for each in along.conditions]:
            search.multipliers = dataclasses.replace(known, conditions=list(along.conditions))


def _followed(search: BoundedSearch, along: CentralPath) -> Bounded | None:
    """Follow the solution of a central path by whole Newton steps; None if it is not found so."""
    known = along.barrier
    if known is None or search.near is not None or search.problem.constrained:
        return None
    objective, moved = search.objective(None), search.problem.moved(along.last)
    y = objective.outputs(moved).y
    if len(y) != len(known.s) or np.max(np.abs(y - known.s), initial=0.0) > NEWTON_SHIFT:
        return None
    criteria = dataclasses.replace(
        search.remaining_criteria(),
        barrier=max(search.criteria.barrier, WARM_BARRIER),
        enough=WARM_DECREASE,
        max_iterations=min(NEWTON_STEPS, search.criteria.max_iterations),
    )
    start = Start(moved, dataclasses.replace(known, bounds=objective.bounds))
    ended = search.followed(objective, start, criteria)
    if ended.why is Reason.STATIONARY or ended.why in STOPPED:
        return ended
    _adopt(search, along)
    return None


def _solved_warm(search: BoundedSearch, known: Barrier, path: DiscretePath) -> Bounded:
    """Solve from a solution itself, whose slacks and multipliers are known.

    A few steps are enough, or there is another way; and they end where they change the cost by
    less than the barrier does.
    """
    whole, mu = search.criteria, max(search.criteria.barrier, WARM_BARRIER)
    search.criteria = dataclasses.replace(
        whole,
        barrier=mu,
        enough=WARM_DECREASE,
        max_iterations=min(WARM_STEPS, whole.max_iterations),
    )
    objective = search.objective(search.multipliers)
    outputs = objective.outputs(path)
    z = None
    if len(known.s) == len(outputs.y):
        mu *= outputs.density(objective.bounds.measure)
        z = Barrier.central(objective.bounds, outputs.y, mu, None, WARM_MARGIN, known)
    ended = search.solve(Start(path, z))
    search.criteria = whole
    return ended


def _solved_from_level(search: BoundedSearch, along: CentralPath, level: float) -> Bounded:
    """Solve from the point of a central path with a barrier as large as a level."""
    problem, other_ends = search.problem, search.near is not None and search.level is None
    fraction, point = along.close(level, problem.coordinates) if other_ends else along.at(level)
    path = problem.moved(point)
    if along.rows is None:
        search.rows.refine(path, fraction)
    search.look_around(path)
    search.at_level = True
    try:
        start = search.start_at(path, fraction, search.objective(search.multipliers), True)
        return search.solve(start)
    finally:
        search.at_level = False


def solved_from(search: BoundedSearch, path: DiscretePath) -> Bounded:
    """Solve from a motion that nearly is a solution, with a small barrier from the beginning.

    Parts are halved first, as far as this barrier asks for: the motion may exceed coarser control
    points.
    """
    search.look_around(path)
    search.rows.refine(path, NEARBY_MU)
    return search.solve(search.start_at(path, NEARBY_MU, search.objective(search.multipliers)))
