"""Whether two frames of one link can reach their goals at once.

What both goals say is a list of vectors, v of the link and w in the world: the axes of a rotation,
a direction, and the way from one origin to the other. There is a pose of the link if a rotation R
has R v = w for all of them, the best of which is Wahba's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.robot.model import frame_named
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

AGREEMENT = 1e-6
"""Largest |R v - w| of goals that agree, in [m] or [rad]."""


class Target(NamedTuple):
    """What a goal says of a frame: its position, its rotation or a direction, where it has them."""

    frame: str
    position: npt.ArrayLike | None
    rotation: npt.ArrayLike | None
    directions: tuple[Array, Array] | None


def require_agreement(robot: Robot, one: Target, other: Target) -> None:
    """Raise InputError for goals of two frames of one link that contradict each other."""
    first, second = (frame_named(robot.model, each.frame) for each in (one, other))
    if first.parentJoint != second.parentJoint:
        return
    placed = first.placement.inverse() * second.placement
    of_link = [*_directions(one, np.eye(3)), *_directions(other, placed.rotation)]
    if one.position is not None and other.position is not None:
        way = np.asarray(other.position, dtype=float) - np.asarray(one.position, dtype=float)
        of_link.append((placed.translation, way))
    if not of_link:
        return
    v, w = (np.stack(each, axis=1) for each in zip(*of_link, strict=True))
    gap = float(np.linalg.norm(_best_rotation(v, w) @ v - w, axis=0).max())
    if gap > AGREEMENT:
        raise InputError(
            f"the goals of frames {one.frame!r} and {other.frame!r}, which are of one link, "
            f"contradict each other by {gap:.3g} m or rad: change one of them, or leave it out."
        )


def _directions(goal: Target, R: Array) -> list[tuple[Array, Array]]:
    """The directions that a goal gives, in the axes of the link and in the world.

    R: of the goal's frame in the axes of the link.
    """
    if goal.rotation is not None:
        return list(zip(R.T, np.asarray(goal.rotation).T, strict=True))
    if goal.directions is not None:
        inner, world = goal.directions
        return [(R @ inner, world)]
    return []


def _best_rotation(v: Array, w: Array) -> Array:
    """The rotation with the least sum |R v - w|^2, from vectors (3, m)."""
    left, _, right = np.linalg.svd(w @ v.T)
    turned = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    return np.asarray(left @ turned @ right)
