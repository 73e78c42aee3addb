"""The margins of a motion to its limits, as fractions of their ranges."""

from __future__ import annotations

from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.measures.motion_segments import motion_segments
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_conditions import AT_LIMIT, closeness_by_interval
from hovi.planning.problem.limits import KINDS, Limits
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@check_arguments
@dataclass(frozen=True, eq=False)
class LimitMargins:
    """The smallest margin to the limits, per kind and velocity coordinate.

    names: of the coordinates.
    margin: distance to the nearest bound as a fraction of the range, shape (kinds, nv); negative
        beyond the bound, infinite where there is none. Of a sequence it is that of the segment
        that comes nearest, in its own range.
    limits: of the plan.
    """

    names: tuple[str, ...]
    margin: Array = field(repr=False)
    limits: Limits = field(repr=False)

    def __str__(self) -> str:
        """The tightest limit."""
        kind, joint, margin = self.tightest
        return f"tightest limit {kind} of {joint!r}, margin {self.in_words(margin)}"

    @property
    def excess(self) -> float:
        """The largest excess over a limit as a fraction of its range; 0 where all limits hold."""
        return max(0.0, -float(self.margin.min()))

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded by more than its tolerance."""
        return self.excess > self.limits.tolerance

    @property
    def tightest(self) -> tuple[str, str, float]:
        """The kind, the coordinate and the margin where it is smallest; all limits count."""
        kind, i = np.unravel_index(int(np.argmin(self.margin)), self.margin.shape)
        return self.limits.kinds[kind], self.names[i], float(self.margin[kind, i])

    def is_limited(self, kind: str) -> bool:
        """Whether any joint has a limit of this kind."""
        return kind in self.limits.kinds and bool(self.limits.bounded[KINDS.index(kind)].any())

    def text(self, kind: str, joint: int) -> str:
        """The margin in percent of the range, marked with * at a limit and ! beyond it."""
        margin = self.margin[KINDS.index(kind), joint]
        if not np.isfinite(margin):
            return "-"
        return self.in_words(float(margin))

    def in_words(self, margin: float) -> str:
        """A margin in percent, marked as by `text`."""
        if margin < -self.limits.tolerance:
            return f"!{100 * margin:.3g} %"
        return f"*{100 * max(margin, 0.0):.1f} %" if margin <= AT_LIMIT else f"{100 * margin:.1f} %"

    def by_kind(self) -> dict[str, dict[str, float]]:
        """The margins, by kind and joint."""
        return {
            kind: dict(zip(self.names, row.tolist(), strict=True))
            for kind, row in zip(self.limits.kinds, self.margin, strict=True)
        }


def limit_margins(
    motion: Trajectory, limits: Limits | None
) -> tuple[LimitMargins | None, dict[str, LimitMargins]]:
    """The margins of a motion to limits, None without any, and those of each of its segments."""
    if limits is None or not limits.bounded.any():
        return None, {}
    margin, names = closeness_by_interval(motion, limits), motion.coordinate_names
    segments = motion_segments(motion)
    if not limits.parts or len(segments) != len(limits.parts):
        found = {
            segment.name: LimitMargins(names, margin[segment.intervals].min(axis=0), limits)
            for segment in segments
        }
        return LimitMargins(names, margin.min(axis=0), limits), found
    of_parts = {}
    for segment, part in zip(segments, limits.parts, strict=True):
        own = margin[segment.intervals].min(axis=0) * (limits.ranges / part.ranges)
        of_parts[segment.name] = LimitMargins(names, own, part)
    tightest = np.min([each.margin for each in of_parts.values()], axis=0)
    return LimitMargins(names, tightest, limits), of_parts
