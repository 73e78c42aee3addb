"""An axis of poses of a frame in a box."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError
from hovi.study.axes.samplers import samples_in_box
from hovi.study.cells.axis import Axis, Rows, check_count
from hovi.study.cells.field_path import FieldPath

Array = npt.NDArray[np.float64]
ENDS = ("start", "goal")


def poses(
    fields: Sequence[FieldPath],
    frame: str,
    points: Array,
    orientation: Mapping[str, Any],
    by_kinematics: bool,
) -> Axis:
    """Targets of a frame, one at each point.

    fields: one, "start" or "goal". points: in the world, shape (M, 3), in [m].
    orientation: what else the target has: rpy, axis or a quaternion as in a scene file.
    by_kinematics: whether the target is replaced by the nearest configuration that reaches it, so
        that one motion is planned; else the plan compares those to several configurations.
    """
    if len(fields) != 1 or fields[0].text not in ENDS:
        raise SceneError('the study\'s poses need the field "goal" or "start".')

    def target(row: list[float]) -> tuple[Any, ...]:
        return ({"frame": frame, "position": row, **orientation},)

    ends = (fields[0].text,) if by_kinematics else ()
    return Axis(tuple(fields), Rows(points, target), True, ends)


def points_on_grid(lower: Sequence[float], upper: Sequence[float], counts: Sequence[int]) -> Array:
    """Points of a grid in a box, both ends included, shape (M, 3), z fastest, in [m].

    counts: along x, y and z. One point is in the middle.
    """
    check_count(int(np.prod([int(n) for n in counts], dtype=object)), 3, "the points of a grid")
    axes = [
        np.linspace(low, high, n) if n > 1 else np.array([(low + high) / 2])
        for low, high, n in zip(lower, upper, counts, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def points_in_box(
    sampler: str, lower: Sequence[float], upper: Sequence[float], count: int, seed: int
) -> Array:
    """Samples in a box, shape (count, 3), in [m]."""
    low, high = np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)
    return samples_in_box(sampler, low, high, count, seed)
