"""Which pairs of a robot's own shapes are kept apart."""

from __future__ import annotations

import warnings

import coal
import numpy as np
import pinocchio as pin
import pytest

from hovi.errors import HoviWarning
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.self_collisions import self_collision_pairs
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs


def arm(radius: float, limit: float = 3.0) -> Robot:
    """Three links in a plane with a ball at the end of each; half a metre from joint to joint."""
    model, geometry, parent = pin.Model(), pin.GeometryModel(), 0
    for i in range(3):
        place = pin.SE3(np.eye(3), np.array([0.5 * (i > 0), 0.0, 0.0]))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{i}")
        model.addFrame(pin.Frame(f"l{i}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Identity())
    model.lowerPositionLimit, model.upperPositionLimit = np.full(3, -limit), np.full(3, limit)
    for i in range(3):
        frame = model.getFrameId(f"l{i}")
        ball = coal.Sphere(radius)
        end = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
        geometry.addGeometryObject(pin.GeometryObject(f"b{i}", i + 1, frame, end, ball))
    return load_robot(model, collision=geometry)


def test_pairs_that_overlap_at_every_configuration_are_named_once_and_left_out() -> None:
    robot = arm(0.6)  # the balls' centers are a metre apart at most
    with pytest.warns(HoviWarning, match="'l0' and 'l2'") as caught:
        assert self_collision_pairs(robot) == ()
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert self_collision_pairs(robot) == ()


def test_pairs_that_come_apart_anywhere_within_the_limits_are_kept() -> None:
    """The centers are up to a metre apart, where the arm is stretched."""
    assert self_collision_pairs(arm(0.45)) == ((0, 2),)


def test_no_pair_of_a_real_robot_is_left_out_or_added(panda: Robot, ur5: Robot) -> None:
    for robot in (panda, ur5):
        expected = checked_pairs(robot.model, convex_geometry(robot), robot.semantics.disabled)
        assert self_collision_pairs(robot) == tuple(expected)
