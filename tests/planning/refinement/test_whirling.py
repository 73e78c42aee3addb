"""Light joints that whirl without limits are named, with what helps."""

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.planning.solver.solver import solve_on_grid

XARM_REACH = [0.3, -0.6, 0.5, 0.8, 0.2, 0.4, -0.3], [-0.9, 0.4, -0.8, 1.6, 1.2, 1.3, 1.5], 3.0


@pytest.fixture(scope="module")
def xarm() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("xarm7"), [hovi.effects.Gravity()])


def test_a_whirling_wrist_is_named_with_its_inertia(xarm: hovi.Scene) -> None:
    found = hovi.plan(xarm, *XARM_REACH, limits="none")
    assert found.status is hovi.Status.UNRESOLVED
    named = re.search(
        r"joint '(\S+)' whirls at up to (\S+) rad/s with an inertia of (\S+) kg", found.message
    )
    assert named is not None
    joint = xarm.robot.coordinate_names.index(named[1])
    motion = found.trajectory.sample(np.linspace(0.0, 3.0, 20_001))
    assert float(named[2]) == pytest.approx(np.abs(motion.v[:, joint]).max(), rel=0.05)
    model = xarm.robot.model.copy()
    model.armature = np.zeros(model.nv)
    mass = [pin.crba(model, model.createData(), q)[joint, joint] for q in found.trajectory.q]
    assert float(named[3]) == pytest.approx(min(mass), rel=0.05)
    for remedy in ("limits", "armature", "acceleration_cost"):
        assert remedy in found.message


def test_each_remedy_helps(xarm: hovi.Scene) -> None:
    gravity, robot = hovi.effects.Gravity(), xarm.robot
    rotors = hovi.Scene(robot, [gravity, hovi.effects.Armature(0.1)])
    smooth = hovi.Scene(robot, [gravity, hovi.effects.AccelerationCost(0.05)])
    for scene, limits in ((xarm, "urdf"), (rotors, "none"), (smooth, "none")):
        found = hovi.plan(scene, *XARM_REACH, limits=limits)
        assert found.success, found.message


def test_info_names_light_joints_beforehand(xarm: hovi.Scene) -> None:
    assert "little inertia about joint7 (0.00014 kg m^2)" in xarm.robot.describe()
    rotors = hovi.load_robot("talos_arm")  # its model has rotors in the arm, none in the gripper
    assert "gripper_left_joint (0.0012 kg m^2)" in rotors.describe()
    assert "little inertia" not in hovi.load_robot(hovi.example("two_link.urdf")).describe()


def test_a_whirling_motion_that_a_finer_grid_leaves_is_no_minimum() -> None:
    """Two more modes change its cost by 0.5 %, intervals of a quarter by 3 %."""
    robot = hovi.load_robot("talos_arm", locked=["gripper_left_joint"])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start, goal = [1.82, 0.43, -1.69, -1.36, 0.09, -0.62], [0.48, 1.02, -0.76, -2.39, -0.94, 0.16]
    found = hovi.plan(scene, start, goal, 1.23, limits="none", processes=1, tolerance=0.03)
    assert found.problem is not None
    quarters = found.problem.on(found.problem.grid.halved().halved())
    finer = solve_on_grid(quarters, found.trajectory)
    assert finer.success
    assert finer.cost < 0.99 * found.cost
    assert found.status is hovi.Status.UNRESOLVED
    assert "a finer grid may find another motion" in found.message
