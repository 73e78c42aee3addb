"""Fixtures that several test files share."""

from __future__ import annotations

from pathlib import Path

import pytest

from hovi.effects import Gravity
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

MODELS = Path(__file__).resolve().parents[1] / "models"


@pytest.fixture(scope="session")
def models() -> Path:
    """The folder of the bundled URDFs and scenes."""
    return MODELS


@pytest.fixture(scope="session")
def two_link() -> Robot:
    """The paper's two-link arm."""
    return load_robot(MODELS / "two_link.urdf")


@pytest.fixture(scope="session")
def panda() -> Robot:
    """The Panda arm, fingers locked: seven vector joints."""
    return load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])


@pytest.fixture(scope="session")
def ur5() -> Robot:
    """The UR5 arm: six vector joints."""
    return load_robot("ur5")


@pytest.fixture(scope="session")
def two_arms() -> Robot:
    """Baxter with two joints of each arm, all others locked; its file ends at a fixed sensor."""
    moving = {f"{side}_{joint}" for side in ("left", "right") for joint in ("s1", "e1")}
    locked = [joint for joint in load_robot("baxter").joint_names if joint not in moving]
    return load_robot("baxter", locked=locked)


@pytest.fixture(scope="session")
def pendulum() -> Robot:
    """One joint under a bob of one kilogram."""
    return load_robot(MODELS / "pendulum.urdf")


@pytest.fixture(scope="session")
def arm_scene(two_link: Robot) -> Scene:
    """The two-link arm under the paper's gravity of 9.8 m/s^2."""
    return Scene(two_link, [Gravity(9.8)])
