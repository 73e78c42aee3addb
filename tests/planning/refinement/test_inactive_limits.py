"""Limits far from a motion cost nothing and change nothing; those that it touches do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi
from samples.paper_arm import HANG, REACH_Q

TOLERANCE = 1e-6
FAR_AWAY = hovi.Sphere([0.0, 2.8, 0.0], 0.1)


def reached(scene: hovi.Scene, limits: Any, **more: Any) -> hovi.Solution:
    """The reach of the arm within limits, to a tolerance that refines the grid."""
    bounds = "none" if limits is None else {"base": "none", **limits}
    found = hovi.plan(scene, HANG, REACH_Q, 1.0, limits=bounds, tolerance=TOLERANCE, **more)
    assert found.success, found.message
    return found


@pytest.fixture(scope="module")
def free(arm_scene: hovi.Scene) -> hovi.Solution:
    return reached(arm_scene, None)


@pytest.fixture(scope="module")
def peak(free: hovi.Solution) -> float:
    """The largest speed of a joint without limits, in [rad/s]."""
    return float(np.abs(free.trajectory.sample(np.linspace(0.0, 1.0, 2001)).v).max())


@pytest.mark.parametrize("share", [1.1, 1.5, 5.0])
def test_limits_that_are_far_away_change_nothing(
    arm_scene: hovi.Scene, free: hovi.Solution, peak: float, share: float
) -> None:
    """Nor do they keep a tolerance from being reached that limits would not allow."""
    far = reached(arm_scene, {"v": share * peak})
    assert far.accuracy is not None
    assert far.accuracy.reached
    assert far.cost == pytest.approx(free.cost, rel=2 * TOLERANCE)
    assert far.problem is not None
    assert far.problem.limited


def test_a_limit_that_the_motion_touches_is_kept(
    arm_scene: hovi.Scene, free: hovi.Solution, peak: float
) -> None:
    near = reached(arm_scene, {"v": 0.9 * peak})
    assert near.cost > free.cost * (1 + 1e-4)
    v = near.trajectory.sample(np.linspace(0.0, 1.0, 5_001)).v
    assert np.abs(v).max() <= 0.9 * peak * (1 + 2e-6)
    assert near.accuracy is not None
    assert not near.accuracy.reached
    assert "the tolerance of limits allows no smaller error" in near.message


def test_a_motion_among_obstacles_keeps_its_limits(
    arm_scene: hovi.Scene, free: hovi.Solution, peak: float
) -> None:
    """However far away the obstacles are."""
    found = reached(arm_scene, {"v": 0.9 * peak}, obstacles=[FAR_AWAY], margin=0.05)
    v = found.trajectory.sample(np.linspace(0.0, 1.0, 5_001)).v
    assert np.abs(v).max() <= 0.9 * peak * (1 + 2e-6)
    alone = reached(arm_scene, {"v": 1.5 * peak}, obstacles=[FAR_AWAY], margin=0.05)
    assert alone.cost == pytest.approx(free.cost, rel=1e-6)


@pytest.mark.parametrize("most", [1, 3, 6])
def test_a_motion_that_is_no_minimum_keeps_its_limits(
    arm_scene: hovi.Scene, peak: float, most: int
) -> None:
    found = hovi.plan(
        *(arm_scene, HANG, REACH_Q, 1.0),
        **{"limits": {"base": "none", "v": 1.05 * peak}, "tolerance": TOLERANCE},
        **{"max_iterations": most, "continuation": False},
    )
    if found.usable:
        v = found.trajectory.sample(np.linspace(0.0, 1.0, 5_001)).v
        assert np.abs(v).max() <= 1.05 * peak * (1 + 2e-6)
    else:
        assert not found.success
    assert found.problem is not None
    assert found.problem.limited
