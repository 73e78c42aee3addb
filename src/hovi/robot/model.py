"""From a source to a Pinocchio model: build, set armature, lock and couple joints, check M(q)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError, nearest
from hovi.robot.mimic_model import Coupling, couplings_of, uncoupled
from hovi.robot.mimic_tags import held_values, leaders_first, read_couplings, with_mimics
from hovi.robot.source import RobotSource
from hovi.robot.tool import with_tools
from hovi.robot.urdf.normalize import plain_urdf

Array = npt.NDArray[np.float64]

_FRAME_KINDS = (pin.BODY, pin.OP_FRAME, pin.SENSOR, pin.JOINT, pin.FIXED_JOINT)
"""Kinds of frames, those whose name counts before others' first."""
POSITION_TOLERANCE = 1e-9
"""Distance by which a joint may be locked outside its range, in [rad] or [m]."""


def build_full_model(source: RobotSource) -> pin.Model:
    """The model of a source's URDF with all joints free: none coupled, none locked.

    Leaders of mimic joints come first, since Pinocchio couples them in no other order. Raises
    ModelError.
    """
    return _full_model(source).copy()


@lru_cache(maxsize=8)
def _full_model(source: RobotSource) -> pin.Model:
    """That model, which the shapes of a robot need again; not to be changed."""
    if source.urdf is None:
        raise ModelError(
            f"robot {source.reference!r} was given as a pinocchio.Model, which files do not store: "
            "load it again with hovi.load_robot(model)."
        )
    text = plain_urdf(source.urdf, source.reference)
    root = (pin.JointModelFreeFlyer(),) if source.free_flyer else ()
    try:
        model = pin.buildModelFromXML(text, *root)
    except (ValueError, RuntimeError) as error:
        raise ModelError(
            f"Pinocchio cannot read the URDF {source.reference!r}: {error}; "
            "its parser's own messages are on stderr."
        ) from error
    if len(set(model.names)) < len(model.names):
        raise ModelError(
            f"robot {source.reference!r} has a joint 'root_joint', the name of its floating base: "
            "rename that joint, or load the robot without free_flyer."
        )
    model = with_tools(_with_armature(model, source.armature), source.tools)
    return leaders_first(model, _moving(couplings_in(source), source.held))


def couplings_in(source: RobotSource) -> tuple[Coupling, ...]:
    """The couplings of a source's URDF; none unless `source.mimic`."""
    if not source.mimic:
        return ()
    return read_couplings(source.urdf or "", source.reference, source.locked)


def build_model(source: RobotSource) -> pin.Model:
    """The model of a source, without locked joints, mimic joints coupled. Raises ModelError."""
    model = build_full_model(source)
    return locked_and_coupled(model, None, source.held, couplings_in(source))[0]


def locked_and_coupled(
    model: pin.Model,
    geometry: list[pin.GeometryModel] | None,
    locked: Mapping[str, float],
    couplings: Sequence[Coupling] = (),
) -> tuple[pin.Model, list[pin.GeometryModel]]:
    """Model and geometry with some joints locked and the others coupled.

    locked: positions of the joints to fix, in [rad] or [m]; their followers are fixed, too.
    Raises ModelError for an unknown joint, or a position that it cannot have.
    """
    _check_positions(model, locked)
    shapes = list(geometry or [])
    held = held_values(couplings, locked)
    if held:
        ids, dq = joint_ids(model, held), np.zeros(model.nv)
        for index, value in zip(ids, held.values(), strict=True):
            if value:
                dq[model.joints[index].idx_v] = value
        q = pin.integrate(model, pin.neutral(model), dq)
        model, shapes = _reduced(model, shapes, ids, q)
    moving = _moving(couplings, locked)
    return with_mimics(model, moving) if moving else model, shapes


def _reduced(
    model: pin.Model, shapes: list[pin.GeometryModel], ids: list[int], q: Array
) -> tuple[pin.Model, list[pin.GeometryModel]]:
    """Model and geometry with joints fixed at q.

    Frames that share a name have others in between.
    """
    model, original = with_distinct_frames(model)
    if shapes:
        reduced, found = pin.buildReducedModel(model, shapes, ids, q)
        shapes = list(found)
    else:
        reduced = pin.buildReducedModel(model, ids, q)
    for frame in reduced.frames:
        frame.name = original.get(frame.name, frame.name)
    return reduced, shapes


def with_distinct_frames(model: pin.Model) -> tuple[pin.Model, dict[str, str]]:
    """A copy whose frames have different names, and the original names by those that are new.

    Pinocchio looks frames up by name alone and refuses a name that it finds twice, as where a URDF
    names a link and a joint alike. Frames of moving joints keep their names.
    """
    copy, names, original = model.copy(), set(model.names), dict[str, str]()
    for number, frame in enumerate(copy.frames):
        if frame.type != pin.JOINT and frame.name in names:
            name, frame.name = frame.name, f"{number} {frame.name}"
            original[frame.name] = name
        names.add(frame.name)
    return copy, original


def _check_positions(model: pin.Model, locked: Mapping[str, float]) -> None:
    for index, (name, at) in zip(joint_ids(model, locked), locked.items(), strict=True):
        joint = model.joints[index]
        if at and joint.nv != 1:
            raise ModelError(
                f"joint {name!r} has {joint.nv} degrees of freedom and can be locked at its "
                "neutral position only: give its name, or 0."
            )
        if not at or joint.nq != 1:
            continue
        lower, upper = (
            float(bound[joint.idx_q])
            for bound in (model.lowerPositionLimit, model.upperPositionLimit)
        )
        if lower < upper and not lower - POSITION_TOLERANCE <= at <= upper + POSITION_TOLERANCE:
            raise ModelError(
                f"joint {name!r} cannot be locked at {at:g}: its range is {lower:g} to {upper:g}."
            )


def locked_model(
    model: pin.Model, geometry: list[pin.GeometryModel], locked: Mapping[str, float]
) -> tuple[pin.Model, list[pin.GeometryModel]]:
    """As `locked_and_coupled`, for a model that has couplings of its own and keeps them."""
    couplings = couplings_of(model) if locked else ()
    if couplings:  # Pinocchio cannot remove a leader
        model = leaders_first(uncoupled(model), couplings)
    return locked_and_coupled(model, geometry, locked, couplings)


def _moving(couplings: Sequence[Coupling], locked: Mapping[str, float]) -> tuple[Coupling, ...]:
    """The couplings whose follower moves."""
    held = held_values(couplings, locked)
    return tuple(coupling for coupling in couplings if coupling.follower not in held)


def joint_ids(model: pin.Model, names: Iterable[str]) -> list[int]:
    """Pinocchio's indices of joints. Raises ModelError for an unknown name."""
    movable = list(model.names)[1:]
    for name in names:
        if name not in movable:
            raise ModelError(
                f"robot {model.name!r} has no joint {name!r}: {nearest(name, movable)}"
            )
    return [model.getJointId(name) for name in names]


def frame_ids(model: pin.Model) -> dict[str, int]:
    """Pinocchio's index of the frame that each name stands for.

    Pinocchio itself refuses a name that several frames have, such as a link and a joint of a URDF.
    Here it is the link's, else that of the first of `_FRAME_KINDS` with the name, and the first of
    these. `ambiguous_frames` names those that are elsewhere.
    """
    frames = sorted(enumerate(model.frames), key=lambda each: _FRAME_KINDS.index(each[1].type))
    found: dict[str, int] = {}
    for index, frame in frames:
        found.setdefault(str(frame.name), index)
    return found


def frame_id(model: pin.Model, name: str) -> int:
    """Pinocchio's index of a frame: see `frame_ids`. Raises ModelError for an unknown name."""
    found = frame_ids(model)
    if name not in found:
        raise ModelError(f"the robot has no frame {name!r}: {nearest(name, found)}")
    return found[name]


def frame_named(model: pin.Model, name: str) -> pin.Frame:
    """The frame that a name stands for: see `frame_ids`. Raises ModelError for an unknown name."""
    return model.frames[frame_id(model, name)]


def ambiguous_frames(model: pin.Model) -> tuple[str, ...]:
    """Names of frames that further frames at other places have too."""
    found = frame_ids(model)

    def elsewhere(frame: pin.Frame) -> bool:
        named = model.frames[found[str(frame.name)]]
        same = frame.parentJoint == named.parentJoint and frame.placement == named.placement
        return not same

    return tuple(dict.fromkeys(str(frame.name) for frame in model.frames if elsewhere(frame)))


def _with_armature(model: pin.Model, armature: Iterable[tuple[str, float]]) -> pin.Model:
    pairs = tuple(armature)
    values = np.array(model.armature, dtype=float)
    for joint, (_, value) in zip(joint_ids(model, [n for n, _ in pairs]), pairs, strict=True):
        values[model.joints[joint].idx_v] = value
    model.armature = values
    return model
