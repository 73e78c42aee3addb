"""Distances along motions among obstacles, at twenty thousand instants, and what they cost."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.planning.clearance.distances import Distances

Array = npt.NDArray[np.float64]

MARGIN = 0.02
FAR = hovi.Sphere([0.0, 0.0, 1.85], 0.1, name="far")
ROBOTS = {"ur5": (0.16, 90), "kinova": (0.17, 52)}
"""One on a vector space, one with continuous joints: height of a ball over the path of the tool in
[m], and most steps."""
LIMITS = {"base": "none", "v": 3.0, "tau": 300.0}
GRID = {"scheme": "galerkin-2", "intervals": 16, "processes": 1, "self_collision": False}


def least(motion: hovi.Trajectory, *balls: hovi.Sphere) -> tuple[float, float]:
    """The least distance of any link from a ball along the motion, and when it is, in [m], [s]."""
    assert motion.robot is not None
    distances = Distances(motion.robot, hovi.Clearance(balls))
    t = np.linspace(0.0, motion.duration, 20_001)
    d = distances.values(motion.configurations(t)).min(axis=1)
    return float(d.min()), float(t[d.argmin()])


@cache
def scene(name: str) -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(name), [hovi.effects.Gravity()])


@cache
def ends(name: str) -> tuple[Array, Array]:
    robot = scene(name).robot
    start = robot.space.integrate(robot.neutral(), np.full(robot.nv, 0.2))
    return start, robot.space.integrate(start, np.linspace(0.8, -0.4, robot.nv))


@cache
def free(name: str) -> hovi.Solution:
    found = hovi.plan(scene(name), *ends(name), 1.0, limits=LIMITS, **GRID)
    assert found.success, found.message
    return found


@cache
def ball(name: str, height: float | None = None, radius: float = 0.06) -> hovi.Sphere:
    """Above where the tool is half way."""
    robot = scene(name).robot
    q = free(name).trajectory.configurations([0.5])
    tip = robot.frame_position(robot.tip_frames[0], q)[0]
    up = np.array([0.0, 0.0, ROBOTS[name][0] if height is None else height])
    return hovi.Sphere(tip + up, radius, name="ball")


def around(name: str, *balls: hovi.Sphere, goal: Any = None, **more: Any) -> hovi.Solution:
    goal = ends(name)[1] if goal is None else goal
    given = GRID | {"obstacles": list(balls), "margin": MARGIN, "limits": LIMITS} | more
    return hovi.plan(scene(name), ends(name)[0], goal, 1.0, **given)


def assert_kept(found: hovi.Solution, *balls: hovi.Sphere) -> None:
    """Exactly, and closely: it is worth passing at the margin."""
    assert found.success, found.message
    assert found.n_neg == 0
    assert MARGIN - 1e-7 <= least(found.trajectory, *balls)[0] < MARGIN + 1e-3


@pytest.mark.parametrize("name", ROBOTS)
def test_a_ball_that_is_too_near_is_passed_at_the_margin_in_few_steps(name: str) -> None:
    near = ball(name)
    assert least(free(name).trajectory, near)[0] < MARGIN - 3e-3
    found = around(name, near, FAR)
    assert_kept(found, near, FAR)
    assert found.nit <= ROBOTS[name][1]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_cost_changes_with_the_duration_as_the_multipliers_say(name: str) -> None:
    """Those of distances among them: without them it would be off by per cents."""
    found = around(name, ball(name))
    assert_kept(found, ball(name))
    assert found.problem is not None
    h, costs = 0.01, []
    for T in (1.0 - h, 1.0 + h):
        other = hovi.solve(found.problem.on(found.problem.grid.stretched(T)), found.trajectory)
        assert other.success, other.message
        costs.append(other.cost)
    slope = (costs[1] - costs[0]) / (2 * h)
    assert found.duration_derivative == pytest.approx(slope, rel=0.01)


def test_momenta_at_a_node_are_those_of_both_intervals_with_what_keeps_the_distance() -> None:
    """At the node where an interval begins that touches the margin, after one that does not."""
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    found = hovi.plan_task(task, intervals=24, limits={"base": "none", "a": 5e3})
    assert found.success, found.message
    assert found.problem is not None
    motion, N = found.trajectory, found.trajectory.grid.intervals
    distances = Distances(task.scene.robot, task.options.clearance)
    k, s = np.repeat(np.arange(N), 60), np.tile(np.linspace(0.0, 1.0, 60), N)
    gap = distances.values(motion.sample_intervals(k, s).q).min(axis=1)
    gap = gap.reshape(N, 60).min(axis=1) - float(task.options.clearance.margin)
    after = 1 + np.flatnonzero(gap[:-1] > 2e-3)
    assert (gap[after] < 5e-4).any()
    before = found.problem.ld.derivatives(motion.path)[after - 1, 2]
    size = np.abs(before).max()
    np.testing.assert_allclose(motion.momenta[after, 0], before, rtol=0, atol=1e-6 * size)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_motion_through_a_ball_goes_around_it(name: str) -> None:
    """The tool itself would pass through its middle."""
    inside = ball(name, 0.0, 0.05)
    assert least(free(name).trajectory, inside)[0] < -0.02
    found = around(name, inside)
    assert_kept(found, inside)
    for node, end in zip((0, -1), ends(name), strict=True):
        np.testing.assert_allclose(found.trajectory.q[node], end, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found.trajectory.v[node], 0.0, rtol=0, atol=1e-12)


def test_a_goal_of_a_frame_is_met_around_a_ball() -> None:
    robot, inside = scene("ur5").robot, ball("ur5", 0.0, 0.05)
    position = robot.frame_position("tool0", ends("ur5")[1][None])[0]
    found = around("ur5", inside, goal=hovi.FrameGoal("tool0", position=position))
    assert found.success, found.message
    assert least(found.trajectory, inside)[0] >= MARGIN - 1e-7
    reached = robot.frame_position("tool0", found.trajectory.q[-1:])[0]
    np.testing.assert_allclose(reached, position, rtol=0, atol=1e-9)


def test_a_motion_that_cannot_leave_is_infeasible_with_its_reason() -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    tip = robot.frame_position("tip", np.array([[0.4, 0.3]]))[0]
    wall = hovi.Box((0.05, 4.0, 4.0), tip)
    found = hovi.plan(scene, [0.0, 0.1], [0.8, 0.5], 1.0, obstacles=[wall], **GRID)
    assert found.status == "infeasible"
    assert "obstacle" in found.message


@pytest.mark.parametrize("free_velocity", [(), ("all",)], ids=["stop", "pass"])
def test_what_the_end_of_a_segment_gives_stays_next_to_a_ball(
    free_velocity: tuple[str, ...],
) -> None:
    start, goal = ends("ur5")
    middle = 0.5 * (start + goal)
    stop = {"goal": hovi.State(middle, free_velocity=free_velocity), "duration": 1.0}
    given = GRID | {"limits": LIMITS, "margin": MARGIN}
    segments = [stop, {"goal": goal, "duration": 1.0}]
    plain = hovi.plan_sequence(scene("ur5"), start, segments, **given)
    q = plain.trajectory.configurations([0.6])
    near = hovi.Sphere(scene("ur5").robot.frame_position("tool0", q)[0] + [0, 0, 0.15], 0.06)
    assert least(plain.trajectory, near)[0] < MARGIN - 3e-3
    found = hovi.plan_sequence(scene("ur5"), start, segments, obstacles=[near], **given)
    assert found.success, found.message
    assert least(found.trajectory, near)[0] >= MARGIN - 1e-7
    at = int(np.argmin(np.abs(found.trajectory.t - 1.0)))
    np.testing.assert_allclose(found.trajectory.q[at], middle, rtol=0, atol=1e-12)
    still = np.abs(found.trajectory.v[at]).max() < 1e-12
    assert still == (not free_velocity)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_motion_around_a_ball_is_replanned_in_fewer_steps(name: str) -> None:
    found = around(name, ball(name))
    robot = scene(name).robot
    goal = robot.space.integrate(ends(name)[1], np.full(robot.nv, 0.01))
    again, cold = found.replan(goal=goal), around(name, ball(name), goal=goal)
    assert_kept(again, ball(name))
    assert again.nit < 0.9 * cold.nit
    assert again.cost == pytest.approx(cold.cost, rel=1e-4)
