"""Motions that distances alone limit: solved without them, until it is seen whether they matter."""

from __future__ import annotations

import dataclasses

from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import STOPS, Reason, why_stopped
from hovi.planning.clearance.clearance_violation import near_pairs
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.methods.trust_region import TrustRegion
from hovi.planning.solver.status import Status, unfinished
from hovi.system.deadline import Deadline

SOLVED = Status.MINIMUM, Status.SADDLE
"""Statuses of motions that may be kept."""
ENDED = Status.INFEASIBLE, Status.TIME_LIMIT, Status.INTERRUPTED
"""Statuses after which distances are not looked at."""


class FreeFirst(ProblemMethod):
    """The method without limits, then the one within limits from its motion.

    The second one is left out where the motion without distances is one that keeps them, and where
    there is none for another reason; the first one near a motion that distances have held.
    """

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems with distances, and without other limits."""
        return problem.distances is not None and not problem.with_clearance(None).limited

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See ProblemMethod.minimize."""
        known = start.z is not None  # from a motion that distances held
        if known or contradiction(problem, no_limits(problem.coordinates)):
            return InteriorPoint().minimize(problem, start, criteria, report)
        deadline, free = Deadline(criteria.time_limit), problem.with_clearance(None)
        method = TrustRegion() if TrustRegion().supports(free) else InteriorPoint()
        found = method.minimize(free, start, criteria, report)
        found = dataclasses.replace(found, problem=problem)
        if found.status in ENDED:
            return found
        try:
            with deadline.in_force():
                apart = found.status in SOLVED and _keeps_distances(found)
        except STOPS as stopped:
            return _unchecked(found, why_stopped(stopped))
        if apart:
            return found
        left = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
        return InteriorPoint(found).minimize(problem, start, left, report)


def _keeps_distances(found: Answer) -> bool:
    """Whether no pair comes nearer than the margin."""
    problem = found.problem
    assert problem.distances is not None
    assert problem.clearance is not None
    motion = problem.trajectory(found.path)
    return len(near_pairs(motion, problem.distances, float(problem.clearance.margin))) == 0


def _unchecked(found: Answer, why: Reason) -> Answer:
    """A motion whose distances were not checked to the end."""
    status, reason = unfinished(why)
    message = (
        f"{reason} after {found.nit} steps, before the distances along the motion were checked; "
        f"the motion has the cost {found.cost:.10g}."
    )
    return dataclasses.replace(found, status=status, message=message)
