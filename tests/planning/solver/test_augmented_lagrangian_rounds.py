"""Rounds of the augmented Lagrangian on a problem whose constraints cannot be met."""

from __future__ import annotations

import pinocchio as pin

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.optimize.criteria import Criteria
from hovi.optimize.trust_region import Outcome, minimize
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import MAX_STUCK, minimize_constrained
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.solver import guess_path
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.manifold_robots import chain


def test_what_cannot_be_met_is_given_up_after_two_penalties_without_effect() -> None:
    """A passive slide that nothing moves, planned to move."""
    model = chain([pin.JointModelPX(), pin.JointModelPY()])
    model.jointPlacements[2] = pin.SE3.Identity()
    scene = Scene(load_robot(model), passive=["j1"])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 4, galerkin(1)))
    problem = TrajectoryProblem(ld, State([0.0, 0.0]), State([1.0, 1.0]))
    penalties = []

    def minimize_round(
        known: Multipliers, x: DiscretePath, decrease: float
    ) -> Outcome[DiscretePath]:
        penalties.append(known.torque_penalty)
        objective = ActionObjective(problem, multipliers=known)
        return minimize(objective, x, Criteria(decrease=decrease))

    path = guess_path(problem, "cubic")
    found = minimize_constrained(problem, path, minimize_round)
    assert not found.met
    assert "'j1'" in found.reason
    assert penalties == sorted(penalties)
    assert len(penalties) == MAX_STUCK + 2
    assert len(set(penalties)) == MAX_STUCK + 1
