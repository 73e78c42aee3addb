"""A motion that exceeds a limit between its points is no minimum within the limits."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi import solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q, REACH_V


def problem_of(scene: Scene, tau: float | None, intervals: int) -> TrajectoryProblem:
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, intervals, galerkin(1)))
    limits = None if tau is None else as_limits(scene.robot, {"base": "none", "tau": tau})
    return TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V), limits)


@pytest.mark.parametrize(("intervals", "tau"), [(6, 9.0), (8, 8.5)])
def test_limits_hold_between_the_points_of_a_coarse_grid(
    arm_scene: Scene, intervals: int, tau: float
) -> None:
    """Those of a replanned motion as well, whose intervals may have to be halved."""
    limits = as_limits(arm_scene.robot, {"base": "none", "tau": tau})
    free = solve(problem_of(arm_scene, None, intervals))
    assert closeness(free.trajectory, limits).min() < -1e-3
    found = solve(problem_of(arm_scene, tau, intervals))
    moved = found.replan(goal=State(np.add(REACH_Q, 0.05), REACH_V))
    for motion in (found, moved):
        assert motion.success, motion.message
        assert closeness(motion.trajectory, limits).min() >= -limits.tolerance


def test_a_solve_from_a_motion_on_a_finer_grid_stays_near_it() -> None:
    """With the barrier of other solves it ends 3 rad away, in a minimum that costs 1.4 % more."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start = [-2.017, 0.879, -0.206, -0.814, -0.912, 1.825]
    goal = [2.546, -2.027, 0.96, -1.267, 2.934, 2.638]
    found = hovi.plan(scene, start, goal, 3.554, processes=1, self_collision=False)
    assert found.problem is not None
    quarters = found.problem.on(found.problem.grid.halved().halved())
    finer = solve(quarters, found.trajectory)
    assert finer.success
    assert finer.cost == pytest.approx(found.cost, rel=1e-3)
    t = found.trajectory.t
    assert np.abs(finer.trajectory.sample(t).q - found.trajectory.q).max() < 0.1
