"""The limits and distances of a report are those of the problem."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi import Solution
from hovi.cli.reports.limit_margins import KnownMargins, limit_margins, nearest_pair
from hovi.planning.clearance.obstacles import Sphere
from hovi.system.deadline import Deadline
from hovi.viewing.recorded_limits import imposed_limits

ENDS = ([-np.pi / 2, 0.0], [0.3, 0.7], 1.5)
SPEED_LIMIT = {"base": "none", "v": 50.0}
BALL = Sphere([3.0, 0.0, 0.0], 0.1, name="ball")


def planned(scene: hovi.Scene, **options: object) -> Solution:
    return hovi.plan(scene, *ENDS, processes=1, **{"limits": SPEED_LIMIT, **options})


@pytest.fixture(scope="module")
def limited(arm_scene: hovi.Scene) -> Solution:
    return planned(arm_scene, obstacles=[BALL])


def without_metadata(solution: Solution) -> Solution:
    """The solution with the metadata of its motion removed."""
    return dataclasses.replace(
        solution, trajectory=dataclasses.replace(solution.trajectory, metadata={})
    )


def test_the_margins_of_a_solution_come_from_its_problem(limited: Solution) -> None:
    recorded, from_problem = (
        limit_margins(limited.trajectory),
        limit_margins(without_metadata(limited)),
    )
    assert recorded is not None
    assert from_problem is not None
    np.testing.assert_array_equal(from_problem.margin, recorded.margin)
    assert limit_margins(without_metadata(limited).trajectory) is None


def test_the_distance_of_a_solution_comes_from_its_problem(limited: Solution) -> None:
    distance = nearest_pair(limited.trajectory)[0]
    assert distance is not None
    assert nearest_pair(without_metadata(limited))[0] == distance
    assert nearest_pair(without_metadata(limited).trajectory)[0] is None


def test_the_pair_that_comes_nearest_is_named(arm_scene: hovi.Scene) -> None:
    """Of two balls the nearer one, whichever is given first."""
    far = Sphere([-5.0, 0.0, 0.0], 0.1, name="far ball")
    for balls in ([BALL, far], [far, BALL]):
        known = KnownMargins.of(planned(arm_scene, obstacles=balls), Deadline(None))
        assert known.nearest_pair is not None
        assert known.nearest_pair.endswith("and obstacle 'ball'")


def test_the_margins_of_a_solution_without_a_problem_come_from_its_metadata(
    limited: Solution,
) -> None:
    alone = dataclasses.replace(limited, problem=None)
    recorded, from_problem = limit_margins(limited), limit_margins(alone)
    assert recorded is not None
    assert from_problem is not None
    np.testing.assert_array_equal(from_problem.margin, recorded.margin)
    assert nearest_pair(alone)[0] == nearest_pair(limited)[0]


def test_the_margins_of_a_file_come_from_its_metadata(limited: Solution, tmp_path: Path) -> None:
    limited.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    recorded, from_problem = limit_margins(limited), limit_margins(again)
    assert recorded is not None
    assert from_problem is not None
    np.testing.assert_allclose(from_problem.margin, recorded.margin, rtol=1e-12)


def test_inactive_limits_of_a_plan_to_a_tolerance_are_reported(arm_scene: hovi.Scene) -> None:
    """A motion far from its limits is refined without them, and does not record them."""
    solution = planned(arm_scene, tolerance=1e-9, intervals=4)
    assert solution.success
    assert imposed_limits(solution.trajectory) is None
    margins = limit_margins(solution)
    assert margins is not None
    assert margins.limits.upper[1, 0] == 50.0
    assert not margins.exceeded


def test_a_motion_without_limits_and_obstacles_has_no_margins(arm_scene: hovi.Scene) -> None:
    solution = planned(arm_scene, limits="none")
    assert limit_margins(solution) is None
    assert nearest_pair(solution)[0] is None


def test_margins_that_no_time_is_left_for_are_missing(limited: Solution) -> None:
    known = KnownMargins.of(limited, Deadline())
    assert known.missing == ""
    assert known.limits is not None
    assert known.distance == nearest_pair(limited)[0]
    late = KnownMargins.of(limited, Deadline(-1.0))
    assert late == KnownMargins(missing="the time limit was reached")
