"""Frames that reach their goals at a velocity of their own, judged by Pinocchio alone."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError

Array = npt.NDArray[np.float64]

FRAME, T, HELD = "tool0", 1.5, 1e-8
BELT = np.array([0.2, 0.05, 0.0])
BEGIN = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])
END = BEGIN + np.array([0.5, 0.2, -0.3, 0.2, 0.1, 0.4])
OPTIONS: dict[str, Any] = {"self_collision": False}


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def moving(q: Array, v: Array) -> tuple[Array, Array, Array]:
    """The tool's position, velocity and angular velocity by Pinocchio, along the world's axes."""
    model = scene().robot.model
    data, frame = model.createData(), model.getFrameId(FRAME)
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    twist = pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
    return data.oMf[frame].translation.copy(), twist.linear.copy(), twist.angular.copy()


def at_end(found: hovi.Solution) -> tuple[Array, Array, Array]:
    return moving(found.trajectory.q[-1], found.trajectory.v[-1])


def goal(**more: Any) -> hovi.FrameGoal:
    pose = scene().robot.frame_pose(FRAME, END)
    return hovi.FrameGoal(FRAME, pose=pose, guess=END, **more)


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_a_tool_arrives_with_the_velocity_of_a_belt(limits: str) -> None:
    found = hovi.plan(scene(), BEGIN, goal(velocity=BELT), T, limits=limits, **OPTIONS)
    p, velocity, _ = at_end(found)
    assert found.success, found.message
    assert np.abs(p - goal().position).max() < HELD
    assert np.abs(velocity - BELT).max() < HELD


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.0, 0.3, -0.5]])
def test_it_turns_as_it_is_told(turn: list[float]) -> None:
    asked = goal(velocity=BELT, angular_velocity=turn)
    found = hovi.plan(scene(), BEGIN, asked, T, **OPTIONS)
    _, velocity, angular = at_end(found)
    assert found.success, found.message
    assert np.abs(velocity - BELT).max() < HELD
    assert np.abs(angular - turn).max() < HELD


def test_what_is_free_of_the_velocity_costs_least() -> None:
    """Other velocities of the joints with the same one of the tool cost more, by their square."""
    options = {"limits": "none", "tolerance": 1e-8} | OPTIONS
    found = hovi.plan(scene(), BEGIN, goal(velocity=BELT), T, **options)
    q, v = found.trajectory.q[-1], found.trajectory.v[-1]
    model = scene().robot.model
    frame, axes = model.getFrameId(FRAME), pin.LOCAL_WORLD_ALIGNED
    J = pin.computeFrameJacobian(model, model.createData(), q, frame, axes)[:3]
    free = np.linalg.svd(J)[2][3:]

    def cost(shift: Array) -> float:
        state = hovi.State(q, v + shift)
        return hovi.plan(scene(), BEGIN, state, T, guess=found.trajectory, **options).cost

    assert cost(np.zeros(6)) == pytest.approx(found.cost, rel=1e-8)
    for along in free:
        more, less = (cost(h * along) - found.cost for h in (0.05, -0.05))
        assert min(more, less) > 0.0
        assert more == pytest.approx(less, rel=0.2)


def test_joints_that_do_not_move_the_frame_end_at_rest() -> None:
    panda = hovi.Scene(hovi.load_robot("panda"), [hovi.effects.Gravity()])
    begin = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8, 0.03, 0.03]
    x, y, z = panda.robot.frame_pose("panda_hand", begin)[:3, 3]
    asked = hovi.FrameGoal("panda_hand", position=[x, y + 0.2, z], velocity=[0.0, 0.1, 0.0])
    found = hovi.plan(panda, begin, asked, T, **OPTIONS)
    assert found.success, found.message
    assert np.abs(found.trajectory.v[-1, 7:]).max() == 0.0
    assert np.abs(found.trajectory.v[-1, :7]).max() > 0.01


def test_a_segment_may_end_on_the_belt_and_go_along_with_it() -> None:
    along = goal().position + 0.3 * BELT
    still = np.zeros(3)
    segments = [
        hovi.Segment(goal(velocity=BELT, angular_velocity=still), 1.2),
        hovi.Segment(hovi.FrameGoal(FRAME, position=along, velocity=BELT), 0.3),
        hovi.Segment(BEGIN, 1.2),
    ]
    found = hovi.plan_sequence(scene(), BEGIN, segments, **OPTIONS)
    assert found.success, found.message
    for time in (1.2, 1.5):
        at = found.trajectory.sample([time])
        assert np.abs(moving(at.q[0], at.v[0])[1] - BELT).max() < HELD


def test_a_via_point_is_passed_at_a_velocity() -> None:
    via = hovi.Via(0.8, goal(velocity=BELT))
    found = hovi.plan(scene(), BEGIN, BEGIN, T, via=[via], **OPTIONS)
    assert found.success, found.message
    at = found.trajectory.sample([0.8])
    assert np.abs(moving(at.q[0], at.v[0])[1] - BELT).max() < HELD


def test_a_region_and_a_velocity_go_together() -> None:
    options = {"limits": "none", "tolerance": 1e-7} | OPTIONS
    h = 5e-4
    costs = [
        hovi.plan(scene(), BEGIN, goal(velocity=BELT, within=0.01 + x), T, **options)
        for x in (0.0, h, -h)
    ]
    found, slope = costs[0], (costs[1].cost - costs[2].cost) / (2 * h)
    p, velocity, _ = at_end(found)
    assert np.linalg.norm(p - goal().position) == pytest.approx(0.01, abs=1e-7)
    assert np.abs(velocity - BELT).max() < HELD
    assert found.region_prices["tool0 distance"] == pytest.approx(slope, rel=1e-2)


def test_replans_keep_the_velocity() -> None:
    found = hovi.plan(scene(), BEGIN, goal(velocity=BELT), T, **OPTIONS)
    again = found.advance(0.4)
    assert again.success, again.message
    assert np.abs(at_end(again)[1] - BELT).max() < HELD


def test_a_free_duration_ends_at_the_velocity() -> None:
    found = hovi.plan(scene(), BEGIN, goal(velocity=BELT), (0.8, 2.0), time_weight=300.0, **OPTIONS)
    assert found.success, found.message
    assert np.abs(at_end(found)[1] - BELT).max() < HELD


def test_files_have_velocities(tmp_path: Path) -> None:
    text = hovi.example("ur5_reach").read_text()
    path = tmp_path / "scene.toml"
    path.write_text(
        text[: text.index("[goal]")] + '[goal]\nframe = "tool0"\nposition = [0.45, 0.25, 0.25]\n'
        "velocity = [0.2, 0.0, 0.0]\nangular_velocity = [0.0, 0.0, 0.1]\n[effects.gravity]\n"
    )
    task = hovi.load_task(path)
    again = hovi.load_task(hovi.save_task(task, tmp_path / "again.toml")).goal
    assert isinstance(again, hovi.FrameGoal)
    assert np.array_equal(again.velocity, [0.2, 0.0, 0.0])
    assert np.array_equal(again.angular_velocity, [0.0, 0.0, 0.1])


@pytest.mark.parametrize("given", [[0.1, 0.2], "fast", [0.1, np.nan, 0.0]])
def test_what_is_no_velocity_is_refused(given: Any) -> None:
    with pytest.raises(InputError, match="velocity"):
        goal(velocity=given)


def test_a_start_is_a_state() -> None:
    with pytest.raises(InputError, match="a start takes no velocity of a frame"):
        hovi.plan(scene(), goal(velocity=BELT), BEGIN, T)
