"""Fixtures that several test files share."""

from __future__ import annotations

from pathlib import Path

import pytest

from hovi.robot import Robot, load_robot

MODELS = Path(__file__).resolve().parents[1] / "models"


@pytest.fixture(scope="session")
def models() -> Path:
    """The folder of the URDFs and scenes that travel with hovi."""
    return MODELS


@pytest.fixture(scope="session")
def two_link() -> Robot:
    """The paper's two-link arm."""
    return load_robot(MODELS / "two_link.urdf")


@pytest.fixture(scope="session")
def panda() -> Robot:
    """The Panda arm, fingers locked: seven vector joints."""
    return load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
