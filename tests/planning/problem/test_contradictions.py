"""Infeasible limits are reported before any solve."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.planning.problem.contradictions import contradiction
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene
from hovi.schemes import galerkin


def planned(scene: Scene, start: list[float], goal: list[float], T: float, **limits: Any) -> Any:
    return hovi.plan(scene, start, goal, T, limits={"base": "none", **limits}, self_collision=False)


def test_a_start_outside_names_end_joint_and_limits(arm_scene: Scene) -> None:
    solution = planned(arm_scene, [0, 2], [0, 0], 5.0, q={"elbow": [-1, 1]})
    assert solution.status == "infeasible"
    assert not solution.success
    assert "position of joint 'elbow' at the start is 2 rad" in solution.message


def test_a_goal_outside_is_named(arm_scene: Scene) -> None:
    solution = planned(arm_scene, [0, 0], [0, 2], 5.0, q={"elbow": [-1, 1]})
    assert solution.status == "infeasible"
    assert "position of joint 'elbow' at the goal is 2 rad" in solution.message


@pytest.mark.parametrize("joint", ["shoulder", "elbow"])
@pytest.mark.parametrize("end", ["start", "goal"])
@pytest.mark.parametrize("kind", ["q", "v"])
@pytest.mark.parametrize("value", [-2.5, 2.5, -0.8, 0.8])
def test_an_end_outside_on_either_side_is_infeasible_and_one_inside_is_not(
    arm_scene: Scene, joint: str, end: str, kind: str, value: float
) -> None:
    """The range is not symmetric: from -1 to 2."""
    i = ["shoulder", "elbow"].index(joint)
    states = {"start": np.zeros((2, 2)), "goal": np.zeros((2, 2))}
    states[end][int(kind == "v"), i] = value
    limits = as_limits(arm_scene.robot, {"base": "none", kind: {joint: [-1.0, 2.0]}})
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(9.0, 2, galerkin(1)))
    ends = (hovi.State(*states[each]) for each in ("start", "goal"))
    sentence = contradiction(TrajectoryProblem(ld, *ends, limits), limits)
    assert bool(sentence) == (abs(value) > 1)
    if sentence:
        unit = "rad" if kind == "q" else "rad/s"
        assert f"of joint {joint!r} at the {end} is {value} {unit}, outside its" in sentence
        assert "[-1, 2]" in sentence


@pytest.mark.parametrize(("goal", "joint", "takes"), [
    ([1.0, 0.3], "shoulder", 2.0), ([0.3, 1.0], "elbow", 2.0), ([-1.0, 0.3], "shoulder", 1.0),
])  # fmt: skip
def test_the_slowest_joint_decides_in_the_direction_of_its_motion(
    arm_scene: Scene, goal: list[float], joint: str, takes: float
) -> None:
    limits = {"shoulder": [-1.0, 0.5], "elbow": [-1.0, 0.5]}
    short = planned(arm_scene, [0, 0], goal, 0.9 * takes, v=limits)
    assert short.nit == 0
    assert f"joint {joint!r} has to move by 1 rad, which takes {takes:g} s" in short.message


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


@pytest.mark.parametrize("end", ["start", "goal"])
def test_links_that_overlap_each_other_leave_no_obstacle_to_move(ur5: hovi.Robot, end: str) -> None:
    states = {"start": np.zeros(6), "goal": np.zeros(6)}
    states[end] = np.array([0.0, 0.0, 3.1, 0.0, 0.0, 0.0])
    solution = hovi.plan(hovi.Scene(ur5), *states.values(), 3.0, self_collision=True)
    assert f"at the {end} link 'upper_arm_link' and link 'wrist_1_link'" in solution.message
    assert f"; change the {end}. " in solution.message


@pytest.mark.parametrize("end", ["start", "goal"])
def test_a_link_in_an_obstacle_leaves_the_obstacle_to_move(ur5: hovi.Robot, end: str) -> None:
    states = {"start": np.full(6, 0.5), "goal": np.full(6, 0.5)}
    states[end] = np.zeros(6)
    ball = hovi.Sphere([0.8, 0.19, 0.0], 0.1, name="ball")
    solution = hovi.plan(
        hovi.Scene(ur5), *states.values(), 3.0, obstacles=[ball], self_collision=False
    )
    assert f"; change the {end} or move the obstacle. " in solution.message
