"""Parameters of an effect with a value per joint: one for all, a list, or a table by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
JointValues = float | tuple[float, ...] | Mapping[str, float]
"""One number for all coordinates, a list of nv, or a table by joint with default zero."""


def joint_values(robot: Robot, what: str, given: JointValues, least: float = -np.inf) -> Array:
    """One number per velocity coordinate, shape (nv,).

    what: the effect and its key, the start of messages. least: the smallest valid number.
    Raises SceneError for unknown joints, wrong lengths, and numbers not finite or too small.
    """
    names = robot.coordinate_names
    values = np.zeros(robot.nv)
    if isinstance(given, Mapping):
        for joint, value in given.items():
            values[_coordinates(robot, what, joint)] = value
    elif isinstance(given, Sequence) and len(given) != robot.nv:
        raise SceneError(
            f"{what} needs one number per joint coordinate, {robot.nv} of them, got {len(given)}."
        )
    else:
        values[:] = given
    for name, value in zip(names, values, strict=True):
        if not (np.isfinite(value) and value >= least):
            bound = "finite" if least == -np.inf else f"finite and {least:g} or more"
            raise SceneError(f"{what} of joint {name!r} must be {bound}, got {value:g}.")
    return values


def of_urdf(robot: Robot, effect: str, quantity: str, values: Array) -> Array:
    """The given values of the URDF. Raises SceneError if all are zero.

    quantity: name of the property.
    """
    if not values.any():
        raise SceneError(
            f"effect {effect!r}: from_urdf = true, but the URDF of robot {robot.name!r} states no "
            f"{quantity}; give the numbers here."
        )
    return values


def require_one_source(effect: str, key: str, given: object, from_urdf: bool) -> None:
    """Raise SceneError unless exactly one of the value and `from_urdf` is given."""
    if (given is None) != from_urdf:
        count = "both were" if from_urdf else "neither was"
        raise SceneError(
            f"effect {effect!r} needs either {key} or from_urdf = true; {count} given."
        )


def in_words(given: JointValues | None, unit: str) -> str:
    """The numbers with their unit, for the description of a scene."""
    if given is None:
        return "as the URDF states"
    if isinstance(given, Mapping):
        return ", ".join(f"{joint} {value:g}" for joint, value in given.items()) + f" {unit}"
    if isinstance(given, tuple):
        return ", ".join(f"{value:g}" for value in given) + f" {unit}"
    return f"{given:g} {unit} at every joint"


def _coordinates(robot: Robot, what: str, joint: str) -> list[int]:
    """Indices in v of a joint, or of one of its coordinates."""
    names = robot.coordinate_names
    if joint in names:
        return [names.index(joint)]
    if joint in robot.joint_names:
        member = robot.model.joints[robot.model.getJointId(joint)]
        return list(range(member.idx_v, member.idx_v + member.nv))
    raise SceneError(f"{what}: robot {robot.name!r} has no joint {joint!r}: {robot.hint(joint)}")
