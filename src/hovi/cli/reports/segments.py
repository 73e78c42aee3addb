"""The segments of a sequence in the report of its plan, as text and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hovi.discrete.measures.motion_segments import MotionSegment, motion_segments
from hovi.planning.solver.outcome.limit_margins import LimitMargins
from hovi.planning.solver.solver import Solution


def segment_lines(solution: Solution, margins: Mapping[str, LimitMargins]) -> list[tuple[str, str]]:
    """Labels and text: when each segment begins and ends, what it costs, its tightest limit.

    margins: to the limits of each segment, by its name.
    """
    return [
        (
            "segment",
            f"{span_text(segment)}, cost {cost:.6g}{_tightest(margins.get(segment.name))}",
        )
        for segment, cost in _costs(solution)
    ]


def span_text(segment: MotionSegment) -> str:
    """The name of a segment, and when it begins and ends."""
    return f"{segment.name!r} from {segment.begin:.6g} to {segment.end:.6g} s"


def _tightest(margins: LimitMargins | None) -> str:
    """The smallest margin of a segment as the end of its line; "" without limits."""
    if margins is None or not margins.limits.bounded.any():
        return ""
    return f", {margins}"


def segments_json(solution: Solution, margins: Mapping[str, LimitMargins]) -> dict[str, Any]:
    """`segments`: name, begin, end, cost and margins of each; nothing for a motion in one scene.

    margins: to the limits of each segment, by its name.
    """
    rows: list[dict[str, Any]] = []
    for segment, cost in _costs(solution):
        row = {"name": segment.name, "begin": segment.begin, "end": segment.end, "cost": cost}
        own = margins.get(segment.name)
        rows.append(row | {"limits": None if own is None else own.by_kind()})
    return {"segments": rows} if rows else {}


def _costs(solution: Solution) -> list[tuple[MotionSegment, float]]:
    """The segments with their costs, which sum to that of the motion."""
    segments = motion_segments(solution.trajectory)
    if not segments or solution.problem is None:
        return []
    values = solution.problem.ld.values(solution.trajectory.path)
    return [(segment, float(np.sum(values[segment.intervals]))) for segment in segments]
