"""When the segments of a motion begin and end, and what they are called."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from hovi.discrete.trajectory import Trajectory

SEGMENT_NAMES = "segment_names"
"""Key of the segments' names in the metadata of a motion."""


class MotionSegment(NamedTuple):
    """A segment of a motion.

    begin, end: in [s]. intervals: its own, of those of the motion.
    """

    name: str
    begin: float
    end: float
    intervals: slice


def with_segment_names(motion: Trajectory, of: Trajectory) -> Trajectory:
    """A motion with the names of another's last segments, which are its own."""
    names = of.metadata.get(SEGMENT_NAMES)
    if motion.segments is None or not isinstance(names, list):
        return motion
    own = names[-len(motion.segments.intervals) :]
    return dataclasses.replace(motion, metadata={**motion.metadata, SEGMENT_NAMES: own})


def motion_segments(trajectory: Trajectory) -> list[MotionSegment]:
    """The segments of a motion, in order of time; none for a motion in one scene.

    Names may come from a file: if they do not fit the segments they are numbered instead.
    """
    if trajectory.segments is None:
        return []
    nodes = np.cumsum([0, *trajectory.segments.intervals]).tolist()
    names = trajectory.metadata.get(SEGMENT_NAMES)
    fits = isinstance(names, list) and len(names) == len(nodes) - 1
    if not isinstance(names, list) or not fits or not all(isinstance(x, str) for x in names):
        names = [f"segment {number}" for number in range(1, len(nodes))]
    t = trajectory.t
    return [
        MotionSegment(name, float(t[a]), float(t[b]), slice(a, b))
        for name, a, b in zip(names, nodes[:-1], nodes[1:], strict=True)
    ]
