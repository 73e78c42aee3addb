"""The elements and attributes of a URDF, and those that other programs add."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

NUMBERS: dict[str, dict[str, int]] = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "dynamics": {"damping": 1, "friction": 1},
    "mimic": {"multiplier": 1, "offset": 1},
    "calibration": {"rising": 1, "falling": 1},
    "safety_controller": dict.fromkeys(
        ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), 1
    ),
    "box": {"size": 3},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "sphere": {"radius": 1},
    "mesh": {"scale": 3},
    "color": {"rgba": 4},
}
"""Number of values in each attribute, by element."""

_TEXTS: dict[str, tuple[str, ...]] = {
    "robot": ("name", "version"),
    "link": ("name",),
    "visual": ("name",),
    "collision": ("name",),
    "joint": ("name", "type"),
    "parent": ("link",),
    "child": ("link",),
    "mimic": ("joint",),
    "calibration": ("reference_position",),
    "mesh": ("filename",),
    "texture": ("filename",),
    "material": ("name",),
}
"""Attributes whose value is a text, by element."""

CHILDREN: dict[str, tuple[str, ...]] = {
    "robot": ("link", "joint", "material"),
    "link": ("inertial", "visual", "collision"),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "geometry": ("box", "cylinder", "capsule", "sphere", "mesh"),
    "material": ("color", "texture"),
    "joint": (
        *("origin", "axis", "parent", "child", "limit", "dynamics", "mimic"),
        *("calibration", "safety_controller"),
    ),
}
"""Elements that each element may contain; elements that are not listed contain none."""

EXTENSIONS: dict[str, tuple[str, ...]] = {
    "robot": ("gazebo", "transmission", "ros2_control", "sensor", "mujoco"),
    "link": ("gazebo", "contact"),
    "joint": ("gazebo",),
    "collision": ("material", "verbose", "contact_coefficients"),
}
"""Elements that simulators and controllers add; they do not describe the mechanism."""

PARENTS: dict[str, str] = {
    "link": "robot",
    "joint": "robot",
    **dict.fromkeys(("inertial", "visual", "collision"), "link"),
    **dict.fromkeys(("mass", "inertia"), "inertial"),
    "geometry": "visual",
    **dict.fromkeys(("axis", "parent", "child", "limit", "dynamics", "mimic"), "joint"),
}
"""The element in which each element of the mechanism and its shapes belongs."""


def attributes_of(tag: str) -> tuple[str, ...]:
    """The attributes of an element."""
    return (*NUMBERS.get(tag, ()), *_TEXTS.get(tag, ()))


def elements_in_use(robot: Element) -> Iterator[tuple[Element, Element]]:
    """(link, joint or material, element inside it) for everything that Pinocchio reads."""
    for link in robot.iterfind("link"):
        for tag in ("inertial", "visual", "collision"):
            for part in link.iterfind(tag):
                yield from ((link, element) for element in part.iter())
    for tag in ("joint", "material"):
        for owner in robot.iterfind(tag):
            yield from ((owner, element) for element in owner)


def tag_and_name(owner: Element) -> str:
    """The name of an element of the robot in messages, such as "link 'arm'"."""
    return "<robot>" if owner.tag == "robot" else f"{owner.tag} {owner.get('name', '')!r}"
