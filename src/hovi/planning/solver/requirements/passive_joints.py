"""Passive joints: no torque acts on them."""

from __future__ import annotations

from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import passive_joints
from hovi.planning.solver.requirements.requirement import SATISFIED, Requirement
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class PassiveJoints(Requirement):
    """The torque of a passive joint vanishes, as moments over every interval or at its points."""

    problem: TrajectoryProblem

    def violation(self, motion: Trajectory) -> str:
        """The largest torque of a passive joint, relative to that of any joint."""
        fraction = ActionObjective(self.problem).residuals(motion.path).torque_fraction
        if fraction <= SATISFIED:
            return ""
        joints = passive_joints(self.problem)
        return f"the torque at passive joint {joints} is {fraction:.3g} of the largest"
