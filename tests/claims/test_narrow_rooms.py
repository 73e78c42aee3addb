"""Rooms just above ten tolerances, below which values are kept instead, by Pinocchio alone."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.conditions import Keep, OnLine, OnPlane, Upright

Array = np.ndarray
STARTS = {
    "ur5": ("tool0", [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]),
    "panda": ("panda_hand_tcp", [0.2, -0.4, 0.1, -2.1, 0.0, 1.8, 0.9]),
}
TENTH_MILLIMETRE, TENTH_DEGREE = 1e-4, float(np.deg2rad(0.1))
"""Ten times the tolerances."""
WAY = np.array([-0.05, 0.25, 0.0])
MORE_ROOMS = [pytest.param(room, marks=pytest.mark.long) for room in (1.3, 5.0, 9.0)]
ALONE: dict[str, Any] = {"self_collision": False, "processes": 1}


@functools.cache
def given(arm: str) -> tuple[hovi.Scene, str, Array, hovi.FrameGoal]:
    """The scene, the frame, the start and the goal."""
    frame, start = STARTS[arm]
    fingers = ["panda_finger_joint1", "panda_finger_joint2"] if arm == "panda" else []
    robot = hovi.load_robot(arm, locked=fingers)
    place = robot.frame_pose(frame, start)[:3, 3] + WAY
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    return scene, frame, np.array(start), hovi.FrameGoal(frame, position=place)


def poses(scene: hovi.Scene, frame: str, motion: hovi.Trajectory, times: Array) -> Array:
    """R and p of a frame, (P, 3, 4)."""
    model, data = scene.model, scene.model.createData()
    number = model.getFrameId(frame, pin.BODY)
    found = []
    for q in motion.configurations(times):
        pin.framesForwardKinematics(model, data, q)
        found.append(data.oMf[number].homogeneous[:3])
    return np.array(found)


def off_line(at: Array) -> Array:
    d = WAY / np.linalg.norm(WAY)
    gone = at[:, :, 3] - at[0, :, 3]
    return np.linalg.norm(gone - np.outer(gone @ d, d), axis=1)


def off_plane(at: Array) -> Array:
    return np.abs(at[:, 2, 3] - at[0, 2, 3])


def tilted(at: Array) -> Array:
    up = np.abs(at[0, 2, :3]).argmax()  # the axis that points up or down at the start
    inner = at[0, :, :3].T @ [0.0, 0.0, np.sign(at[0, 2, up])]
    return np.arccos(np.clip(at[:, :, :3] @ inner @ [0.0, 0.0, np.sign(at[0, 2, up])], -1, 1))


def upright(frame: str, within: float | None, scene: hovi.Scene, start: Array) -> Keep:
    """What points up or down at the start."""
    R = scene.robot.frame_pose(frame, start)[:3, :3]
    side = float(np.sign(R[2, np.abs(R[2]).argmax()]))
    return Upright(frame, axis=((R.T @ [0, 0, side]).tolist(), [0, 0, side]), within=within)


KINDS: dict[str, tuple[Callable[..., Keep], float, Callable[[Array], Array]]] = {
    "line": (lambda f, w, *_: OnLine(f, within=w), TENTH_MILLIMETRE, off_line),
    "plane": (lambda f, w, *_: OnPlane(f, within=w), TENTH_MILLIMETRE, off_plane),
    "upright": (upright, TENTH_DEGREE, tilted),
}


def kept(arm: str, kind: str, room: float | None) -> Keep:
    scene, frame, start, _ = given(arm)
    make, unit, _ = KINDS[kind]
    return make(frame, None if room is None else room * unit, scene, start)


def require_held(
    arm: str, kind: str, room: float, motion: hovi.Trajectory, until: float = 1.5
) -> None:
    """Within the room at 2,001 times, and next to its bound somewhere, where it costs least."""
    scene, frame, _, _ = given(arm)
    _, unit, distances = KINDS[kind]
    off = distances(poses(scene, frame, motion, np.linspace(0.0, until, 2001)))
    assert 0.9 < off.max() / (room * unit) < 1.0 + 1e-3


@pytest.mark.parametrize("limits", ["none", "urdf"])
@pytest.mark.parametrize("room", [1.1, 2.0, *MORE_ROOMS])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("arm", STARTS)
def test_a_narrow_room_is_used_and_held(arm: str, kind: str, room: float, limits: str) -> None:
    scene, _, start, goal = given(arm)
    asked = ALONE | {"limits": limits}
    found = hovi.plan(scene, start, goal, 1.5, keep=[kept(arm, kind, room)], **asked)
    assert found.success, found.message
    require_held(arm, kind, room, found.trajectory)


@pytest.mark.parametrize("kind", KINDS)
def test_in_a_segment_and_in_a_part_of_a_motion(kind: str) -> None:
    scene, _, start, goal = given("ur5")
    keep = kept("ur5", kind, 1.2)
    home = hovi.Segment(start, 1.2, name="home")
    there = hovi.Segment(goal, 1.5, name="there", keep=[keep])
    both = hovi.plan_sequence(scene, start, [there, home], **ALONE)
    assert both.success, both.message
    require_held("ur5", kind, 1.2, both.trajectory, 1.5)


def test_a_replan_stays_within_the_room() -> None:
    scene, _, start, goal = given("ur5")
    found = hovi.plan(scene, start, goal, 1.5, keep=[kept("ur5", "line", 1.2)], **ALONE)
    again = found.replan(start=start + 1e-4)
    assert again.success, again.message
    rest = found.advance(0.3)
    assert rest.success, rest.message


def test_a_smooth_motion_begins_without_the_middle() -> None:
    scene, _, start, goal = given("ur5")
    keep = [kept("ur5", "plane", 5.0)]
    found = hovi.plan(scene, start, goal, 1.5, keep=keep, smooth=True, limits="none", **ALONE)
    assert found.success, found.message
    require_held("ur5", "plane", 5.0, found.trajectory)


@pytest.mark.parametrize("seconds", [1e-3, 0.02])
def test_time_runs_out_in_words(seconds: float) -> None:
    scene, _, start, goal = given("panda")
    keep = [kept("panda", "line", 1.2)]
    found = hovi.plan(scene, start, goal, 1.5, keep=keep, time_limit=seconds, **ALONE)
    assert found.status == "time_limit"
    assert "time limit" in found.message


def test_a_middle_has_a_value() -> None:
    wide = hovi.Condition("q[0]", hovi.Between(-1, 1))
    with pytest.raises(hovi.errors.InputError, match="middle"):
        hovi.Condition("q[0]", hovi.Between(-1, 1), middle=wide)
