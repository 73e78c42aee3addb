"""Smooth motions of continuous joints: frames at either end, motions of least effort as guesses."""

from __future__ import annotations

import numpy as np
import pytest

import hovi

HERE = [0.0, 2.5, 2.0, 0.0, 1.0, 0.0]
THERE = [0.5, 2.6, 2.0, 0.0, 1.0, 0.0]
DURATION = 8.0


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    names = hovi.load_robot("kinova").joint_names
    robot = hovi.load_robot("kinova", locked=[name for name in names if "finger" in name])
    return hovi.Scene(robot, [hovi.effects.Gravity()])


@pytest.mark.parametrize("of", ["start", "goal"])
def test_a_frame_is_met_at_either_end(scene: hovi.Scene, of: str) -> None:
    target = [0.3, -0.3, 0.4]
    frame = {"frame": scene.robot.tip_frame, "position": target}
    ends = (frame, THERE) if of == "start" else (HERE, frame)
    found = hovi.plan(scene, *ends, DURATION, smooth=True)
    assert found.success, found.message
    q = found.trajectory.q[0 if of == "start" else -1]
    met = scene.robot.frame_position(scene.robot.tip_frame, q[None])[0]
    np.testing.assert_allclose(met, target, atol=1e-6)


def test_a_motion_of_least_effort_is_a_guess_of_a_smooth_one(scene: hovi.Scene) -> None:
    rough = hovi.plan(scene, HERE, THERE, DURATION)
    smooth = hovi.plan(scene, HERE, THERE, DURATION, smooth=True, guess=rough.trajectory)
    assert smooth.success, smooth.message
    own = hovi.plan(scene, HERE, THERE, DURATION, smooth=True)
    assert smooth.cost == pytest.approx(own.cost, rel=2e-3)


def test_the_jerk_of_a_motion_of_least_effort_is_the_slope_of_its_acceleration(
    scene: hovi.Scene,
) -> None:
    motion = hovi.plan(scene, HERE, THERE, DURATION).trajectory
    inside = (motion.t[:-1] + motion.t[1:]) / 2
    step = 1e-5
    after, before = (motion.sample(inside + x).a for x in (step, -step))
    jerk = motion.jet(inside, 3)[3]
    scale = np.abs(jerk).max()
    np.testing.assert_allclose(jerk / scale, (after - before) / (2 * step * scale), atol=1e-5)
