"""The segments of a sequence in the report of its plan, as text and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.discrete.measures.segment_spans import SegmentSpan, segment_spans
from hovi.planning.solver.solver import Solution


def segment_lines(solution: Solution) -> list[tuple[str, str]]:
    """Labels and text: when each segment begins and ends, and what it costs."""
    return [
        (
            "segment",
            f"{span.name!r} from {span.begin:.6g} to {span.end:.6g} s, cost {cost:.6g}",
        )
        for span, cost in _costs(solution)
    ]


def segments_json(solution: Solution) -> dict[str, Any]:
    """`segments`: name, begin, end and cost of each; nothing for a motion in one scene."""
    rows = [
        {"name": span.name, "begin": span.begin, "end": span.end, "cost": cost}
        for span, cost in _costs(solution)
    ]
    return {"segments": rows} if rows else {}


def _costs(solution: Solution) -> list[tuple[SegmentSpan, float]]:
    """The segments with their costs, which sum to that of the motion."""
    spans = segment_spans(solution.trajectory)
    if not spans or solution.problem is None:
        return []
    values = solution.problem.ld.values(solution.trajectory.path)
    return [(span, float(np.sum(values[span.intervals]))) for span in spans]
