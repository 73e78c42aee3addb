"""Scenes whose torques are not from the compiled kernel alone are planned within limits, too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi

THREE_JOINTS = """<mujoco model="arm"><compiler angle="radian"/><worldbody><body name="a">
<joint name="x" type="slide" axis="1 0 0" range="-1 1"/>
<joint name="y" type="slide" axis="0 1 0" range="-1 1"/>
<joint name="yaw" axis="0 0 1" range="-3 3"/>
<inertial pos="0 0 .2" mass="2" diaginertia=".03 .03 .01"/></body></worldbody></mujoco>"""


def two_link() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


def on_a_moving_base() -> hovi.Scene:
    base = hovi.effects.MovingBase(position=("0.1*sin(3*t)", 0, 0), rotation=(0, "0.2*t", 0))
    return hovi.Scene(two_link(), [hovi.effects.Gravity(), base])


@pytest.mark.parametrize("more", [{}, {"smooth": True}], ids=str)
def test_a_robot_on_a_moving_base_keeps_its_limits(more: dict[str, Any]) -> None:
    found = hovi.plan(
        *(on_a_moving_base(), [0, 0], [0.3, 0.7], 1.0),
        **{"limits": {"base": "none", "v": 1.2, "tau": 60.0}, "self_collision": False, **more},
    )
    assert found.success, found.message
    motion = found.trajectory.sample(np.linspace(0, 1, 5_001))
    assert np.abs(motion.v).max() <= 1.2 + 1e-5
    assert np.abs(motion.tau).max() <= 60.0 + 1e-3
    again = found.replan([0, 0], [0.35, 0.65])
    assert again.success, again.message


def test_an_mjcf_body_with_several_joints_keeps_its_limits(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(THREE_JOINTS)
    robot = hovi.load_robot(path)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    limits = {"base": "none", "v": 0.3}
    found = hovi.plan(scene, [0, 0, 0], [0.2, 0.2, 0.2], 1.0, limits=limits, self_collision=False)
    assert found.success, found.message
    motion = found.trajectory.sample(np.linspace(0, 1, 2_001))
    assert np.abs(motion.v).max() <= 0.3 + 1e-6
    model, data = robot.model, robot.model.createData()
    for q, v, a, tau in zip(motion.q, motion.v, motion.a, motion.tau, strict=True):
        np.testing.assert_allclose(tau, pin.rnea(model, data, q, v, a), atol=1e-9)


def test_samples_in_intervals_take_arrays_of_any_layout() -> None:
    scene = hovi.Scene(two_link(), [hovi.effects.Gravity()])
    motion = hovi.plan(scene, [0, 0], [0.3, 0.7], 1.0, intervals=4, limits="none").trajectory
    k, s = np.array([3, 2, 1, 0, 0]), np.array([0.9, 0.5, 0.25, 1.0, 0.0])
    reversed_twice = np.array(k[::-1])[::-1], np.array(s[::-1])[::-1]
    assert not reversed_twice[0].flags.c_contiguous
    for name in ("q", "v", "a", "tau"):
        x, y = (getattr(motion.sample_intervals(*at), name) for at in ((k, s), reversed_twice))
        np.testing.assert_array_equal(x, y)
    for one, other in zip(
        motion.jet_intervals(k, s), motion.jet_intervals(*reversed_twice), strict=True
    ):
        np.testing.assert_array_equal(one, other)
