"""Solves within limits: the scale of a barrier, and conditions at nodes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from hovi import Status, solve, symbolic
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q


@pytest.mark.parametrize("T", [0.5, 2.0])
@pytest.mark.parametrize("constant", [-1e4, 1e3])
def test_a_constant_in_the_cost_changes_no_motion_within_limits(
    arm_scene: Scene, T: float, constant: float
) -> None:
    """Costs with a potential may be negative."""
    limits = as_limits(arm_scene.robot, {"base": "none", "v": 2.5 / T})
    q, v, a = (ca.SX.sym(name, 2) for name in "qva")
    effort = symbolic.lagrangian(arm_scene)(q, v, a, 0.0)
    found = []
    for more in (0.0, constant):
        L = CasadiLagrangian([q, v, a], effort + more, scene=arm_scene)
        ld = DiscreteLagrangian(L, Grid.uniform(T, 8, galerkin(2)))
        found.append(solve(TrajectoryProblem(ld, State(HANG), State(REACH_Q), limits)))
    plain, shifted = found
    assert plain.success
    assert shifted.n_neg == 0
    assert shifted.cost - constant * T == pytest.approx(plain.cost, rel=1e-3)
    np.testing.assert_allclose(shifted.trajectory.q, plain.trajectory.q, rtol=0, atol=0.02)


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
    to_joints, to_frame = solve(joints, "cubic"), solve(frame, "cubic")
    assert (to_joints.status, to_frame.status) == (Status.MINIMUM, Status.MINIMUM)
    assert to_frame.cost < to_joints.cost
    assert to_frame.nit <= to_joints.nit + 25
    robot, goal = frame.scene.robot, frame.goal
    assert isinstance(goal, FrameGoal)
    reached = robot.frame_pose("tool0", to_frame.trajectory.q[-1])[:3, 3]
    assert goal.position is not None
    assert abs(reached - goal.position).max() < 1e-10
