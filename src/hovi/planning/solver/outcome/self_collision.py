"""Whether a motion that was planned without self-collision collides with itself.

Meshes are their convex hulls, and robots without an SRDF have links whose hulls always overlap. So
what is told is a pair of links that the motion brings into each other: apart at one time, and
overlapping at another.
"""

from __future__ import annotations

import re
import time
from functools import lru_cache

import numpy as np
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.clearance.convex_shapes import convex_geometry, has_convex_geometry
from hovi.planning.clearance.pair_distances import PairDistances
from hovi.robot.geometry import find_mesh
from hovi.robot.robot import Robot
from hovi.robot.srdf import checked_pairs
from hovi.system.deadline import OutOfTimeError

SAMPLES = 129
"""Number of samples of a motion that are looked at."""
DEPTH = 1e-3
"""Overlap, in [m], from which a pair is told: hulls are a little larger than links."""
SHARE = 0.05
"""Largest share of the process's time so far that reading the robot's shapes may take."""
FIRST_SECONDS, BYTES_PER_SECOND = 0.04, 5e6
"""Time to read shapes, in [s]: of any robot, and the bytes of meshes that are read in a second."""


def self_collision_sentence(motion: Trajectory, within_share: bool = True) -> str:
    """The links that a motion brings into each other, as a sentence; "" if none are found.

    within_share: whether shapes that were not read before are read only where this takes at most
        SHARE of the time that the process has taken; otherwise they are read in any case.
    """
    robot = motion.robot
    if robot is None or (within_share and not _is_cheap(robot)):
        return ""
    try:
        pairs, links = _pairs_of(robot)
        if not links:
            return ""
        t = np.linspace(0.0, motion.duration, SAMPLES)
        d = pairs.values(motion.configurations(t), np.arange(len(links)), 0.0)
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


def _is_cheap(robot: Robot) -> bool:
    """Whether the robot's shapes are at hand, or read in SHARE of the time so far."""
    if has_convex_geometry(robot):
        return True
    return _seconds_to_read(robot) <= SHARE * time.process_time()


@lru_cache(maxsize=16)
def _seconds_to_read(robot: Robot) -> float:
    """The time that reading the collision shapes takes, estimated by the size of their files."""
    size = 0
    for shape in re.findall(r"<collision\b.*?</collision>", robot.source.urdf or "", re.DOTALL):
        for name in re.findall(r'filename="([^"]*)"', shape):
            try:
                size += find_mesh(name, robot.source).stat().st_size
            except (HoviError, OSError):  # reading it will say so
                continue
    return FIRST_SECONDS + size / BYTES_PER_SECOND
