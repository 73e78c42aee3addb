"""What a terminal or a notebook shows of limits and of a trajectory problem."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.joint_quantity import QUANTITIES
from hovi.system.summary import Summarized, Summary

Array = npt.NDArray[np.float64]


class LimitsSummary(Summarized):
    """Limits: one row for each quantity that has any."""

    lower: Array
    upper: Array

    def _summary(self) -> Summary:
        rows = [
            (kind, ", ".join(_range(*pair) for pair in zip(low, high, strict=True)))
            for kind, low, high in zip(QUANTITIES, self.lower, self.upper, strict=False)
            if np.isfinite(low).any() or np.isfinite(high).any()
        ]
        title = "Limits" if rows else "Limits: none"
        return Summary(f"{title} of {self.lower.shape[1]} joint coordinates", tuple(rows))


class ProblemSummary(Summarized):
    """A trajectory problem: its grid, ends, limits and obstacles."""

    ld: Any
    start: Any
    goal: Any
    limits: Any
    via: tuple[Any, ...]
    clearance: Any
    conditions: Any

    @property
    def bounds(self) -> tuple[Any, ...]:
        """The conditions that hold at all times, those of the limits included."""
        raise NotImplementedError

    @property
    def scenes(self) -> tuple[Any, ...]:
        """The scene of every segment; none without a robot."""
        raise NotImplementedError

    def _summary(self) -> Summary:
        limited = self.limits is not None and self.limits._summary().rows
        rows = [
            ("grid", f"{self.ld.grid.duration:g} s, {self.ld.grid.in_words}"),
            ("start", repr(self.start)),
            ("goal", repr(self.goal)),
            ("limits", "on " + ", ".join(kind for kind, _ in limited) if limited else "none"),
        ]
        if self.via:
            rows.append(("via", f"{len(self.via)} points"))
        if self.clearance is not None and self.clearance.wanted:
            rows.append(("obstacles", str(len(self.clearance.obstacles))))
        asked = dict.fromkeys((*self.conditions, *self.bounds))
        if asked:
            rows.append(("conditions", ", ".join(each.name for each in asked)))
        return Summary("TrajectoryProblem", tuple(rows))


def _range(low: float, high: float) -> str:
    if low == -high:
        return "none" if np.isinf(high) else f"±{high:.4g}"
    return f"{low:.4g} .. {high:.4g}"
