"""Motions with obstacles: their distances by Coal at many instants, and what far ones change."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import solve
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances

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


def test_too_few_steps_are_no_proof_that_there_is_no_motion(around: hovi.Task) -> None:
    """A motion that lacks rows still, and so comes too close, is at its iteration limit."""
    problem = hovi.plan_task(around, intervals=16).problem
    assert problem is not None
    least = []
    for most in (4, 6, 8):
        found = solve(problem, "cubic", max_iterations=most)
        assert found.status is hovi.Status.ITERATION_LIMIT, found.message
        robot, clearance = around.scene.robot, around.options.clearance
        least.append(least_by_coal(found.trajectory, robot, clearance))
    assert min(least) < 0.0


def test_an_obstacle_far_away_changes_nothing(around: hovi.Task) -> None:
    free = hovi.plan_task(around, obstacles=[])
    far = hovi.plan_task(around, obstacles=[hovi.Sphere([9.0, 0.0, 0.0], 0.1)])
    assert far.cost == free.cost
    assert far.nit == free.nit
