"""A summary of a robot as text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import some_of
from hovi.robot.file_findings import notes
from hovi.robot.mimic_model import couplings_of
from hovi.robot.mimic_tags import held_values
from hovi.robot.model import couplings_in
from hovi.robot.source import RobotSource
from hovi.robot.space.joint_kinds import FLOATING, kind_of

Array = npt.NDArray[np.float64]

_MOST_FRAMES = 12
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
    found = [f"  {line}" for line in notes(model, source)]
    if found:
        sections.append("\n".join(["Notes:", *found]))
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


def _joints_at(model: pin.Model, coordinates: npt.NDArray[np.intp]) -> str:
    pairs = [(j, n) for j, n in zip(model.joints[1:], model.names[1:], strict=True) if j.nv]
    held = [name for joint, name in pairs if np.any((coordinates - joint.idx_v) // joint.nv == 0)]
    return f"all {len(held)} joints" if len(held) == len(pairs) > 3 else some_of(held)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _number(value: float) -> str:
    return "none" if abs(value) >= 1e15 else f"{value:.5g}"
