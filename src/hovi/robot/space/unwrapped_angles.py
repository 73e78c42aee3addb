"""Configurations along a motion as nv continuous numbers: angles beyond a full turn included."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.groups import SE2, SE3, SO2, SO3

Array = npt.NDArray[np.float64]

_ZERO_ROTATION = 1e-9  # [rad], below which a rotation has no axis


def unwrapped(space: ConfigurationSpace, q: Array) -> Array:
    """Configurations (M, nq) along a motion as continuous numbers (M, nv), in [rad] and [m].

    Coordinates in R are unchanged; angles of continuous and planar joints are unwrapped; positions
    are in the parent's axes; orientations are rotation vectors from the parent's axes, on the
    branch nearest to the previous one.
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
    """Names of the numbers of `unwrapped`, (nv,), from the names of the coordinates, (nv,).

    Those of a base are base[x] to base[z], and base[rx] to base[rz] of its rotation vector.
    """
    shown = list(coordinates)
    for factor in space.curved:
        joint = shown[factor.v.start].removesuffix("[0]")
        shown[factor.v] = [f"{joint}[{part}]" for part in factor.group.coordinates]
    return tuple(shown)


def _angle(pair: Array) -> Array:
    """Unwrapped angles of (cos, sin) pairs (M, 2), in [rad]."""
    return np.asarray(np.unwrap(np.arctan2(pair[:, 1], pair[:, 0])))


def _rotation_vector(quaternion: Array) -> Array:
    """Rotation vectors of unit quaternions (M, 4), on the branch nearest to the previous one."""
    identity = np.broadcast_to([0.0, 0.0, 0.0, 1.0], quaternion.shape)
    vectors = SO3.difference(identity, quaternion)
    for i in range(1, len(vectors)):
        size, previous = float(np.linalg.norm(vectors[i])), float(np.linalg.norm(vectors[i - 1]))
        if max(size, previous) < _ZERO_ROTATION:
            continue
        axis = vectors[i] / size if size > _ZERO_ROTATION else vectors[i - 1] / previous
        turns = np.round((vectors[i - 1] @ axis - size) / (2 * np.pi))
        vectors[i] += 2 * np.pi * turns * axis
    return vectors
