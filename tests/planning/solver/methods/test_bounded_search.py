"""Solves within limits: the scale of a barrier, and conditions at nodes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.optimize.banded_model import BandModel
from hovi.optimize.bordered_model import EquationModel
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.solver import guess_path, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.robot.loading import load_robot
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
        assert signed.density(objective.bounds.measure) == pytest.approx(mean, rel=1e-12)


def reaches() -> tuple[TrajectoryProblem, TrajectoryProblem]:
    """A reach of a UR5 to joint angles, and to the position of its tool there."""
    robot = load_robot("ur5")
    scene = Scene(robot, [Gravity()])
    start, end = State([0.0, -1.2, 1.0, 0.2, 0.4, 0.0]), [0.9, -0.8, 0.7, 0.1, 0.6, 0.3]
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.5, 12, galerkin(2, 2, 8)))
    limits = as_limits(robot, "urdf")
    position = robot.frame_pose("tool0", np.array(end))[:3, 3]
    goal = FrameGoal("tool0", position=position, guess=end)
    to_joints = TrajectoryProblem(ld, start, State(end), limits)
    return to_joints, TrajectoryProblem(ld, start, goal, limits)


def test_a_goal_for_a_frame_takes_hardly_more_steps_than_one_for_joints() -> None:
    """The steps meet the conditions themselves, instead of rounds with their multipliers."""
    joints, frame = reaches()
    to_joints, to_frame = solve_on_grid(joints, "cubic"), solve_on_grid(frame, "cubic")
    assert (to_joints.status, to_frame.status) == (Status.MINIMUM, Status.MINIMUM)
    assert to_frame.cost < to_joints.cost
    assert to_frame.nit <= to_joints.nit + 25
    robot, goal = frame.scene.robot, frame.goal
    assert isinstance(goal, FrameGoal)
    reached = robot.frame_pose("tool0", to_frame.trajectory.q[-1])[:3, 3]
    assert goal.position is not None
    assert abs(reached - goal.position).max() < 1e-10


def test_a_saddle_under_conditions_has_its_index() -> None:
    """Of a solution whose Hessian is turned upside down, every direction is one downwards."""
    _, problem = reaches()
    assert problem.limits is not None
    path = guess_path(problem, "cubic")
    search = BoundedSearch(problem, problem.limits, Criteria(max_iterations=200), None, path)
    outcome = search.solve(path)
    assert outcome.why is Reason.STATIONARY
    assert search.negative_eigenvalues(outcome) == 0
    model = outcome.model
    assert isinstance(model, EquationModel)
    np.negative(model.intervals.hessian, out=model.intervals.hessian)
    inner = BandModel(model.intervals, problem.structure.layout, problem.structure.metric_band)
    outcome.model = EquationModel(inner, model.rows, model.residual, model.penalty)
    assert search.negative_eigenvalues(outcome) > 0.9 * inner.gradient.size
