"""A summary of a robot as text."""

from __future__ import annotations

import textwrap
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.mass_matrix import light_joints
from hovi.robot.mimic_model import couplings_of
from hovi.robot.mimic_tags import held_values
from hovi.robot.model import ambiguous_frames, couplings_in, frame_named
from hovi.robot.source import RobotSource
from hovi.robot.space.angle_ranges import ranges_in_degrees
from hovi.robot.space.joint_kinds import ANGLE, FLOATING, kind_of
from hovi.robot.space.unit_hints import unit_hints
from hovi.robot.urdf.check import noted_urdf
from hovi.robot.urdf.closed_loops import closed_loops
from hovi.robot.urdf.spelling import ignored_names

Array = npt.NDArray[np.float64]

_MOST_FRAMES = 12
_FRAME_WORDS = {pin.BODY: "link", pin.OP_FRAME: "frame", pin.SENSOR: "sensor"}
_WIDTH = 79
_ROW = "  {:<{width}}  {:<11}{:>10}{:>10}{:>11}{:>10}"


def describe(name: str, model: pin.Model, source: RobotSource, tips: Sequence[str]) -> str:
    """The text of `hovi info`: joints, limits, mass, and notes on the URDF."""
    sections = [
        _headline(name, model, source),
        "\n".join(_joint_table(model, _held_followers(source))),
        _place(model, source, tips),
    ]
    parts = [f"  {line}" for line in _opt_in_parts(model)]
    if parts:
        sections.append("\n".join(["Simulated only if the scene has the effect:", *parts]))
    notes = [f"  {line}" for line in _notes(model, source)]
    if notes:
        sections.append("\n".join(["Notes:", *notes]))
    return "\n\n".join(sections)


def _headline(name: str, model: pin.Model, source: RobotSource) -> str:
    mass = sum(inertia.mass for inertia in model.inertias[1:])
    origin = {
        "urdf": f"URDF {source.reference}",
        "example": f"example-robot-data {source.reference!r}",
        "model": "a pinocchio.Model",
    }[source.kind]
    return (
        f"{name}: {_count(model.njoints - 1, 'joint')}, nq = {model.nq}, nv = {model.nv}, "
        f"{mass:.6g} kg of moving mass, from {origin}"
    )


def _held_followers(source: RobotSource) -> dict[str, float]:
    """Followers of fixed joints, which are fixed, too."""
    held = held_values(couplings_in(source), source.held)
    return {name: value for name, value in held.items() if name not in source.locked}


def _joint_table(model: pin.Model, held: Mapping[str, float]) -> Iterator[str]:
    names = list(model.names)[1:]
    width = max((len(name) for name in (*names, *held)), default=5)
    yield _ROW.format("joint", "type", "lower", "upper", "velocity", "effort", width=width)
    yield _ROW.format("", "", "[rad, m]", "[rad, m]", "[/s]", "[N m, N]", width=width)
    couplings = {coupling.follower: coupling for coupling in couplings_of(model)}
    for joint, name in zip(model.joints[1:], names, strict=True):
        if name in couplings:
            yield f"  {name:<{width}}  {'mimic':<11}  = {couplings[name].text()}"
            continue
        limits = ("-", "-")
        if joint.nq == joint.nv == 1:
            limits = (
                _number(model.lowerPositionLimit[joint.idx_q]),
                _number(model.upperPositionLimit[joint.idx_q]),
            )
        speed = _number(max(model.velocityLimit[joint.idx_v : joint.idx_v + joint.nv]))
        effort = _number(max(model.effortLimit[joint.idx_v : joint.idx_v + joint.nv]))
        yield _ROW.format(name, kind_of(joint).label, *limits, speed, effort, width=width)
    for name, value in held.items():
        yield f"  {name:<{width}}  {'mimic':<11}  = {value:g}"


def _place(model: pin.Model, source: RobotSource, tips: Sequence[str]) -> str:
    base = "floating" if source.free_flyer else "fixed"
    if source.kind == "model":
        floats = model.njoints > 1 and kind_of(model.joints[1]) is FLOATING
        base = FLOATING.label if floats else "fixed"
    joints = [f"{name} at {at:g}" if at else name for name, at in source.held.items()]
    locked = f"; locked: {', '.join(joints)}" if joints else ""
    ends = f"Tip frame{'' if len(tips) == 1 else 's'}: {', '.join(tips)}"
    return f"Base: {base}{locked}. {ends}.\n{_frames(model)}"


def _frames(model: pin.Model) -> str:
    """The links that goals may name, from the tips to the base; frames of joints are left out."""
    joints = pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT
    frames = reversed(list(model.frames)[1:])
    names = [frame.name for frame in frames if frame.type not in joints]
    rest = len(names) - _MOST_FRAMES
    more = f", and {rest} more in robot.frame_names" if rest > 0 else ""
    listed = ", ".join(names[:_MOST_FRAMES]) or "none"
    return textwrap.fill(f"Frames: {listed}{more}.", _WIDTH, subsequent_indent="  ")


def _opt_in_parts(model: pin.Model) -> Iterator[str]:
    kinds = (
        ("damping", model.damping, "N m s/rad or N s/m"),
        ("dry friction", model.friction, "N m or N"),
        ("armature (reflected rotor inertia)", model.armature, "kg m^2 or kg"),
        ("rotor inertia", model.rotorInertia, "kg m^2"),
    )
    for what, values, unit in kinds:
        where = np.flatnonzero(values)
        if len(where):
            largest = np.max(np.abs(values))
            yield f"{what}: {_joints_at(model, where)}, up to {largest:.4g} {unit}"


def _notes(model: pin.Model, source: RobotSource) -> Iterator[str]:
    pairs = list(zip(model.joints[1:], model.names[1:], strict=True))
    manifold = [name for joint, name in pairs if joint.nq != joint.nv]
    if manifold:
        yield (
            f"nq and nv differ at {_some(manifold)}: a continuous joint takes (cos, sin) of its "
            "angle, an orientation a unit quaternion (x, y, z, w)"
        )
    yield from _suspicious_ranges(pairs, model)
    yield from unit_hints(model)
    for name in ambiguous_frames(model):
        taken = _FRAME_WORDS.get(frame_named(model, name).type, "joint")
        yield (
            f"several frames are named {name!r}: the name stands for the {taken}, and not for "
            "those elsewhere"
        )
    for what, limit in (("velocity", model.velocityLimit), ("effort", model.effortLimit)):
        zero = np.flatnonzero(np.asarray(limit) == 0.0)
        if len(zero):
            yield f"the {what} limit is 0 at {_joints_at(model, zero)}"
    light = [f"{name} ({inertia:.2g} kg m^2)" for name, inertia in light_joints(model).items()]
    if light:
        yield (
            f"little inertia about {_some(light)}: without limits or the effects "
            "armature and acceleration_cost a least-torque motion may whirl there"
        )
    yield from source.notes
    if source.urdf is None:
        return
    robot, harmless = noted_urdf(source.urdf, source.reference)
    for note, names in harmless.items():
        yield f"{_some(list(dict.fromkeys(names)))}: {note}"
    movable = {name for _, name in pairs}
    mimics = [j.get("name", "") for j in robot.iterfind("joint") if j.find("mimic") is not None]
    mimics = [name for name in mimics if name in movable]
    if mimics and not source.mimic:
        yield f"{_some(mimics)}: <mimic> is ignored without mimic=True; the joint moves freely"
    if source.mimic and not couplings_in(source):
        yield "no joint mimics another: mimic=True has no effect"
    unbounded = [name for name in _ranges_not_kept(model, robot) if source.mimic]
    if unbounded:
        yield (
            f"the position range of {_some(unbounded)} is not enforced, since its leader is a "
            "continuous joint"
        )
    if empty := [name for name in _without_range(robot) if name in movable]:
        yield (
            f"no range of positions at {_some(empty)} (lower = upper): lock such joints, make them "
            "continuous, or give their ranges as limits"
        )
    if controllers := [
        joint.get("name", "")
        for joint in robot.iterfind("joint")
        if joint.find("safety_controller") is not None and joint.get("name") in movable
    ]:
        yield f'safety controllers at {_some(controllers)}: limits = "soft" has their ranges'
    if ties := closed_loops(robot):
        yield f"not kept, so that its links move freely: {_some(ties)}"
    if names := ignored_names(robot):
        yield f"ignored, since URDF has no such elements and attributes: {_some(names)}"
    moving = _moving_links(source, robot)
    bare = [link.get("name", "") for link in moving if link.find("inertial") is None]
    if bare:
        yield f"{_some(bare)}: moving without <inertial>, so without mass and inertia"
    odd = [link.get("name", "") for link in robot.iterfind("link") if _breaks_triangle(link)]
    if odd:
        yield f"the principal inertias of {_some(odd)} violate the triangle inequality"


def _moving_links(source: RobotSource, robot: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """Links moved by a joint of their own, and others that move and have shapes.

    A link without shapes on a fixed joint is a frame.
    """
    joints = {_end(joint, "child"): joint for joint in robot.iterfind("joint")}
    moves: dict[str, bool] = {}
    for link in robot.iterfind("link"):
        chain = [link.get("name", "")]
        while chain[-1] in joints and chain[-1] not in moves:
            chain.append(_end(joints[chain[-1]], "parent"))
        moving = moves.get(chain[-1], source.free_flyer)
        for name in reversed(chain):
            moving = moves[name] = moving or _is_movable(joints.get(name), source)
        has_shapes = not {"visual", "collision"}.isdisjoint(part.tag for part in link)
        if _is_movable(joints.get(chain[0]), source) or (moving and has_shapes):
            yield link


def _is_movable(joint: ElementTree.Element | None, source: RobotSource) -> bool:
    if joint is None:
        return False
    return joint.get("type") != "fixed" and joint.get("name") not in source.locked


def _end(joint: ElementTree.Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _suspicious_ranges(
    pairs: Sequence[tuple[pin.JointModel, str]], model: pin.Model
) -> Iterator[str]:
    """A note on ranges of angles that look like degrees."""
    single = [(joint, name) for joint, name in pairs if joint.nq == joint.nv == 1]
    index = [joint.idx_q for joint, _ in single]
    angles = np.array([kind_of(joint).units == (ANGLE,) for joint, _ in single], dtype=bool)
    lower, upper = (
        np.array(bound)[index] for bound in (model.lowerPositionLimit, model.upperPositionLimit)
    )
    note = ranges_in_degrees([name for _, name in single], angles, lower, upper)
    if note:
        yield note


def _ranges_not_kept(model: pin.Model, robot: ElementTree.Element) -> Iterator[str]:
    """Followers with a position range whose leader is a continuous joint."""
    for coupling in couplings_of(model):
        joint = robot.find(f"joint[@name='{coupling.follower}']")
        continuous = model.joints[model.getJointId(coupling.leader)].nq == 2
        if continuous and joint is not None and joint.get("type") == "revolute":
            yield coupling.follower


def _without_range(robot: ElementTree.Element) -> Iterator[str]:
    """Joints with a range whose bounds are equal, or missing."""
    for joint in robot.iterfind("joint"):
        limit = joint.find("limit")
        if joint.get("type") not in ("revolute", "prismatic") or limit is None:
            continue
        if float(limit.get("lower", "0")) == float(limit.get("upper", "0")):
            yield joint.get("name", "")


def _breaks_triangle(link: ElementTree.Element) -> bool:
    """Whether one principal inertia exceeds the sum of the two others by more than 1 %."""
    inertia = link.find("inertial/inertia")
    if inertia is None:
        return False
    keys = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
    tensor = [[float(inertia.get(key, "0")) for key in row] for row in keys]
    low, middle, high = np.linalg.eigvalsh(tensor)
    return bool(high > 1.01 * (low + middle) + 1e-9)


def _joints_at(model: pin.Model, coordinates: npt.NDArray[np.intp]) -> str:
    pairs = [(j, n) for j, n in zip(model.joints[1:], model.names[1:], strict=True) if j.nv]
    held = [name for joint, name in pairs if np.any((coordinates - joint.idx_v) // joint.nv == 0)]
    return f"all {len(held)} joints" if len(held) == len(pairs) > 3 else _some(held)


def _some(names: list[str]) -> str:
    more = f" and {len(names) - 4} more" if len(names) > 4 else ""
    return ", ".join(names[:4]) + more


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _number(value: float) -> str:
    return "none" if abs(value) >= 1e15 else f"{value:.5g}"
