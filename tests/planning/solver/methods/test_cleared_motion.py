"""Motions with obstacles: their distances by Coal at many instants, and what far ones change."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.optimize.ended import Reason
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.methods import cleared_motion
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.solver import solve_on_grid

INSTANTS = 2_000


def least_by_coal(motion: Trajectory, robot: hovi.Robot, clearance: Clearance) -> float:
    """The least distance of any pair, one configuration and one pair at a time, in [m]."""
    geometry = Distances(robot, clearance).geometry
    data, placed = robot.model.createData(), geometry.createData()
    least = np.inf
    for q in motion.configurations(np.linspace(0.0, motion.duration, INSTANTS)):
        pin.updateGeometryPlacements(robot.model, data, geometry, placed, q)
        pin.computeDistances(geometry, placed)
        least = min(least, *(each.min_distance for each in placed.distanceResults))
    return float(least)


@pytest.fixture(scope="module")
def around() -> hovi.Task:
    return hovi.load_task(hovi.example("ur5_around_sphere"))


def test_distances_hold_at_all_times(around: hovi.Task) -> None:
    clearance, robot = around.options.clearance, around.scene.robot
    margin = float(clearance.margin)
    free = hovi.plan_task(around, obstacles=[]).trajectory
    assert least_by_coal(free, robot, clearance) < margin - 0.02
    found = hovi.plan_task(around)
    assert found.success
    least = least_by_coal(found.trajectory, robot, clearance)
    assert margin <= least + 1e-7
    assert least < margin + 1e-3  # it is worth passing closely


def test_where_no_rough_motion_is_found_the_rounds_find_one(
    around: hovi.Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rows of what was tried are no longer those of the motion that is given up."""
    rough = cleared_motion._rough

    def failing(*given: Any) -> Any:
        outcome, known = rough(*given)
        return dataclasses.replace(outcome, why=Reason.DIVERGED), known

    monkeypatch.setattr(cleared_motion, "_rough", failing)
    found = hovi.plan_task(around, intervals=16)
    assert found.status in (hovi.Status.MINIMUM, hovi.Status.UNRESOLVED)
    least = least_by_coal(found.trajectory, around.scene.robot, around.options.clearance)
    assert float(around.options.clearance.margin) <= least + 1e-7


def test_too_few_steps_are_no_proof_that_there_is_no_motion(around: hovi.Task) -> None:
    """A motion that lacks rows still, and so comes too close, is at its iteration limit."""
    problem = hovi.plan_task(around, intervals=16).problem
    assert problem is not None
    rows, least = InteriorPoint(distances="rows"), []
    for most in (4, 6, 8):
        found = solve_on_grid(problem, "cubic", max_iterations=most, method=rows)
        assert found.status is hovi.Status.ITERATION_LIMIT, found.message
        robot, clearance = around.scene.robot, around.options.clearance
        least.append(least_by_coal(found.trajectory, robot, clearance))
    assert min(least) < 0.0


def test_an_obstacle_far_away_changes_nothing(around: hovi.Task) -> None:
    free = hovi.plan_task(around, obstacles=[])
    far = hovi.plan_task(around, obstacles=[hovi.Sphere([9.0, 0.0, 0.0], 0.1)])
    assert far.cost == free.cost
    assert far.nit == free.nit


def test_a_fixed_set_of_rows_is_that_of_the_coarser_motion(around: hovi.Task) -> None:
    """The comparison with a finer grid bounds the same pairs at the same instants."""
    found = hovi.plan_task(around)
    assert found.central is not None
    near = found.central.near
    assert near is not None
    fixed = near.copied(fixed=True)
    assert near.size > 0
    assert found.problem is not None
    assert fixed.extend(found.problem, found.trajectory.path, 1.0) == 0


def test_a_finer_grid_is_begun_from_the_known_motion(
    around: hovi.Task, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not moved out of its obstacles once more."""
    moved, push = [], cleared_motion.pushed_out

    def watched(problem: TrajectoryProblem, *given: Any) -> Any:
        moved.append(problem.grid.intervals)
        return push(problem, *given)

    monkeypatch.setattr(cleared_motion, "pushed_out", watched)
    found = hovi.plan_task(around, tolerance=1e-4)
    assert found.success
    assert len(found.trajectory.grid.steps) > max(moved)
    assert len(set(moved)) == 1
