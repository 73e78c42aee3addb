"""Motions that collide with themselves where self-collision was left out say so."""

from __future__ import annotations

import subprocess
import sys

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi

RADIUS = 0.2
STRETCHED, FOLDED = [0.0, 0.2, 0.0], [0.0, 2.9, 2.6]


def arm(radius: float = RADIUS) -> hovi.Robot:
    """Three links in a plane with a ball at the end of each; half a metre from joint to joint."""
    model, geometry, parent = pin.Model(), pin.GeometryModel(), 0
    for i in range(3):
        place = pin.SE3(np.eye(3), np.array([0.5 * (i > 0), 0.0, 0.0]))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{i}")
        frame = pin.Frame(f"l{i}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        body = model.addFrame(frame)
        inertia = pin.Inertia(1.0, np.array([0.25, 0.0, 0.0]), 0.02 * np.eye(3))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        end = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
        ball = coal.Sphere(radius)
        geometry.addGeometryObject(pin.GeometryObject(f"b{i}", i + 1, body, end, ball))
    model.effortLimit = model.velocityLimit = np.full(3, 1e3)
    model.lowerPositionLimit, model.upperPositionLimit = np.full(3, -3.0), np.full(3, 3.0)
    return hovi.load_robot(model, collision=geometry)


def planned(robot: hovi.Robot, goal: list[float], **options: object) -> hovi.Solution:
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    options = {"limits": "none", "intervals": 8, "self_collision": False} | options
    return hovi.plan(scene, STRETCHED, goal, 1.0, **options)


def gap(q: np.ndarray) -> float:
    """The distance of the first ball from the last, by the geometry of the plane."""
    angle = np.cumsum(np.asarray(q), axis=-1)[..., 1:]
    between = 0.5 * np.exp(1j * angle).sum(axis=-1)
    return float(np.abs(between).min()) - 2 * RADIUS


def test_the_links_are_named_with_depth_and_time() -> None:
    found = planned(arm(), FOLDED)
    least = gap(found.trajectory.sample(np.linspace(0.0, 1.0, 129)).q)
    assert least < -0.01
    assert "Self-collision was left out" in found.message
    assert f"'l0' and 'l2' into each other, by {-least:.2g} m at t = " in found.message


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
def test_nothing_is_said_of_a_motion_without_collisions_or_with_self_collision() -> None:
    assert "Self-collision" not in planned(arm(0.02), [0.3, 0.4, 0.2]).message
    assert "Self-collision" not in planned(arm(), FOLDED, self_collision=True).message


def test_links_that_overlap_all_the_time_are_not_told() -> None:
    """As hulls of neighbours do."""
    found = planned(arm(0.6), [0.3, 0.4, 0.2])
    assert "into each other" not in found.message


def test_a_sequence_tells_it_too() -> None:
    scene = hovi.Scene(arm(), [hovi.effects.Gravity()])
    segments = [{"goal": FOLDED, "duration": 1.0}, {"goal": STRETCHED, "duration": 1.0}]
    found = hovi.plan_sequence(
        scene, STRETCHED, segments, limits="none", intervals=8, self_collision=False
    )
    assert "'l0' and 'l2' into each other" in found.message


def test_robots_without_shapes_have_nothing_to_tell(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    found = hovi.plan(scene, [0.0, 0.0], [0.3, 0.2], 1.0, limits="none", intervals=4)
    assert "into each other" not in found.message


def test_it_is_told_however_short_the_process_has_run() -> None:
    """And however long reading the meshes takes: the same plan says the same everywhere."""
    code = "import hovi; print(hovi.plan_task(hovi.load_task(hovi.example('panda_reach'))).message)"
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    assert "Self-collision was left out, and the motion brings links 'panda_" in done.stdout
