"""Whether a motion that was planned without self-collision collides with itself.

Meshes are their convex hulls, and robots without an SRDF have links whose hulls always overlap. So
what is reported is a pair of links that the motion brings into each other: apart at one time, and
overlapping at another.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.pair_distances import PairDistances
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs
from hovi.system.deadline import OutOfTimeError

SAMPLES = 129
"""Number of samples of a motion that are looked at."""
DEPTH = 1e-3
"""Overlap, in [m], from which a pair is reported: hulls are a little larger than links."""


def self_collision_sentence(motion: Trajectory, but: frozenset[str] = frozenset()) -> str:
    """The links that a motion brings into each other, as a sentence; "" if none are found.

    but: links that are not looked at.
    """
    robot = motion.robot
    if robot is None:
        return ""
    try:
        pairs, links = _pairs_of(robot)
        if not links:
            return ""
        t = np.linspace(0.0, motion.duration, SAMPLES)
        looked_at = np.array([k for k, pair in enumerate(links) if but.isdisjoint(pair)], dtype=int)
        d = np.full((SAMPLES, len(links)), np.inf)
        d[:, looked_at] = pairs.values(motion.configurations(t), looked_at, 0.0)
    except (HoviError, OutOfTimeError):  # no shapes, some are missing, or no time
        return ""
    deepest = np.where((d > 0).any(axis=0), d.min(axis=0), np.inf)
    k = int(np.argmin(deepest))
    if deepest[k] > -DEPTH:
        return ""
    first, second = links[k]
    return (
        "Self-collision was left out, and the motion brings links "
        f"{first!r} and {second!r} into each other, by {-deepest[k]:.2g} m at t = "
        f"{t[np.argmin(d[:, k])]:.3g} s: plan with self_collision = true."
    )


@lru_cache(maxsize=16)
def _pairs_of(robot: Robot) -> tuple[PairDistances, list[tuple[str, str]]]:
    """The distances of the pairs of shapes that the SRDF does not disable, and their links."""
    geometry = convex_geometry(robot).copy()
    found = checked_pairs(robot.model, geometry, robot.semantics.disabled)
    for i, j in found:
        geometry.addCollisionPair(pin.CollisionPair(i, j))
    shapes = list(geometry.geometryObjects)
    names = [str(robot.model.frames[shape.parentFrame].name) for shape in shapes]
    return PairDistances(robot, geometry), [(names[i], names[j]) for i, j in found]
