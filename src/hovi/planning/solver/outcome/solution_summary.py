"""What a solution says of itself: how far it keeps what was asked, and its lines in a terminal."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.way_back.excused import Excused
from hovi.planning.solver.outcome.margins import Margins, margins_of
from hovi.planning.solver.outcome.violation import violation_of
from hovi.planning.solver.status import Status
from hovi.system.summary import Summarized, Summary

if TYPE_CHECKING:
    from hovi.planning.problem.tolerance import Accuracy


class SolutionSummary(Summarized):
    """A solution: its outcome, motion, cost, error and time."""

    success: bool
    status: Status
    message: str
    trajectory: Trajectory
    cost: float
    nit: int
    n_neg: int
    error_estimate: float | None
    accuracy: Accuracy | None
    minima: tuple[float, ...]
    setup_seconds: float
    solve_seconds: float
    problem: TrajectoryProblem | None

    def margins(self) -> Margins:
        """How far the motion stays from each of its limits, and from obstacles.

        Raises InputError if this solution has no problem.
        """
        return margins_of(self._solved_problem, self.trajectory)

    @cached_property
    def violation(self) -> str:
        """What the motion violates of its ends, limits, distances and equations, "" if nothing.

        A clause about the first that does not hold to 1e-6. If none is measured but the problem is
        infeasible, as at a goal that can only be reached from beyond a bound, its message.
        Raises InputError without a problem.
        """
        violated = violation_of(self._solved_problem, self.trajectory)
        if not violated and self.status is Status.INFEASIBLE:
            return self.message.removesuffix(".")
        return violated

    @property
    def usable(self) -> bool:
        """Whether ends, limits, distances and equations hold, be the motion a minimum or not."""
        return not self.violation

    @property
    def excused(self) -> tuple[Excused, ...]:
        """What the start exceeds of its limits, by how much at most and until when.

        The motion is led back: from then on all limits hold, and until then these wider ones.
        """
        limits = None if self.problem is None else self.problem.limits
        return () if limits is None else limits.excused

    @property
    def _solved_problem(self) -> TrajectoryProblem:
        """The problem. Raises InputError if there is none."""
        if self.problem is None:
            raise InputError("this solution has no problem; call plan again instead.")
        return self.problem

    def _summary(self) -> Summary:
        motion = self.trajectory
        name = "a robot" if motion.robot is None else motion.robot.name
        rows = [
            ("outcome", self.message),
            ("motion", f"{name}, {motion.duration:g} s, {motion.grid.in_words}"),
            ("cost", f"{self.cost:.8g}"),
        ]
        if self.error_estimate is not None:
            rows.append(("error", f"{self.error_estimate:.1e} of the cost, estimated"))
        if len(self.minima) > 1:
            others = ", ".join(f"{each:.5g}" for each in self.minima[:6])
            rows.append(("minima", f"{len(self.minima)}: {others}"))
        taken = f"{self.setup_seconds:.2g} s setup, {self.solve_seconds:.2g} s solving"
        rows.append(("time", f"{self.nit} steps, {taken}"))
        return Summary(f"Solution: {self.status}", tuple(rows))
