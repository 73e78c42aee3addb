"""Durations that are too short for a frame: refused where that is certain, else a warning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hovi
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.presolve.least_time import Pace
from hovi.planning.problem.presolve.moves import (
    Finding,
    Waypoint,
    frame_too_far,
    states_too_far_apart,
)

ARMS = {"ur5": "tool0", "panda": "panda_hand_tcp", "xarm7": "link_eef"}


def found(robot: hovi.Robot, start: Any, goal: Any, time: float, limits: Limits) -> Finding | None:
    return frame_too_far(
        robot, [Waypoint("start", 0.0, start), Waypoint("goal", time, goal)], limits
    )


@pytest.mark.parametrize("name", ["ur5", "panda"])
@pytest.mark.parametrize("acceleration", [np.inf, 6.0])
def test_a_duration_in_which_a_configuration_is_reached_is_never_refused(
    name: str, acceleration: float
) -> None:
    """At the limits on v, and from rest to rest at those on a: such a motion exists."""
    robot, random = hovi.load_robot(name), np.random.default_rng(0)
    base: dict[str, Any] = {"base": "urdf"}
    limits = as_limits(robot, base if np.isinf(acceleration) else base | {"a": acceleration})
    low, high = np.maximum(limits.lower[0], -2.5), np.minimum(limits.upper[0], 2.5)
    for _ in range(6):
        q0, q1 = random.uniform(low, high), random.uniform(low, high)
        rests = np.full(robot.nv, 2)
        moved = np.where(np.isfinite(q1 - q0), q1 - q0, 0.0)
        time = 1.001 * float(Pace.of(limits).least_time(moved, rests).max())
        frame = ARMS[name]
        at_start, at_goal = (hovi.FrameGoal(frame, robot.frame_pose(frame, q)) for q in (q0, q1))
        for ends in ((hovi.State(q0), at_goal), (at_start, hovi.State(q1))):
            finding = found(robot, *ends, time, limits)
            assert finding is None or not finding.certain


def test_a_much_shorter_duration_is_refused_from_both_ends(ur5: hovi.Robot) -> None:
    limits = as_limits(ur5, "urdf")
    q0, q1 = np.array([0.0, -1.2, 1.2, -0.5, 0.3, 0.1]), np.array([1.8, -1.0, 0.3, 0.5, 0.3, 0.1])
    frames = [hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q)) for q in (q0, q1)]
    for start, goal in ((hovi.State(q0), frames[1]), (frames[0], hovi.State(q1))):
        finding = found(ur5, start, goal, 0.15, limits)
        assert finding is not None
        assert finding.certain
        assert (
            "frame 'tool0' cannot move from the start to the goal within 0.15 s" in finding.clause
        )
        assert finding.clause.endswith("; increase the duration or the limits")


def test_a_leg_to_or_from_a_via_point_is_named_once_by_its_two_ends(ur5: hovi.Robot) -> None:
    limits = as_limits(ur5, "urdf")
    q0, q1 = np.array([0.0, -1.2, 1.2, -0.5, 0.3, 0.1]), np.array([1.8, -1.0, 0.3, 0.5, 0.3, 0.1])
    frame, via = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q0)), "via point at 0.1 s"
    far = hovi.State(q1)
    for first, last in (
        (Waypoint("start", 0.0, far), Waypoint(via, 0.1, frame)),
        (Waypoint("start", 0.0, frame), Waypoint(via, 0.1, far)),
        (Waypoint(via, 0.1, far), Waypoint("goal", 0.2, frame)),
        (Waypoint(via, 0.1, frame), Waypoint("goal", 0.2, far)),
    ):
        finding = frame_too_far(ur5, [first, last], limits)
        assert finding is not None
        ends = f"the {first.name} to the {last.name}"
        assert f"frame 'tool0' cannot move from {ends} within 0.1 s: " in finding.clause
        assert finding.clause.endswith("; increase the time or the limits")


def test_what_is_not_proven_is_only_probable(ur5: hovi.Robot) -> None:
    """At 95 % of the least time that inverse kinematics finds, boxes are too coarse for a proof."""
    limits = as_limits(ur5, "urdf")
    q0, q1 = np.random.default_rng(1).uniform(-2.8, 2.8, (2, 6))
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q1))
    branches = hovi.inverse_kinematics(ur5, goal, near=q0, most=64)
    least = float(np.abs(branches - q0).max(axis=1).min() / limits.upper[1, 0])
    assert found(ur5, hovi.State(q0), goal, 1.01 * least, limits) is None
    finding = found(ur5, hovi.State(q0), goal, 0.95 * least, limits)
    assert finding is not None
    assert not finding.certain
    assert "probably no motion exists" in finding.clause
    assert f"takes {least:.3g} s" in finding.clause


def test_joints_that_start_free_are_not_bounded(ur5: hovi.Robot) -> None:
    limits = as_limits(ur5, "urdf")
    q0 = np.array([0.0, -1.2, 1.2, -0.5, 0.3, 0.1])
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", q0 + 0.9))
    assert found(ur5, hovi.State(q0), goal, 0.05, limits) is not None
    assert found(ur5, hovi.State(q0, free="all"), goal, 0.05, limits) is None


def test_an_unlimited_arm_is_never_too_slow(ur5: hovi.Robot) -> None:
    goal = hovi.FrameGoal("tool0", ur5.frame_pose("tool0", np.full(6, 0.9)))
    limits = as_limits(ur5, {"base": "none", "q": 3.0})
    assert found(ur5, hovi.State(np.zeros(6)), goal, 1e-3, limits) is None


def test_the_direction_of_a_joint_decides_by_its_own_limit(two_link: hovi.Robot) -> None:
    """Both joints are fast upwards and slow downwards; the tip is reached by turning either way."""
    bounds = {"base": "none", "q": 3.0, "v": {"shoulder": [-1.0, 9.0], "elbow": [-1.0, 9.0]}}
    limits = as_limits(two_link, bounds)
    low, high = np.array([-0.5, -0.5]), np.array([0.6, 0.7])
    at_low, at_high = (hovi.FrameGoal("tip", two_link.frame_pose("tip", q)) for q in (low, high))
    for start, goal, is_slow in (
        (hovi.State(low), at_high, False),
        (hovi.State(high), at_low, True),
        (at_low, hovi.State(high), False),
        (at_high, hovi.State(low), True),
    ):
        assert (found(two_link, start, goal, 0.4, limits) is not None) == is_slow
        assert found(two_link, start, goal, 1.3, limits) is None


def test_only_ends_at_rest_take_time_to_accelerate(two_link: hovi.Robot) -> None:
    """By a = 2 rad/s^2 a travel of 1 rad takes 1.41 s between rests, 1 s from one, and none."""
    limits = as_limits(two_link, {"base": "none", "q": 3.0, "a": 2.0})
    q0, q1 = [0.0, 0.0], [1.0, 1.0]
    moving, free = hovi.State(q1, [3.0, 3.0]), hovi.State(q1, free_velocity="all")

    def is_short(time: float, start: Any, goal: Any, name: str = "goal") -> bool:
        waypoints = [Waypoint("start", 0.0, start), Waypoint(name, time, goal)]
        return bool(states_too_far_apart(two_link, waypoints, limits))

    rest, via = hovi.State(q0), "via point at 1 s"
    assert [is_short(t, rest, hovi.State(q1)) for t in (1.41, 1.42)] == [True, False]
    for goal in (moving, free):
        assert [is_short(t, rest, goal) for t in (0.99, 1.01)] == [True, False]
    assert [is_short(t, rest, hovi.State(q1), via) for t in (0.99, 1.01)] == [True, False]
    assert [is_short(t, rest, hovi.State(q1, [0, 0]), via) for t in (1.41, 1.42)] == [True, False]
    assert not is_short(0.01, hovi.State(q0, [1.0, 1.0]), moving)
    for velocity, times in (((), (1.41, 1.42)), ("all", (0.99, 1.01))):
        pose = two_link.frame_pose("tip", np.array(q1))
        goal = hovi.FrameGoal("tip", pose, free_velocity=velocity)
        assert [found(two_link, rest, goal, t, limits) is not None for t in times] == [True, False]


def test_a_configuration_that_is_nearer_than_all_branches_is_found(ur5: hovi.Robot) -> None:
    """A position leaves three joints free: of such families only some members are branches."""
    limits = as_limits(ur5, "urdf")
    q0, q1 = np.random.default_rng(1).uniform(-2.8, 2.8, (2, 6))
    goal = hovi.FrameGoal("tool0", position=ur5.frame_pose("tool0", q1)[:3, 3])
    branches = hovi.inverse_kinematics(ur5, goal, near=q0)
    least = float(np.abs(branches - q0).max(axis=1).min() / limits.upper[1, 0])
    time = 0.8 * least
    lower, upper = (q0 + sign * time * limits.upper[1] for sign in (-1, 1))
    box = {"base": "none", "q": [list(each) for each in zip(lower, upper, strict=True)]}
    inside = hovi.inverse_kinematics(ur5, goal, near=q0, limits=as_limits(ur5, box))
    assert np.abs(inside[0] - q0).max() <= time * limits.upper[1, 0]
    assert found(ur5, hovi.State(q0), goal, time, limits) is None
