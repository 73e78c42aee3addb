"""What the tolerance of limits adds to the cost's error, against solves with shifted limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

HANG, GOAL = [-np.pi / 2, 0.0], [0.3, 0.7]


@pytest.mark.parametrize(
    "bounds", [{"v": 3.0}, {"tau": 8.0}, {"q": [[-1.6, 0.31], [-0.4, 0.71]]}, {"a": 20.0}]
)
def test_the_cost_of_the_tolerance_is_the_change_with_a_shift_of_all_limits(
    arm_scene: Scene, bounds: dict[str, object]
) -> None:
    """Of six tolerances, as far as bounds are tightened and may be exceeded."""
    size = 1e-4
    limits = {"base": "none", "tolerance": size, **bounds}
    found = hovi.plan(arm_scene, HANG, GOAL, 1.0, limits=limits, tolerance=1e-6)
    assert found.success, found.message
    assert found.problem is not None
    assert found.problem.limits is not None
    assert found.accuracy is not None
    costs = []
    for margin in (20 * size, 40 * size):
        tighter = dataclasses.replace(
            found.problem, limits=found.problem.limits.with_margin(margin)
        )
        costs.append(hovi.solve(tighter, found.trajectory).cost)
    change = (costs[1] - costs[0]) / found.cost * 6 / 20
    assert change > 1e-6
    assert 0.8 * change <= found.accuracy.error <= 1.6 * change


def test_limits_that_are_not_reached_add_nothing(arm_scene: Scene) -> None:
    """Not even with a coarse tolerance of their own."""
    limits = {"base": "none", "v": 50.0, "tolerance": 1e-3}
    found = hovi.plan(arm_scene, HANG, GOAL, 1.0, limits=limits, tolerance=1e-6)
    assert found.accuracy is not None
    assert found.accuracy.reached
    assert found.accuracy.error < 1e-6


def test_a_tolerance_below_the_cost_of_that_of_limits_is_not_reached(arm_scene: Scene) -> None:
    limits = {"base": "none", "v": 3.0}
    found = hovi.plan(arm_scene, HANG, GOAL, 1.0, limits=limits, tolerance=1e-6)
    assert found.accuracy is not None
    assert not found.accuracy.reached
    assert found.accuracy.error > 1e-6
    assert "the tolerance of limits allows no smaller error" in found.message


def test_a_motion_that_costs_nothing_has_no_error_under_limits(two_link: Robot) -> None:
    """At rest without gravity."""
    limits, q = {"base": "none", "v": 1.0, "tau": 1.0}, [0.3, 0.1]
    still = hovi.plan(Scene(two_link), q, q, 1.0, limits=limits, intervals=4)
    assert still.success, still.message
    assert still.cost < 1e-12
    assert still.error_estimate == 0.0
