"""Configurations and rates from tables of joint names, as Python and scene files have them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.checks.kinds import NUMBERS, MismatchError, shown
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.groups import SO2
from hovi.robot.space.pinocchio_configurations import MAX_COORDINATE

Array = npt.NDArray[np.float64]


class JointError(InputError):
    """A table of joints is wrong at one of them: `joint`, or None for the whole table."""

    def __init__(self, sentence: str = "", joint: str | None = None) -> None:
        super().__init__(sentence)
        self.joint = joint

    def __reduce__(self) -> tuple[type[JointError], tuple[str, str | None]]:
        """Pickled with its joint."""
        return type(self), (str(self), self.joint)


def configuration_of(given: Any, coordinates: Coordinates, name: str) -> Any:
    """A configuration as it is, or that of a named pose or of a table of all joints, (nq,).

    In a table the angle of a continuous joint is one number, in [rad], or (cos, sin). Where these
    are the only joints with nq > nv, a list of nv numbers has their angles.
    name: of the configuration in messages, such as "start.q". Raises InputError.
    """
    if isinstance(given, str):
        return coordinates.pose(given)
    given = by_joint(given, coordinates)
    if not isinstance(given, Mapping):
        return given
    _require_joints(given, coordinates, name)
    left_out = [joint for joint in coordinates.joint_names if joint not in given]
    if left_out:
        raise JointError(f"`{name}` leaves out joint {left_out[0]!r}; it needs every joint.")
    q = np.empty(coordinates.nq)
    for joint, entries, is_angle in _entries(coordinates):
        size = entries.stop - entries.start
        numbers = _numbers(given[joint], size, f"{name}.{joint}", joint, is_angle)
        if is_angle and len(numbers) == 1:
            numbers = _pair(float(numbers[0]), f"{name}.{joint}", joint)
        q[entries] = numbers
    return q


def by_joint(given: Any, coordinates: Coordinates) -> Any:
    """A list of nv numbers, with angles of continuous joints, as a table of joints.

    What else is given as it is.
    """
    space = coordinates.space
    if isinstance(given, str | Mapping) or not space.angles or not space.flat:
        return given
    try:
        numbers = numbers_of("q", given)
    except InputError:  # what is wrong is said where the numbers are read
        return given
    parts = _entries(coordinates)
    if numbers.shape != (coordinates.nv,) or not _apart(parts, coordinates):
        return given
    return {joint: numbers[coordinates.entries_of(joint)].tolist() for joint, *_ in parts}


def angles_in(given: Any, coordinates: Coordinates) -> Array:
    """The angles that a configuration gives of continuous joints, NaN elsewhere, (nv,), in [rad].

    given: as `configuration_of` takes it, and accepted by it.
    """
    angles, table = np.full(coordinates.nv, np.nan), by_joint(given, coordinates)
    if isinstance(table, Mapping):
        for joint, _, is_angle in _entries(coordinates):
            numbers = np.atleast_1d(np.asarray(table[joint], dtype=np.float64))
            if is_angle and len(numbers) == 1:
                angles[coordinates.entries_of(joint)] = numbers
    return angles


def with_angles(q: Array, angles: Array, coordinates: Coordinates) -> Any:
    """A configuration (nq,) as a table of joints, in which continuous ones have these angles.

    angles: shape (nv,), in [rad]; NaN where q says all, and q as it is where that is everywhere.
    """
    table: dict[str, Any] = {}
    known = False
    for joint, entries, is_angle in _entries(coordinates):
        angle = float(angles[coordinates.entries_of(joint)][0])
        is_given = is_angle and math.isfinite(angle)
        numbers = [angle] if is_given else q[entries].tolist()
        table[joint] = numbers[0] if len(numbers) == 1 else numbers
        known |= is_given
    return table if known else q


def rates_of(given: Any, coordinates: Coordinates, name: str) -> Any:
    """A velocity or acceleration as it is, or that of a table of joints, (nv,).

    Of joints that are left out it is zero. name: of it in messages, such as "start.v". Raises
    InputError.
    """
    if not isinstance(given, Mapping):
        return given
    _require_joints(given, coordinates, name)
    v = np.zeros(coordinates.nv)
    for joint, value in given.items():
        part = coordinates.entries_of(joint)
        v[part] = _numbers(value, part.stop - part.start, f"{name}.{joint}", joint)
    return v


def _require_joints(given: Mapping[Any, Any], coordinates: Coordinates, name: str) -> None:
    for joint in given:
        if joint not in coordinates.joint_names:
            raise JointError(
                f"`{name}` names joint {joint!r}, which {coordinates.owner} does not have; "
                f"{coordinates.hint(str(joint))}",
                str(joint),
            )


def _entries(coordinates: Coordinates) -> list[tuple[str, slice, bool]]:
    """Each joint with its entries of q, and whether they are (cos, sin) of an angle."""
    index, plain = coordinates.space.plain
    at = dict(zip(plain.tolist(), index.tolist(), strict=True))
    groups = {factor.v.start: factor for factor in coordinates.space.factors}
    found = []
    for joint in coordinates.joint_names:
        part = coordinates.entries_of(joint)
        if part.start in groups:
            factor = groups[part.start]
            found.append((joint, factor.q, factor.group is SO2))
        else:
            first = at[part.start]
            found.append((joint, slice(first, first + part.stop - part.start), False))
    return found


def _apart(parts: list[tuple[str, slice, bool]], coordinates: Coordinates) -> bool:
    """Whether each continuous joint is a joint of its own, not one of a composite joint."""
    return sum(is_angle for *_, is_angle in parts) == len(coordinates.space.angles)


def _pair(angle: float, name: str, joint: str) -> Array:
    """(cos, sin) of an angle in [rad]. Raises JointError where no turn of it is resolved."""
    if not abs(angle) <= MAX_COORDINATE:
        raise JointError(f"`{name}` must be an angle up to {MAX_COORDINATE:g}, got {angle}.", joint)
    return np.array([math.cos(angle), math.sin(angle)])


def _numbers(value: Any, size: int, name: str, joint: str, is_angle: bool = False) -> Array:
    """The numbers of a joint: `size`, or one for an angle."""
    try:
        numbers = np.atleast_1d(NUMBERS.accept(value))
    except MismatchError:
        numbers = np.zeros((0, 0))
    sizes = (1, size) if is_angle else (size,)
    if numbers.ndim != 1 or len(numbers) not in sizes:
        expected = "one number" if size == 1 else f"{size} numbers"
        expected += ", or one for an angle" if is_angle and size > 1 else ""
        came = f"it has {len(numbers)}" if numbers.ndim == 1 else f"it is {shown(value)}"
        raise JointError(f"`{name}` must be {expected}, but {came}.", joint)
    return np.asarray(numbers)
