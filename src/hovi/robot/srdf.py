"""Reads SRDF files: groups of joints, named poses, and pairs of links without collision checking.

An SRDF is XML: `<group_state name="ready"><joint name="elbow" value="1.2"/></group_state>` and
`<disable_collisions link1="hand" link2="finger"/>`. A group has members `<joint name=""/>`,
`<link name=""/>` (its own joint), `<chain base_link="" tip_link=""/>` and `<group name=""/>`. The
groups of states are ignored: states of the same name are merged, and joints that they do not list
are neutral.
"""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import NoReturn

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import InputError, ModelError, nearest
from hovi.robot.model import frame_named
from hovi.robot.urdf.rules import MAX_MAGNITUDE, is_decimal
from hovi.system.dataclass import dataclass
from hovi.system.files import reason, require_file

Array = npt.NDArray[np.float64]

MAX_BYTES = 8_000_000
_MEMBERS = {
    **dict.fromkeys(("joint", "link", "group"), ("name",)),
    "chain": ("base_link", "tip_link"),
}
"""The members of a group, and their attributes."""


@dataclass(frozen=True, eq=False)
class Srdf:
    """The parts of an SRDF that hovi reads.

    states: joint positions by joint and name of the pose, in [rad] or [m].
    disabled: unordered pairs of links that are not checked for collisions.
    groups: members of every group: ("joint" or "link" or "group", name) or ("chain", base, tip).
    """

    states: Mapping[str, Mapping[str, tuple[float, ...]]]
    disabled: frozenset[frozenset[str]]
    groups: Mapping[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)

    def joints_of(self, group: str, model: pin.Model) -> tuple[str, ...]:
        """The joints of a group that a model has, in its order; those that mimic others included.

        Raises InputError for an unknown group, ModelError for an unknown link or a group in itself.
        """
        if group not in self.groups:
            known = (
                nearest(group, self.groups) if self.groups else "its SRDF, if any, defines none."
            )
            raise InputError(f"robot {model.name!r} has no group {group!r}: {known}")
        found = self._joints_of(group, model, ())
        return tuple(str(name) for name in list(model.names)[1:] if name in found)

    def _joints_of(self, group: str, model: pin.Model, above: tuple[str, ...]) -> set[str]:
        if group in above:
            raise ModelError(f"group {group!r} of the SRDF contains itself: break that cycle.")
        if group not in self.groups:
            raise ModelError(f"the SRDF names a group {group!r} that it does not define.")
        found: set[str] = set()
        for kind, *names in self.groups[group]:
            if kind == "group":
                found |= self._joints_of(names[0], model, (*above, group))
            elif kind == "joint":
                found.add(names[0])
            elif kind == "link":
                found |= _own_joint(model, names[0], group)
            else:
                base, tip = (_supports(model, link, group) for link in names)
                found |= set(tip) - set(base)
        return found

    def poses(self, model: pin.Model) -> dict[str, Array]:
        """Configurations (nq,) by name: neutral, except for the joints that a state lists.

        Joints that the model does not have, or that mimic others, are ignored, and so are states
        without any other joint. Raises ModelError for a joint with the wrong number of values.
        """
        pairs = zip(model.names, model.joints, strict=True)
        known = {name for name, joint in list(pairs)[1:] if joint.nv}
        poses = {}
        for name, joints in self.states.items():
            values = {joint: value for joint, value in joints.items() if joint in known}
            if values:
                poses[name] = _configuration(model, name, values)
        return poses


def read_srdf_file(path: Path) -> str:
    """The text of an SRDF file. Raises ModelError if it is missing, too large or not UTF-8."""
    try:
        require_file(path, MAX_BYTES)
        return path.read_bytes().decode()
    except OSError as error:
        raise ModelError(f"cannot read the SRDF {str(path)!r}: {reason(error)}.") from error
    except UnicodeDecodeError as error:
        raise ModelError(f"the SRDF {path.name!r} is not UTF-8 text: save it as UTF-8.") from error


def parse_srdf(text: str, name: str = "robot.srdf") -> Srdf:
    """The poses and disabled pairs in the text of an SRDF.

    name: of the SRDF, for messages. Raises ModelError.
    """
    root = _root(text, name)
    states: dict[str, dict[str, tuple[float, ...]]] = {}
    for state in root.iterfind("group_state"):
        pose = states.setdefault(_attribute(state, "name", name), {})
        for joint in state.iterfind("joint"):
            pose[_attribute(joint, "name", name)] = _numbers(joint, name)
    pairs = (
        frozenset(_attribute(pair, end, name) for end in ("link1", "link2"))
        for pair in root.iterfind("disable_collisions")
    )
    groups = {
        _attribute(group, "name", name): tuple(
            (part.tag, *(_attribute(part, key, name) for key in _MEMBERS[part.tag]))
            for part in group
            if part.tag in _MEMBERS
        )
        for group in root.iterfind("group")
    }
    return Srdf(states, frozenset(pairs), groups)


def _own_joint(model: pin.Model, link: str, group: str) -> set[str]:
    """The joint between a link and its parent, if it moves."""
    _supports(model, link, group)
    frame = frame_named(model, link)
    fixed = model.frames[frame.parentFrame].type != pin.JOINT
    return set() if fixed else {str(model.names[frame.parentJoint])}


def _supports(model: pin.Model, link: str, group: str) -> tuple[str, ...]:
    """The joints between the world and a link. Raises ModelError for an unknown one."""
    if not any(frame.name == link for frame in model.frames):
        raise ModelError(f"group {group!r} of the SRDF names link {link!r}, which does not exist.")
    joint = frame_named(model, link).parentJoint
    return tuple(str(model.names[index]) for index in list(model.supports[joint])[1:])


class _Builder(ElementTree.TreeBuilder):
    """Builds an element tree, but refuses the DOCTYPE that entities need."""

    def doctype(self, *_: object) -> NoReturn:
        raise ModelError("an SRDF needs no DOCTYPE and no entities: delete that declaration.")


def _root(text: str, name: str) -> ElementTree.Element:
    parser = ElementTree.XMLParser(target=_Builder())
    try:
        parser.feed(text)
        root: ElementTree.Element = parser.close()
    except (ElementTree.ParseError, UnicodeEncodeError) as error:
        raise ModelError(f"SRDF {name!r} is not well-formed XML: {error}.") from error
    if root.tag != "robot":
        raise ModelError(f"SRDF {name!r}: its root element must be <robot>, not <{root.tag[:40]}>.")
    return root


def _attribute(element: ElementTree.Element, key: str, name: str) -> str:
    value = element.get(key)
    if not value:
        raise ModelError(f"SRDF {name!r}: a <{element.tag}> lacks its attribute {key!r}.")
    return value


def _numbers(joint: ElementTree.Element, name: str) -> tuple[float, ...]:
    text = _attribute(joint, "value", name)
    words = text.split()
    finite = bool(words) and all(map(is_decimal, words))
    if not finite or max(abs(float(word)) for word in words) > MAX_MAGNITUDE:
        raise ModelError(
            f"SRDF {name!r}: the value of joint {joint.get('name')!r} must be plain finite numbers "
            f"of at most {MAX_MAGNITUDE:g}, got {text[:40]!r}."
        )
    return tuple(map(float, words))


def _configuration(model: pin.Model, name: str, values: Mapping[str, tuple[float, ...]]) -> Array:
    q = np.array(pin.neutral(model), dtype=float)
    angles = np.zeros(model.nv)
    for joint_name, numbers in values.items():
        joint = model.joints[model.getJointId(joint_name)]
        if len(numbers) == joint.nq:
            q[joint.idx_q : joint.idx_q + joint.nq] = numbers
        elif len(numbers) == joint.nv:
            angles[joint.idx_v : joint.idx_v + joint.nv] = numbers
        else:
            raise ModelError(
                f"pose {name!r} gives joint {joint_name!r} {len(numbers)} numbers; "
                f"it takes {joint.nq}."
            )
    q = pin.normalize(model, q)
    if not pin.isNormalized(model, q, 1e-6):
        raise ModelError(f"pose {name!r} gives a joint zeros where a rotation has length 1.")
    return np.array(pin.integrate(model, q, angles), dtype=float)


def checked_pairs(
    model: pin.Model, geometry: pin.GeometryModel, disabled: frozenset[frozenset[str]]
) -> list[tuple[int, int]]:
    """Pairs of shapes to check for self-collision, by index in the geometry.

    All shapes on two different joints of which neither is the parent of the other, unless the pair
    is disabled.
    """
    shapes = list(geometry.geometryObjects)
    links = [str(model.frames[shape.parentFrame].name) for shape in shapes]
    parents = list(model.parents)
    pairs = []
    for i, j in itertools.combinations(range(len(shapes)), 2):
        a, b = sorted((shapes[i].parentJoint, shapes[j].parentJoint))
        adjacent = a == b or parents[b] == a
        if not adjacent and frozenset((links[i], links[j])) not in disabled:
            pairs.append((i, j))
    return pairs
