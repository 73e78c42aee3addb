"""Models from example-robot-data, read from their URDF files without meshes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

LoadModel = Callable[..., pin.Model]


@cache
def read_urdf(name: str, free_flyer: bool) -> pin.Model:
    from example_robot_data import robots_loader

    robot = robots_loader.ROBOTS[name]
    relative = Path(robot.path) / robot.urdf_subpath / robot.urdf_filename
    urdf = str(Path(robots_loader.getModelPath(str(relative))) / relative)
    if free_flyer:
        return pin.buildModelFromUrdf(urdf, pin.JointModelFreeFlyer())
    return pin.buildModelFromUrdf(urdf)


@pytest.fixture(scope="session")
def load_model() -> LoadModel:
    """load_model(name, free_flyer=False, locked=(), armature=False) -> a new model."""

    def load(
        name: str, *, free_flyer: bool = False, locked: tuple[str, ...] = (), armature: bool = False
    ) -> pin.Model:
        model = read_urdf(name, free_flyer).copy()
        if locked:
            ids = [model.getJointId(joint) for joint in locked]
            model = pin.buildReducedModel(model, ids, pin.neutral(model))
        if armature:
            model.armature = np.random.default_rng(1).uniform(0.1, 1.0, model.nv)
        return model

    return load
