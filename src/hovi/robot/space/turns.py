"""Full turns of continuous joints: angles of any size, of which (cos, sin) is the remainder.

angle = atan2(sin, cos) + 2 pi turns, in [rad], with atan2 in (-pi, pi].
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.robot.space.configuration_space import ConfigurationSpace

Array = npt.NDArray[np.float64]


def remainder(q: Array, space: ConfigurationSpace) -> Array:
    """Angles of continuous joints in (-pi, pi], at their indices in v, 0 elsewhere: (..., nv)."""
    angles = np.zeros((*q.shape[:-1], space.nv))
    for factor in space.angles:
        cos, sin = np.moveaxis(q[..., factor.q], -1, 0)
        angles[..., factor.v.start] = np.arctan2(sin, cos)
    return angles


def nearest_angles(q: Array, near: Array, space: ConfigurationSpace) -> Array:
    """The angles of configurations, with the turns that bring them closest to others, (..., nv)."""
    angles = remainder(q, space)
    return np.asarray(angles + 2 * np.pi * np.round((near - angles) / (2 * np.pi)))


def known_or(angles: Array, others: Array) -> Array:
    """The angles, and where they are NaN the others."""
    return np.asarray(np.where(np.isnan(angles), others, angles))


def turns_of(angles: Array) -> Array:
    """Full turns beyond the remainder in (-pi, pi], (...): 1 of 9.28 rad, which is 3 rad + 2 pi.

    0 of NaN, of which nothing is known.
    """
    rest = np.arctan2(np.sin(angles), np.cos(angles))
    return np.asarray(np.nan_to_num(np.round((angles - rest) / (2 * np.pi))))
