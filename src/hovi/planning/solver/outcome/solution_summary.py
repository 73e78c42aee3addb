"""What a terminal or a notebook shows of a solution."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hovi.discrete.trajectory import Trajectory
from hovi.planning.solver.status import Status
from hovi.system.summary import Summarized, Summary

if TYPE_CHECKING:
    from hovi.planning.problem.tolerance import Accuracy


class SolutionSummary(Summarized):
    """A solution: its outcome, motion, cost, error and time."""

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
