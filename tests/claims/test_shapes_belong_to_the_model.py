"""Shapes of a pinocchio.Model are on its joints: others are refused, and frames may be left out."""

from __future__ import annotations

import coal
import pinocchio as pin
import pytest

import hovi
from hovi.errors import ModelError


def arm() -> pin.Model:
    """Three links in a row."""
    return pin.buildModelFromXML(hovi.chain(3))


def balls(joints: tuple[int, ...]) -> pin.GeometryModel:
    """A ball on each of some joints, without frames."""
    geometry = pin.GeometryModel()
    for joint in joints:
        placed = pin.SE3.Identity()
        shape = pin.GeometryObject(f"ball_{joint}", joint, placed, coal.Sphere(0.05))
        geometry.addGeometryObject(shape)
    return geometry


def test_shapes_without_a_frame_are_kept_apart() -> None:
    robot = hovi.load_robot(arm(), collision=balls((1, 3)))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    found = hovi.plan(scene, [0.0] * 3, [0.3] * 3, 1.0, self_collision=True, limits="none")
    assert found.success
    assert found.margins().distance is not None


def test_a_shape_on_a_joint_that_is_not_there_is_refused() -> None:
    with pytest.raises(ModelError, match="'ball_7' is on joint 7, and model 'chain_3' has 4"):
        hovi.load_robot(arm(), collision=balls((1, 7)))
    assert hovi.load_robot(arm()).nv == 3


def test_the_legs_of_talos_are_without_its_torso() -> None:
    robot = hovi.load_robot("talos_legs")
    for shapes in (robot.visual, robot.collision):
        assert shapes is not None
        joints = [shape.parentJoint for shape in shapes.geometryObjects]
        assert max(joints) < robot.model.njoints
        assert len(joints) == 13
