"""Distances are bounded only for the pairs of shapes that would come too close.

Most pairs stay far from each other, and then need no more than a check of the motion.
"""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.planning.clearance.clearance import Clearance, PartOfClearance
from hovi.planning.clearance.clearance_violation import near_pairs
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.lagrange_newton import LagrangeNewton
from hovi.planning.solver.methods.method import Guess, Method, Report
from hovi.planning.solver.methods.trust_region import TrustRegion
from hovi.planning.solver.status import Status, unfinished
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import record_interrupt

Solve = Callable[[TrajectoryProblem, Guess, Criteria], Answer]
Index = npt.NDArray[np.intp]

FIRST_BEYOND = 0.002
"""Distance beyond the margin, in [m], up to which pairs along a guess are bounded at once:
those that touch the margin along the motion of a similar problem."""
WITHOUT_LIMITS: tuple[Method, ...] = (TrustRegion(), LagrangeNewton())
"""Methods for a problem without limits of which no pair is near another."""


def with_active_pairs(
    solve: Solve,
    problem: TrajectoryProblem,
    start: Guess,
    criteria: Criteria,
    report: Report | None = None,
) -> Answer:
    """The result of solves with growing sets of pairs, until all pairs keep the margin.

    solve: of a problem from a guess with criteria. The first set are the pairs that violate or
    touch the margin along the guess; each solve begins at the last one's motion and on its grid.
    """
    limits = problem.limits or no_limits(problem.coordinates)
    if problem.distances is None or contradiction(problem, limits):
        return solve(problem, start, criteria)
    return _Rounds(solve, problem, start, criteria, report).run()


class _Rounds:
    """The solves so far. nit, history: of all of them."""

    def __init__(
        self,
        solve: Solve,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None,
    ) -> None:
        self._solve, self._problem, self._start, self._report = solve, problem, start, report
        self._criteria, self._deadline = criteria, Deadline(criteria.time_limit)

    def run(self) -> Answer:
        """Solve and add pairs until none is too close."""
        path = self._start.x
        try:
            chosen = self._too_close(self._problem, path, FIRST_BEYOND)
        except KeyboardInterrupt:
            record_interrupt()  # which the solve sees
            return self._solve(self._problem, self._start, self._criteria_left())
        except OutOfTimeError:
            return self._solve(self._problem, self._start, self._criteria_left())
        result = self._solved(self._problem, path, chosen)
        while result.status in (Status.MINIMUM, Status.SADDLE):
            more = _unless_stopped(partial(self._violating, result, chosen))
            if isinstance(more, Reason):
                return _unfinished(result, more)
            if len(more) == 0:
                break
            chosen = np.union1d(chosen, more)
            result = self._solved(result.problem, result.path, chosen).after(result)
        return result

    def _violating(self, result: Answer, chosen: Index) -> Index:
        """The other pairs that violate the margin."""
        return np.setdiff1d(self._too_close(result.problem, result.path), chosen)

    def _criteria_left(self) -> Criteria:
        """The criteria with the remaining time as time limit."""
        return dataclasses.replace(self._criteria, time_limit=self._deadline.seconds_left)

    def _too_close(
        self, problem: TrajectoryProblem, path: DiscretePath, beyond: float = 0.0
    ) -> Index:
        """Numbers of the pairs that come nearer than a distance beyond the margin."""
        assert problem.distances is not None
        assert problem.clearance is not None
        with self._deadline.in_force():
            least = float(problem.clearance.margin) + beyond
            return near_pairs(problem.trajectory(path), problem.distances, least)

    def _solved(self, problem: TrajectoryProblem, path: DiscretePath, chosen: Index) -> Answer:
        """A solve with some pairs; its problem has all of them again."""
        whole = problem.clearance
        assert whole is not None
        part = with_clearance(problem, PartOfClearance.of(whole, chosen.tolist()))
        criteria, start = self._criteria_left(), dataclasses.replace(self._start, x=path)
        if part.limited:
            result = self._solve(part, start, criteria)
        else:
            method = next(method for method in WITHOUT_LIMITS if method.supports(part))
            result = method.minimize(part, start, criteria, self._report)
        return dataclasses.replace(result, problem=with_clearance(result.problem, whole))


def with_clearance(problem: TrajectoryProblem, clearance: Clearance) -> TrajectoryProblem:
    """The same problem with other pairs, sharing what was built for this one."""
    other = copy.copy(problem)  # only its finer one depends on them, too
    object.__setattr__(other, "clearance", clearance)
    other.__dict__.pop("finer", None)
    return other


def _unless_stopped(check: Callable[[], Index]) -> Index | Reason:
    """What a check finds, or why it did not end: Ctrl-C or the time limit."""
    try:
        return check()
    except KeyboardInterrupt:
        record_interrupt()
        return Reason.INTERRUPTED
    except OutOfTimeError:
        return Reason.TIME_LIMIT


def _unfinished(result: Answer, why: Reason) -> Answer:
    """A result whose distances were not checked to the end."""
    status, reason = unfinished(why)
    message = (
        f"{reason} after {result.nit} steps, before the distances along the motion were checked; "
        f"the motion has the cost {result.cost:.10g}."
    )
    return dataclasses.replace(result, status=status, message=message)
