"""Configurations of any Pinocchio model: group operations over batches, and input checks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.shapes import numbers_of, require_rows
from hovi.errors import InputError

Array = npt.NDArray[np.float64]

MAX_COORDINATE = 1e9
"""Largest coordinate, in [rad] or [m], so that squared torques do not overflow."""

UNIT_TOLERANCE = 1e-6
"""Largest deviation of a quaternion or (cos, sin) pair from unit norm."""


def integrate(model: pin.Model, q: Array, dq: Array) -> Array:
    """q (+) dq for configurations (..., nq) and tangent vectors (..., nv) -> (..., nq)."""
    return _over_batch(lambda x, y: pin.integrate(model, x, y), q, dq, model.nq)


def difference(model: pin.Model, q0: Array, q1: Array) -> Array:
    """q1 (-) q0 for configurations (..., nq) -> tangent vectors (..., nv)."""
    return _over_batch(lambda x, y: pin.difference(model, x, y), q0, q1, model.nv)


def frame_positions(model: pin.Model, frames: Sequence[int], q: Array) -> Array:
    """Origins of F frames in the world, in [m]: q (..., nq) -> (..., F, 3).

    Raises InputError for another shape.
    """
    q = np.asarray(q, dtype=float)
    require_rows((("q", q, model.nq),))
    data, rows = model.createData(), q.reshape(int(np.prod(q.shape[:-1])), model.nq)
    positions = np.empty((len(rows), len(frames), 3))
    for places, one in zip(positions, rows, strict=True):
        pin.forwardKinematics(model, data, one)
        for place, frame in zip(places, frames, strict=True):
            place[:] = pin.updateFramePlacement(model, data, frame).translation
    return positions.reshape(*q.shape[:-1], len(frames), 3)


def frame_poses(model: pin.Model, frame: int, q: Array) -> Array:
    """Homogeneous matrices of a frame in the world: q (..., nq) -> (..., 4, 4).

    Raises InputError for another shape.
    """
    require_rows((("q", q, model.nq),))
    data, rows = model.createData(), q.reshape(int(np.prod(q.shape[:-1])), model.nq)
    poses = np.empty((len(rows), 4, 4))
    for pose, one in zip(poses, rows, strict=True):
        pin.forwardKinematics(model, data, one)
        pose[:] = pin.updateFramePlacement(model, data, frame).homogeneous
    return poses.reshape(*q.shape[:-1], 4, 4)


def check_vector(value: npt.ArrayLike, name: str, entries: Sequence[str], hint: str = "") -> Array:
    """`value` as a finite float array with one number per name in `entries`.

    name: of the argument, for the message. hint: end of the message about a wrong length.
    Raises InputError.
    """
    try:
        vector = numbers_of(name, value).copy()
    except InputError:
        raise InputError(f"{name} must be {len(entries)} numbers, not {value!r}.") from None
    if vector.shape != (len(entries),):
        raise InputError(
            f"{name} has shape {vector.shape}, expected ({len(entries)},): "
            f"one number each for {', '.join(entries)}{hint}."
        )
    for number, entry in zip(vector, entries, strict=True):
        if not np.isfinite(number):
            raise InputError(f"{name} is {number} at joint {entry!r}: give a finite number.")
        if abs(number) > MAX_COORDINATE:
            raise InputError(
                f"{name} is {number} at joint {entry!r}: at most {MAX_COORDINATE:g} in magnitude."
            )
    return vector


def check_unit_norms(model: pin.Model, q: Array, name: str) -> None:
    """Raise InputError for the first joint whose quaternion or (cos, sin) is not of unit norm."""
    for joint, joint_name in zip(model.joints[1:], model.names[1:], strict=True):
        part = slice(joint.idx_q, joint.idx_q + joint.nq)
        alone = pin.neutral(model)
        alone[part] = q[part]
        if not pin.isNormalized(model, alone, UNIT_TOLERANCE):
            raise InputError(
                f"{name} is {q[part].tolist()} at joint {joint_name!r}, which is not of unit norm: "
                f"a joint with nq={joint.nq}, nv={joint.nv} holds a unit quaternion (x, y, z, w) "
                "or (cos, sin) of its angle; normalize it."
            )


_CONTENTS = {
    (2, 1): "(cos, sin) of its angle",
    (4, 3): "a unit quaternion (x, y, z, w), or x, y, cos, sin on a plane",
    (7, 6): "a position and a unit quaternion (x, y, z, w)",
}


def manifold_hint(model: pin.Model) -> str:
    """The coordinates of joints with nq != nv, as the end of a message; "" if there are none."""
    kinds: dict[tuple[int, int], list[str]] = {}
    for joint, name in zip(model.joints[1:], model.names[1:], strict=True):
        if joint.nq != joint.nv:
            kinds.setdefault((joint.nq, joint.nv), []).append(str(name))
    parts = []
    for (nq, nv), names in kinds.items():
        held = _CONTENTS.get((nq, nv), f"{nq} numbers for {nv} degrees of freedom")
        parts.append(f"{', '.join(names)} {'takes' if len(names) == 1 else 'take'} {nq}: {held}")
    if kinds.keys() == {(2, 1)}:
        parts.append(f"or one number for each joint, {model.nv} in all, with its angle")
    return f"; {'; '.join(parts)}" if parts else ""


def entry_names(model: pin.Model, size: str) -> tuple[str, ...]:
    """One name per entry of q (size "nq") or v (size "nv"): joint, or joint[i] if several."""
    names = []
    for joint, name in zip(model.joints[1:], model.names[1:], strict=True):
        count = getattr(joint, size)
        names += [name] if count == 1 else [f"{name}[{i}]" for i in range(count)]
    return tuple(names)


def _over_batch(function: Callable[[Array, Array], Array], x: Array, y: Array, size: int) -> Array:
    """Apply a function of two vectors over all leading axes, broadcast against each other."""
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    lead = np.broadcast_shapes(x.shape[:-1], y.shape[:-1])
    rows_x = np.broadcast_to(x, (*lead, x.shape[-1])).reshape(-1, x.shape[-1])
    rows_y = np.broadcast_to(y, (*lead, y.shape[-1])).reshape(-1, y.shape[-1])
    result = np.empty((len(rows_x), size))
    for row, one, other in zip(result, rows_x, rows_y, strict=True):
        row[:] = function(one, other)
    return result.reshape(*lead, size)
