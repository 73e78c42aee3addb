"""The scale of a barrier: the objective spread over the duration of a motion."""

from __future__ import annotations

import dataclasses

import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.methods.bounded_search import mean_density
from hovi.planning.solver.solver import guess_path
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q


@pytest.mark.parametrize("T", [0.5, 2.0])
def test_a_barrier_begins_at_the_mean_of_the_cost_over_time_whatever_its_sign(
    arm_scene: Scene, T: float
) -> None:
    """Costs with a potential may be negative. The weights of the points add up to T."""
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(T, 6, galerkin(2)))
    problem = TrajectoryProblem(ld, State(HANG), State(REACH_Q))
    objective = BoundedAction(problem, as_limits(arm_scene.robot, {"base": "none", "v": 90.0}))
    outputs = objective.outputs(guess_path(problem, "cubic"))
    assert outputs.value > 1.0
    for sign in (1, -1):
        signed = dataclasses.replace(outputs, value=sign * outputs.value)
        mean = outputs.value / T
        assert mean_density(signed, objective.bounds.measure) == pytest.approx(mean, rel=1e-12)
