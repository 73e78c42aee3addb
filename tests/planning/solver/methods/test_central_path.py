"""Central paths of motions among obstacles, followed on another grid."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.optimize.criteria import Criteria
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.methods.feasibility import _adopt
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.scene.scene import Scene

LEVEL, BARRIER = 1e-3, 1e-6


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
    problem = Job(Scene(robot, []), grid, hovi.State(start), end).problem()
    clearance = Clearance((hovi.Sphere(middle, 0.06, name="ball"),))
    limits = as_limits(robot, {"base": "none", "v": 3.0, "tau": 300.0})
    return dataclasses.replace(problem, limits=limits, clearance=clearance)


@pytest.fixture(scope="module")
def known(reach: TrajectoryProblem) -> Solution:
    found = solve_on_grid(reach, barrier=BARRIER)
    assert found.success
    assert found.central is not None
    return found


def central_of(known: Solution) -> CentralPath:
    assert known.central is not None
    return known.central


def test_points_keep_their_curves_on_another_grid(known: Solution) -> None:
    assert known.problem is not None
    own, central = known.problem, central_of(known)
    other = own.on(own.grid.halved())
    resampled = central.resampled(own, other)
    t = np.linspace(0.0, own.grid.duration, 101)
    assert len(resampled.points) == len(central.points) > 2
    for (level, path), (before, curve) in zip(resampled.points, central.points, strict=True):
        assert level == before
        q = own.trajectory(curve).configurations(t)
        np.testing.assert_allclose(other.trajectory(path).configurations(t), q, atol=1e-9)


def test_a_search_takes_over_the_multipliers_of_conditions(known: Solution) -> None:
    assert known.problem is not None
    own, central = known.problem, central_of(known)
    assert central.conditions is not None
    assert max(np.abs(each).max() for each in central.conditions) > 1.0
    fine = own.on(own.grid.halved())
    along = central.resampled(own, fine)
    assert fine.limits is not None
    options = Criteria()
    guess = along.last
    search = BoundedSearch(fine, fine.limits, options, None, guess, along=along, lazy=True)
    _adopt(search, along)
    assert search.multipliers is not None
    for mine, theirs in zip(search.multipliers.nodes, central.conditions, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_on_another_grid_few_steps_lead_to_the_same_minimum(known: Solution) -> None:
    assert known.problem is not None
    own, fine = known.problem, known.problem.on(known.problem.grid.halved())
    along = central_of(known).resampled(own, fine)
    guess, method = along.last, InteriorPoint(along, LEVEL)
    followed = solve_on_grid(fine, guess, near=True, method=method, barrier=BARRIER)
    beside = solve_on_grid(fine, guess, near=True, barrier=BARRIER)
    assert followed.success
    assert followed.cost == pytest.approx(known.cost, rel=0.05)
    assert followed.cost == pytest.approx(beside.cost, rel=1e-4)
    assert followed.nit < 0.7 * beside.nit
