"""Ends that are partly free: what they leave free is within the limits, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi

HOME = np.array([0.0, -1.2, 1.8, -0.6, 0.3, 0.2])
GOAL = np.array([1.0, -1.0, 1.2, -0.2, 0.9, 0.3])
GIVEN: dict[str, Any] = {"limits": "urdf", "intervals": 12}
FREE = (
    {"free_velocity": ["wrist_3_joint"]},
    {"free_velocity": ["elbow_joint", "wrist_1_joint"]},
    {"free_velocity": ["all"]},
    {"free": ["elbow_joint"]},
)


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def assert_within_limits(found: hovi.Solution) -> None:
    """q and v at 50,000 times, and torques by the inverse dynamics of the scene."""
    assert found.success, found.message
    assert found.problem is not None
    limits = found.problem.limits
    assert limits is not None
    x = found.trajectory.sample(np.linspace(0.0, found.trajectory.duration, 50_000))
    for row, values in ((0, x.q), (1, x.v), (3, x.tau)):
        excess = np.maximum(limits.lower[row] - values, values - limits.upper[row])
        assert (excess / limits.ranges[row]).max() <= 1e-6
    assert found.usable, found.violation


@pytest.mark.parametrize("free", FREE, ids=str)
@pytest.mark.parametrize("at_goal", [True, False])
def test_what_an_end_leaves_free_is_within_the_limits(
    scene: hovi.Scene, free: dict[str, list[str]], at_goal: bool
) -> None:
    ends = (HOME, hovi.State(GOAL, **free)) if at_goal else (hovi.State(HOME, **free), GOAL)
    assert_within_limits(hovi.plan(scene, *ends, 1.5, **GIVEN, self_collision=False))


@pytest.mark.parametrize("free", FREE, ids=str)
def test_ends_become_free_and_are_given_again_in_a_replan(
    scene: hovi.Scene, free: dict[str, list[str]]
) -> None:
    """With other control points than the motion from which it starts."""
    solution = hovi.plan(scene, HOME, GOAL, 1.5, **GIVEN, self_collision=False)
    freed = solution.replan(goal=hovi.State(GOAL, **free))
    assert_within_limits(freed)
    assert freed.cost < solution.cost
    assert_within_limits(freed.replan(goal=hovi.State(GOAL + 0.01, **free)))
    again = freed.replan(goal=GOAL)
    assert_within_limits(again)
    assert again.cost == pytest.approx(solution.cost, rel=2e-5)
