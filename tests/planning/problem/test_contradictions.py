"""Infeasible limits are reported before any solve."""

from __future__ import annotations

from typing import Any

import hovi
from hovi.scene.scene import Scene


def planned(scene: Scene, start: list[float], goal: list[float], T: float, **limits: Any) -> Any:
    return hovi.plan(scene, start, goal, T, limits={"base": "none", **limits})


def test_a_start_outside_names_end_joint_and_limits(arm_scene: Scene) -> None:
    solution = planned(arm_scene, [0, 2], [0, 0], 5.0, q={"elbow": [-1, 1]})
    assert solution.status == "infeasible"
    assert not solution.success
    assert "position of joint 'elbow' at the start is 2 rad" in solution.message


def test_a_goal_outside_is_named(arm_scene: Scene) -> None:
    solution = planned(arm_scene, [0, 0], [0, 2], 5.0, q={"elbow": [-1, 1]})
    assert solution.status == "infeasible"
    assert "position of joint 'elbow' at the goal is 2 rad" in solution.message


def test_a_via_point_outside_is_named_with_its_time(arm_scene: Scene) -> None:
    for state in (hovi.State([0, 2]), hovi.State([0, 0.5], [0, 3])):
        via = [hovi.Via(2.5, hovi.State([0, 0])), hovi.Via(2.0, state)]
        bounds = {"base": "none", "q": {"elbow": [-1, 1]}, "v": 2.0}
        solution = hovi.plan(arm_scene, [0, 0], [0, 0], 5.0, via=via, limits=bounds)
        assert solution.status == "infeasible"
        assert solution.nit == 0
        assert "of joint 'elbow' at the via point at 2 s is" in solution.message


def test_a_duration_too_short_for_the_velocity_says_how_long_it_takes(arm_scene: Scene) -> None:
    solution = planned(arm_scene, [0, 0], [1, 0], 0.5, v=1.0)
    assert solution.status == "infeasible"
    assert solution.nit == 0
    assert "'shoulder'" in solution.message
    assert "takes 1 s" in solution.message
