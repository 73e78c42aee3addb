"""Poses and vectors as messages of ROS have them in YAML."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from hovi.planning.obstacles.yaml_text import YamlNode

UNIT_TOLERANCE = 1e-3
"""Largest deviation of a quaternion's length from 1."""


def pose_in(node: YamlNode) -> pin.SE3:
    """A pose; without an orientation, or with one of zeros, it is not turned."""
    keys = node.mapping("position", "orientation")
    at, turn = keys.get("position"), keys.get("orientation")
    position = np.zeros(3) if at is None else np.array(vector_in(at))
    xyzw = np.zeros(4) if turn is None else np.array(vector_in(turn, "xyzw"))
    length = math.hypot(*xyzw)  # which does not overflow
    if length == 0.0:
        return pin.SE3(np.eye(3), position)
    if turn is not None and not abs(length - 1.0) < UNIT_TOLERANCE:
        raise turn.error(f"`orientation` must be a unit quaternion, but its length is {length:.4g}")
    x, y, z, w = xyzw / length
    return pin.SE3(pin.Quaternion(w, x, y, z).matrix(), position)


def vector_in(node: YamlNode, names: str = "xyz") -> list[float]:
    """Numbers as a list, or by their names, of which missing ones are 0."""
    if node.is_mapping:
        keys = node.mapping(*names)
        given = [keys.get(name) for name in names]
        return [0.0 if each is None else each.number() for each in given]
    numbers = [each.number() for each in node.items()]
    if len(numbers) != len(names):
        raise node.error(f"expected the {len(names)} numbers {', '.join(names)}")
    return numbers
