"""A motion within limits and the lengths of its parts: the interior point with both unknown.

It makes limits hold between the points as for given durations: between two tightenings of bounds,
or halvings of intervals, a solve moves the motion and the lengths.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.barrier import Barrier
from hovi.optimize.bordered_model import BorderedModel
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import STOPPED, STOPS, Ended, Outputs, Reason, why_stopped
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.start import Start
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.free_duration.timed_bounded_action import TimedBoundedAction
from hovi.planning.solver.free_duration.timed_path import TimedPath, stretched_path
from hovi.planning.solver.methods.bounded_search import (
    EXACT_TOLERANCES,
    ROUGH_TOLERANCES,
    Begun,
    Bounded,
    BoundedSearch,
)
from hovi.planning.solver.methods.feasibility import solved_from
from hovi.planning.solver.methods.limits_between_points import halved, usable
from hovi.planning.solver.methods.method import Guess
from hovi.planning.solver.missed_equations import spurious_sentence
from hovi.planning.solver.near.cleared_action import ClearedAction
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.status import Status, saddle_in_words, unfinished
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]

LAST_DECREASE = 1e-11
"""Relative decrease at which a motion and its lengths are accurate: its square root is the relative
error of the slope in a length."""


def minimum_within_limits(
    problem: TrajectoryProblem,
    limits: Limits,
    start: Guess,
    price: TimePrice,
    lengths: Array,
    criteria: Criteria,
) -> tuple[Answer, Array]:
    """A motion of least S + w sum L within limits, from a guess for the problem's L; and its L."""
    known = problem, limits, criteria, None, start
    search = TimedSearch(*known, price=price, lengths=lengths)
    try:
        found = _searched(search)
    except STOPS as stopped:
        found = _ended(search, why_stopped(stopped))
    return found, search.lengths


@dataclass(eq=False)
class TimedSearch(BoundedSearch):
    """A search in which every solve moves the lengths, too: the problem is that of the last ones.

    price: of time.
    """

    free_duration = True
    price: TimePrice = dataclasses.field(kw_only=True)

    def solve(self, start: Begun) -> Bounded:
        """Solve with bounds at the quadrature points, from the problem's lengths."""
        raise_if_late()
        known, criteria = self.known_multipliers(start.x), self.remaining_criteria()
        first = self.objective(known, "band", EXACT_TOLERANCES)
        objective = TimedBoundedAction(first, self.price, self.lengths)
        criteria = dataclasses.replace(criteria, decrease=LAST_DECREASE)
        x = TimedPath(start.x, self.lengths)
        found = minimize_bounded(objective, Start(x, start.z), criteria, self.report)
        self.iterations += len(found.steps)
        self.history += found.steps
        if found.why is Reason.STATIONARY and not objective.satisfies_equations(found.x):
            found.why = Reason.DIVERGED
        last = objective.first
        assert last.rows is not None
        self.rows = last.rows
        if isinstance(last, ClearedAction):
            self.near = last.near
        if found.why is not Reason.DIVERGED:
            self.multipliers = last.action.multipliers
        self.back_to(found.x.lengths)
        self.last = self.problem, found.x.path
        ended = self._at_its_lengths(found, objective)
        self.points, self.along = [], None  # these are of other lengths
        stationary = ended.why is Reason.STATIONARY
        self.unmet = spurious_sentence(self.problem, ended.x) if stationary else ""
        if stationary and ended.saved:
            self._add_points(ended, objective.at(found.x.lengths))
        return ended

    def solve_fixed(self, path: DiscretePath) -> Bounded:
        """Solve for the problem's lengths, well enough for a motion that is to be stretched."""
        known, rough = self.known_multipliers(path), self.remaining_criteria().rough()
        objective = self.objective(known, tolerances=ROUGH_TOLERANCES)
        ended = self.minimized(objective, Start(path), rough)
        if ended.why is not Reason.DIVERGED:
            self.multipliers = objective.action.multipliers
        return ended

    def back_to(self, lengths: Array) -> None:
        """See BoundedSearch: the problem and its guess for these lengths."""
        clock, before, now = self.price.clock, self.problem, self.lengths
        if np.array_equal(lengths, now):
            return
        self.problem, self.lengths = before.lasting(clock, now, lengths), lengths
        self.limits = self.problem.limits or self.limits
        self.rows = self.rows.on(self.problem.grid)
        self.near = self.near and self.near.on(self.problem, self.rows)
        guess = stretched_path(self.guess, before.grid, clock, now, lengths)
        self.guess = self.problem.moved(guess)

    def _at_its_lengths(
        self, found: Ended[TimedPath, Barrier], objective: TimedBoundedAction
    ) -> Bounded:
        """The end of a solve for the problem of its lengths, whose points weigh more or less."""
        lengths, barrier, clock = found.x.lengths, found.z, self.price.clock
        fraction, at = objective.fraction(lengths), objective.at(lengths)
        mean = float(fraction.mean()) if len(fraction) > 0 else 1.0
        saved = list[tuple[float, DiscretePath]]()
        for product, x in found.saved:
            grid = objective.at(x.lengths).problem.grid
            path = stretched_path(x.path, grid, clock, x.lengths, lengths)
            saved.append((mean * product, self.problem.moved(path)))
        return Ended(
            found.x.path,
            Outputs(found.outputs.value - self.price.of(lengths), found.outputs.y),
            dataclasses.replace(
                barrier,
                bounds=at.bounds,
                zl=fraction * barrier.zl,
                zu=fraction * barrier.zu,
                mu=mean * barrier.mu,
            ),
            found.why,
            found.steps,
            found.model,
            saved=saved,
        )

    def negative_eigenvalues(self, ended: Bounded) -> int:
        """n_neg of the condensed system, the lengths among its unknowns."""
        model = ended.model
        if ended.why is not Reason.STATIONARY or not isinstance(model, BorderedModel):
            return -1
        return 0 if model.factor(0.0) is not None else model.negative_eigenvalues()


def _searched(search: TimedSearch) -> Answer:
    """A minimum at the points, then one within limits everywhere."""
    ended = _at_the_points(search)
    if ended.why in STOPPED or not usable(ended):
        return _ended(search, ended.why)
    ended, reason, _ = halved(search, ended)
    reason = reason or search.unmet
    if not reason and ended.why is Reason.STATIONARY:  # others may just lack rows yet
        reason = search.too_close(ended.x)
    if not reason and ended.why is not Reason.STATIONARY:
        return _ended(search, ended.why)
    problem, x, n_neg = search.problem, ended.x, search.negative_eigenvalues(ended)
    value, steps = cost_of(problem, x), search.iterations
    held = f"limits hold everywhere, on {problem.grid.intervals} intervals"
    status, what = Status.MINIMUM, f"a minimum of cost {value:.10g} after {steps} steps; {held}"
    if reason:
        status, what = Status.INFEASIBLE, f"no motion within the limits was found: {reason}"
    elif n_neg != 0:
        status, what = Status.SADDLE, saddle_in_words(value, n_neg)
    instants, forces = search.forces(ended)
    central = search.central_path(ended) if status is Status.MINIMUM else None
    return Answer(
        problem,
        x,
        value,
        status,
        f"{what}.",
        steps,
        n_neg,
        search.history,
        forces,
        instants,
        search.prices(ended),
        central=central,
    )


def _at_the_points(search: TimedSearch) -> Bounded:
    """A minimum with bounds at the points, near a motion of the guess's own lengths if possible.

    A distant guess first becomes a motion of its lengths, so that a motion of another shape is not
    stretched or shrunk to a bound; lengths that are too short for one move from the beginning.
    """
    path = search.guess
    if not search.start.near:
        fixed = search.solve_fixed(path)
        if fixed.why in STOPPED:
            return fixed
        if not fixed.feasible:
            return search.solve(Start(path))
        path = fixed.x
    near = solved_from(search, path)
    return near if usable(near) or near.why in STOPPED else search.solve(Start(search.guess))


def _ended(search: TimedSearch, why: Reason) -> Answer:
    """The motion of the last solve, which is no minimum."""
    problem, path = search.last
    value, steps = cost_of(problem, path), search.iterations
    if why is Reason.STATIONARY:
        status, reason = Status.INFEASIBLE, "no motion within the limits was found"
    else:
        status, reason = unfinished(why)
    message = f"{reason} after {steps} steps; the motion is the best so far, of cost {value:.10g}."
    return Answer(problem, path, value, status, message, steps, history=search.history)
