"""How far a motion stays from its limits and from obstacles."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.measures.segment_spans import segment_spans
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import closest_along
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.problem.limit_violation import AT_LIMIT, excess_along
from hovi.planning.problem.limits import KINDS, Limits
from hovi.planning.problem.problem import TrajectoryProblem
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


@check_arguments
@dataclass(frozen=True, eq=False)
class Margins:
    """How far a motion stays from each of its limits and from obstacles, between the nodes, too.

    limits: the margins to the limits; None for a plan without limits.
    distance: the least distance to obstacles and, with self-collision, between links, in [m]; None
        for a plan without either.
    segments: of a sequence, the margins to the limits of each segment, by its name.
    nearest_pair: the link and the obstacle, or the two links, at that distance; None without one.
    """

    limits: LimitMargins | None = None
    distance: float | None = None
    segments: Mapping[str, LimitMargins] = field(default_factory=dict)
    nearest_pair: str | None = None

    def __str__(self) -> str:
        """The tightest limit of the motion and of each segment, and the least distance."""
        known = ["no limits" if self.limits is None else str(self.limits)]
        known += [f"{name!r}: {each}" for name, each in self.segments.items()]
        if self.distance is not None:
            known.append(f"least distance {self.distance:.4g} m, of {self.nearest_pair}")
        return "\n".join(known)


def margins_of(problem: TrajectoryProblem, motion: Trajectory) -> Margins:
    """The margins of a motion of a problem.

    Raises OutOfTimeError when the deadline in force passes before they are known.
    """
    limits, segments = limit_margins(motion, problem.limits)
    bounded = all_distances(problem)
    if bounded is None:
        return Margins(limits, None, segments)
    distance, pair = nearest_pair(motion, *bounded)
    return Margins(limits, distance, segments, pair)


def all_distances(problem: TrajectoryProblem) -> tuple[Clearance, Distances] | None:
    """The clearance and all distances that it bounds, far obstacles included; None without any."""
    clearance = problem.clearance
    if clearance is None or not clearance.wanted:
        return None
    return clearance, distances_between(problem.robot, clearance)


def limit_margins(
    motion: Trajectory, limits: Limits | None
) -> tuple[LimitMargins | None, dict[str, LimitMargins]]:
    """The margins of a motion to limits, None without any, and those of each of its segments."""
    if limits is None or not limits.bounded.any():
        return None, {}
    excess, names = excess_along(motion, limits), motion.coordinate_names
    margin = -np.maximum(excess.lower, excess.upper)  # (N, kinds, nv)
    spans = segment_spans(motion)
    if not limits.parts or len(spans) != len(limits.parts):
        found = {
            span.name: LimitMargins(names, margin[span.intervals].min(axis=0), limits)
            for span in spans
        }
        return LimitMargins(names, margin.min(axis=0), limits), found
    of_parts = {}
    for span, part in zip(spans, limits.parts, strict=True):
        own = margin[span.intervals].min(axis=0) * (limits.ranges / part.ranges)
        of_parts[span.name] = LimitMargins(names, own, part)
    tightest = np.min([each.margin for each in of_parts.values()], axis=0)
    return LimitMargins(names, tightest, limits), of_parts


def least_distance(motion: Trajectory, clearance: Clearance, distances: Distances) -> float:
    """The least distance of any pair, in [m], which may be smaller where shapes may touch."""
    return nearest_pair(motion, clearance, distances)[0]


def nearest_pair(
    motion: Trajectory, clearance: Clearance, distances: Distances
) -> tuple[float, str]:
    """The least distance, as `least_distance`, and the pair at which it occurs, in words."""
    approach = closest_along(motion, distances, clearance.margin)
    closest = (approach.distance - distances.allowance).min(axis=0)
    pair = int(np.argmin(closest))
    return float(closest[pair]), str(dataclasses.replace(distances.pairs[pair], touching=False))
