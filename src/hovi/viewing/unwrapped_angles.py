"""Configurations along a motion as nv numbers for people: angles that go on past a full turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.groups import SE2, SE3, SO2, SO3

Array = npt.NDArray[np.float64]

_NOTHING = 1e-9


def unwrapped(space: ConfigurationSpace, q: Array) -> Array:
    """Configurations (M, nq) along a motion as numbers (M, nv) that do not jump.

    Plain coordinates as they are; angles of continuous and planar joints without jumps of a turn;
    positions in the parent's axes; orientations as rotation vectors from the parent's axes, of the
    branch that is nearest to the one before. In [rad] and [m].
    """
    numbers = np.zeros((len(q), space.nv))
    iq, iv = space.plain
    numbers[:, iv] = q[:, iq]
    for factor in space.factors:
        part, shown = q[:, factor.q], numbers[:, factor.v]
        if factor.group is SO2:
            shown[:, 0] = _angle(part)
        elif factor.group is SE2:
            shown[:, :2], shown[:, 2] = part[:, :2], _angle(part[:, 2:])
        elif factor.group is SE3:
            shown[:, :3], shown[:, 3:] = part[:, :3], _rotation_vector(part[:, 3:])
        else:
            shown[:] = _rotation_vector(part)
    return numbers


def shown_names(space: ConfigurationSpace, coordinates: Sequence[str]) -> tuple[str, ...]:
    """What to call the numbers of `unwrapped`, (nv,), from the names of the coordinates, (nv,).

    A base's are base[x] to base[z], and base[rx] to base[rz] of its rotation vector.
    """
    shown = list(coordinates)
    for factor in space.curved:
        joint = shown[factor.v.start].removesuffix("[0]")
        shown[factor.v] = [f"{joint}[{part}]" for part in factor.group.coordinates]
    return tuple(shown)


def _angle(pair: Array) -> Array:
    """Angles of (cos, sin) pairs (M, 2), without jumps."""
    return np.asarray(np.unwrap(np.arctan2(pair[:, 1], pair[:, 0])))


def _rotation_vector(quaternion: Array) -> Array:
    """Rotation vectors of unit quaternions (M, 4), each with the turns nearest to the last."""
    still = np.broadcast_to([0.0, 0.0, 0.0, 1.0], quaternion.shape)
    vectors = SO3.difference(still, quaternion)
    for i in range(1, len(vectors)):
        size, before = float(np.linalg.norm(vectors[i])), float(np.linalg.norm(vectors[i - 1]))
        if max(size, before) < _NOTHING:
            continue
        axis = vectors[i] / size if size > _NOTHING else vectors[i - 1] / before
        turns = np.round((vectors[i - 1] @ axis - size) / (2 * np.pi))
        vectors[i] += 2 * np.pi * turns * axis
    return vectors
