"""Motions that keep something within a narrow room: what is in its middle is kept first."""

from __future__ import annotations

import dataclasses

from hovi.optimize.criteria import Criteria
from hovi.optimize.start import Start
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.methods.free_first import FreeFirst
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.methods.method import Guess, ProblemMethod, Report
from hovi.planning.solver.status import STOPPED, Status
from hovi.system.deadline import Deadline


class MiddleFirst(ProblemMethod):
    """The motion that keeps the middle of narrow rooms, then the one within these from there.

    A narrow room is hardly seen from afar, and an equation is. From its middle, where the distance
    has no gradient, a solve may leave the room again: it is tried with a large barrier and with a
    small one, and then from the guess. The first one is left out near a motion within its rooms.
    """

    def supports(self, problem: TrajectoryProblem) -> bool:
        """Problems with narrow bounds of conditions whose values motions of their kind can keep."""
        has_values = problem.ld.k == 2 and not problem.periodic
        return has_values and any(each.middle is not None for each in problem.conditions)

    def minimize(
        self,
        problem: TrajectoryProblem,
        start: Guess,
        criteria: Criteria,
        report: Report | None = None,
    ) -> Answer:
        """See ProblemMethod.minimize; intervals may be split."""
        deadline, middle = Deadline(criteria.time_limit), problem.centered
        if start.z is not None:  # from a motion within the room
            return InteriorPoint().minimize(problem, start, criteria, report)
        first = FreeFirst() if FreeFirst().supports(middle) else InteriorPoint()
        found = first.minimize(middle, start, criteria, report)
        if found.status in STOPPED:
            return dataclasses.replace(found, problem=problem.on(found.problem.grid))
        begun = [(problem, start)]
        if found.status is Status.MINIMUM:
            wide = problem.on(found.problem.grid)
            begun = [(wide, Start(found.path)), (wide, Start(found.path, near=True)), *begun]
        for given, begin in begun:
            left = dataclasses.replace(criteria, time_limit=deadline.seconds_left)
            method = InteriorPoint(dataclasses.replace(found, path=begin.x))
            found = method.minimize(given, begin, left, report)
            if found.status in (Status.MINIMUM, *STOPPED):
                break
        return found
