"""A robot in words, for a terminal."""

from __future__ import annotations

import pinocchio as pin

from hovi.robot_source import RobotSource


def describe(name: str, model: pin.Model, source: RobotSource, tip_frame: str) -> str:
    """The text of `hovi info`: joints, limits, mass, and what the URDF holds besides."""
    return name
