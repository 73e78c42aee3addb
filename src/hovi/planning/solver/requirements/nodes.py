"""Equations at nodes: goals of frames, via points, and what is asked at given times."""

from __future__ import annotations

from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.condition import describe, whose
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.multipliers import largest_residual, node_residuals
from hovi.planning.solver.requirements.requirement import SATISFIED, Requirement
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Nodes(Requirement):
    """The problem's equations hold at their nodes, to SATISFIED in [rad] and [m]."""

    problem: TrajectoryProblem

    def violation(self, motion: Trajectory) -> str:
        """The equation with the largest residual, and by how much it is missed."""
        worst, size = largest_residual(self.problem, node_residuals(self.problem, motion.path))
        if size <= SATISFIED:
            return ""
        missed = describe(worst, motion.path)
        return f"{whose(worst)} at t = {worst.where.time:.4g} s is missed: {missed}"
