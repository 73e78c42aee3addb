"""What a report says of limits and distances is what the problem asked for."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.cli.reports.limit_margins import closeness, least_distance
from hovi.planning.clearance.obstacles import Sphere
from hovi.planning.solver.solver import Solution
from hovi.viewing.recorded_limits import imposed_limits

ENDS = ([-np.pi / 2, 0.0], [0.3, 0.7], 1.5)
FAST = {"base": "none", "v": 50.0}
BALL = Sphere([3.0, 0.0, 0.0], 0.1, name="ball")


def planned(scene: hovi.Scene, **options: object) -> Solution:
    return hovi.plan(scene, *ENDS, processes=1, **{"limits": FAST, **options})


@pytest.fixture(scope="module")
def limited(arm_scene: hovi.Scene) -> Solution:
    return planned(arm_scene, obstacles=[BALL])


def forgetful(solution: Solution) -> Solution:
    """A solution whose motion records nothing."""
    return dataclasses.replace(
        solution, trajectory=dataclasses.replace(solution.trajectory, metadata={})
    )


def test_the_margins_of_a_solution_come_from_its_problem(limited: Solution) -> None:
    recorded, told = closeness(limited.trajectory), closeness(forgetful(limited))
    assert recorded is not None
    assert told is not None
    np.testing.assert_array_equal(told.room, recorded.room)
    assert closeness(forgetful(limited).trajectory) is None


def test_the_distance_of_a_solution_comes_from_its_problem(limited: Solution) -> None:
    distance = least_distance(limited.trajectory)
    assert distance is not None
    assert least_distance(forgetful(limited)) == distance
    assert least_distance(forgetful(limited).trajectory) is None


def test_a_solution_without_a_problem_has_what_its_motion_records(limited: Solution) -> None:
    alone = dataclasses.replace(limited, problem=None)
    recorded, told = closeness(limited), closeness(alone)
    assert recorded is not None
    assert told is not None
    np.testing.assert_array_equal(told.room, recorded.room)
    assert least_distance(alone) == least_distance(limited)


def test_a_motion_from_a_file_has_what_it_records(limited: Solution, tmp_path: Path) -> None:
    limited.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    recorded, told = closeness(limited), closeness(again)
    assert recorded is not None
    assert told is not None
    np.testing.assert_allclose(told.room, recorded.room, rtol=1e-12)


def test_limits_that_a_tolerance_need_not_mind_are_reported(arm_scene: hovi.Scene) -> None:
    """A motion far from its limits is refined without them, and records none."""
    solution = planned(arm_scene, tolerance=1e-9, intervals=4)
    assert solution.success
    assert imposed_limits(solution.trajectory) is None
    margins = closeness(solution)
    assert margins is not None
    assert margins.limits.upper[1, 0] == 50.0
    assert not margins.exceeded


def test_a_motion_without_limits_and_obstacles_has_no_margins(arm_scene: hovi.Scene) -> None:
    solution = planned(arm_scene, limits="none")
    assert closeness(solution) is None
    assert least_distance(solution) is None
