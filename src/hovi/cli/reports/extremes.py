"""The largest acceleration and jerk of a motion, and both at its ends, as text and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.measures.motion_extremes import Extreme, Extremes

Array = npt.NDArray[np.float64]


def extremes_json(extremes: Extremes) -> dict[str, Any]:
    """`acceleration` and `jerk`: the largest of all, the largest of each joint, and the ends."""
    return {
        "acceleration": _json(extremes.acceleration),
        "jerk": _json(extremes.jerk),
    }


def _json(extreme: Extreme) -> dict[str, Any]:
    by_joint = {
        "joints": extreme.largest,
        "start": extreme.start,
        "end": extreme.end,
    }
    return {
        "largest": extreme.value,
        "unit": extreme.unit,
        "joint": extreme.joint,
        "t": extreme.t,
        **{key: dict(zip(extreme.names, x.tolist(), strict=True)) for key, x in by_joint.items()},
    }


def extremes_lines(extremes: Extremes, verbose: bool) -> list[tuple[str, str]]:
    """Labels and their text. verbose: whether to add the values at the ends."""
    a, jerk = extremes.acceleration, extremes.jerk
    if not verbose:
        return [("accel.", f"at most {_largest(a)}; jerk at most {_largest(jerk)}")]
    return [("accel.", _text(a)), ("jerk", _text(jerk))]


def _largest(extreme: Extreme) -> str:
    return f"{extreme.value:.4g} {extreme.unit} ({extreme.joint}, t = {extreme.t:.4g} s)"


def _text(extreme: Extreme) -> str:
    ends = f"{_end(extreme, extreme.start)} at the start, {_end(extreme, extreme.end)} at the end"
    return f"at most {_largest(extreme)}; up to {ends}"


def _end(extreme: Extreme, values: Array) -> str:
    """The largest |x| at one end, with its joint."""
    joint = int(np.argmax(np.abs(values)))
    size = abs(float(values[joint]))
    return f"{size:.4g}" if size == 0.0 else f"{size:.4g} ({extreme.names[joint]})"
