"""Central paths of motions among obstacles, followed on another grid."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene


@pytest.fixture(scope="module")
def reach() -> TrajectoryProblem:
    """To a point, with a ball in the way."""
    robot = hovi.load_robot("ur5")
    start = np.array([0.0, -1.2, 1.4, -1.0, -1.5, 0.0])
    goal = start + np.array([1.4, 0.2, -0.3, 0.2, 0.3, 0.2])
    tip = robot.tip_frames[0]
    end = hovi.FrameGoal(tip, position=robot.frame_position(tip, goal[None])[0])
    middle = robot.frame_position(tip, 0.5 * (start + goal)[None])[0]
    grid = hovi.Grid.uniform(1.0, 8, hovi.schemes.by_name("galerkin-2x8"))
    ld = hovi.DiscreteLagrangian(Scene(robot, []).effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, hovi.State(start), end)
    clearance = Clearance((hovi.Sphere(middle, 0.06, name="ball"),))
    limits = as_limits(robot, {"base": "none", "v": 3.0, "tau": 300.0})
    return dataclasses.replace(problem, limits=limits, clearance=clearance)


def test_on_another_grid_few_steps_lead_to_the_same_minimum(reach: TrajectoryProblem) -> None:
    known = hovi.solve(reach)
    assert known.usable, known.message
    assert known.problem is not None
    fine = known.problem.on(known.problem.grid.halved())
    followed, cold = hovi.solve(fine, known.trajectory), hovi.solve(fine)
    assert followed.success, followed.message
    assert followed.cost == pytest.approx(known.cost, rel=0.05)
    assert followed.cost == pytest.approx(cold.cost, rel=1e-4)
    assert followed.nit < 0.7 * cold.nit
