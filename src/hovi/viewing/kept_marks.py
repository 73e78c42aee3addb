"""What a motion keeps, as marks on a page: lines and outlines of planes, as points along them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.frame_rows import across
from hovi.conditions.kept.keep import Keep
from hovi.conditions.kept.kinds import recorded
from hovi.conditions.kept.on_line import OnLine
from hovi.conditions.kept.on_plane import OnPlane
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

SAMPLES = 200
"""Instants at which a frame is looked for along a line or in a plane."""
BEYOND = 0.15
"""Part of its length by which a line is drawn beyond both ends of the motion on it."""


def kept_marks(trajectory: Trajectory, robot: Robot, spacing: float) -> Array:
    """Points of the lines and planes that a motion's metadata say it keeps, shape (M, 3), in [m].

    spacing: of the points, in [m]. Metadata may come from a file: what is invalid is left out.
    """
    found = [np.zeros((0, 3))]
    for each in recorded(trajectory.metadata):
        try:
            path = _path(trajectory, robot, each)
            found += [_between(a, b, spacing) for a, b in _edges(each, path)]
        except HoviError:
            continue
    return np.concatenate(found)


def _path(trajectory: Trajectory, robot: Robot, kept: Any) -> Array:
    """Where the frame is while something is kept, (SAMPLES, 3)."""
    begin, end = kept.during or (0.0, trajectory.duration)
    t = np.linspace(max(begin, 0.0), min(end, trajectory.duration), SAMPLES)
    frame = getattr(kept, "frame", robot.tip_frame)
    return np.asarray(robot.frame_positions([frame], trajectory.configurations(t))[:, 0])


def _edges(kept: Keep, path: Array) -> Iterator[tuple[Array, Array]]:
    """Both ends of the edges of a mark around the path of a frame."""
    if isinstance(kept, OnLine) and kept.direction is not None and kept.point is not None:
        d = np.asarray(kept.direction, dtype=float)
        d, p = d / np.linalg.norm(d), np.asarray(kept.point, dtype=float)
        begin, end = _range((path - p) @ d)
        yield p + begin * d, p + end * d
    if isinstance(kept, OnPlane) and kept.point is not None:
        normal = np.asarray(kept.normal, dtype=float)
        one, other = across(normal / np.linalg.norm(normal))
        p = np.asarray(kept.point, dtype=float)
        (x0, x1), (y0, y1) = _range((path - p) @ one), _range((path - p) @ other)
        ends = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
        corners = [p + x * one + y * other for x, y in ends]
        yield from zip(corners, [*corners[1:], corners[0]], strict=True)


def _range(along: Array) -> tuple[float, float]:
    """The least and the largest of coordinates, and somewhat beyond."""
    low, high = float(along.min()), float(along.max())
    more = BEYOND * max(high - low, 0.1)
    return low - more, high + more


def _between(first: Array, last: Array, spacing: float) -> Array:
    count = 2 + int(np.linalg.norm(last - first) / spacing)
    return first + np.linspace(0.0, 1.0, count)[:, None] * (last - first)
