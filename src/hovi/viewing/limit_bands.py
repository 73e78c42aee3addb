"""Limits in a plot over time: a band along each bound, and a mark where a curve is at it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

NEAR_BOUND = 0.15
"""A bound is drawn when its curve comes within this fraction of the range."""
MAX_EXTENSION = 0.6
"""A bound farther from the curves than this fraction of their extent is omitted."""
LIMIT, AT_LIMIT = "limit", "at a limit"
"""Legend labels of a band and a mark; also the group ids of their lines."""
_GRAY = "0.35"
_THICKNESS = 0.025
_DASH = 6.0


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a plot, in the units of the plot.

    name: joint coordinate. color: a Matplotlib color.
    t, y: points, NaN at breaks. lower, upper: bounds, infinite where there is none.
    active: whether each point is at a bound, same shape as y.
    """

    name: str
    color: str
    t: Array
    y: Array
    lower: float
    upper: float
    active: npt.NDArray[np.bool_]

    @property
    def range(self) -> float:
        """upper - lower, or max(1, |bound|) where there is only one bound."""
        both = self.upper - self.lower
        one = self.lower if np.isfinite(self.lower) else self.upper
        return both if np.isfinite(both) else max(1.0, abs(one))


def draw_limits(ax: Axes, curves: Sequence[Curve]) -> None:
    """Draw bands beyond the bounds near the curves, and marks where curves are at a bound.

    A bound that several joints share is dashed in their colors. Bounds far from all curves are
    omitted, which is noted above the axes.
    """
    low = float(min(np.nanmin(curve.y) for curve in curves))
    high = float(max(np.nanmax(curve.y) for curve in curves))
    reach = MAX_EXTENSION * max(high - low, 1e-9)
    bounds = _near_bounds(curves)
    shown = {k: v for k, v in bounds.items() if low - reach <= k[0] <= high + reach}
    if shown:
        _draw_bands(ax, shown, low, high)
    for curve in curves:
        if curve.active.any():
            at_bound = np.where(curve.active, curve.y, np.nan)
            (mark,) = ax.plot(curve.t, at_bound, "-", color=curve.color, linewidth=5.0, alpha=0.4)
            mark.set(gid=AT_LIMIT, solid_capstyle="butt")
    drawn = {curve.name for members in shown.values() for curve in members}
    limited = [curve for curve in curves if np.isfinite([curve.lower, curve.upper]).any()]
    omitted = [curve.name for curve in limited if curve.name not in drawn]
    if omitted:
        ax.set_title(_omitted_limits_title(omitted, curves), loc="right", fontsize=7, color="0.4")


def legend_entries(axes: Sequence[Axes]) -> list[tuple[Artist, str]]:
    """Legend handles and labels of the bands and marks that any of the axes has."""
    drawn = {line.get_gid() for ax in axes for line in ax.lines}
    handles: dict[str, Line2D] = {
        LIMIT: Line2D([], [], color=_GRAY, linewidth=0.9, linestyle=(0, (_DASH, _DASH / 2))),
        AT_LIMIT: Line2D([], [], color=_GRAY, linewidth=5.0, alpha=0.4),
    }
    return [(line, label) for label, line in handles.items() if label in drawn]


def _near_bounds(curves: Sequence[Curve]) -> dict[tuple[float, float], list[Curve]]:
    """Curves by (nearby bound, direction in which it is exceeded)."""
    found: dict[tuple[float, float], list[Curve]] = {}
    for curve in curves:
        for bound, outward in ((curve.lower, -1.0), (curve.upper, 1.0)):
            gap = outward * bound - np.nanmax(outward * curve.y)
            if np.isfinite(bound) and gap <= NEAR_BOUND * curve.range:
                found.setdefault((bound, outward), []).append(curve)
    return found


def _draw_bands(
    ax: Axes, bounds: dict[tuple[float, float], list[Curve]], low: float, high: float
) -> None:
    low, high = min(low, *(k[0] for k in bounds)), max(high, *(k[0] for k in bounds))
    thickness = _THICKNESS * (high - low)
    for (bound, outward), members in bounds.items():
        color = members[0].color if len(members) == 1 else _GRAY
        for k, member in enumerate(members):
            dashes = (_DASH, _DASH * max(0.5, len(members) - 1))
            style = (-_DASH * k, dashes)
            ax.axhline(bound, color=member.color, linewidth=1.1, linestyle=style, gid=LIMIT)
        edge = bound + outward * thickness
        ax.axhspan(min(bound, edge), max(bound, edge), color=color, alpha=0.25, linewidth=0)
    ax.set_ylim(low - 2 * thickness, high + 2 * thickness)


def _omitted_limits_title(names: Sequence[str], curves: Sequence[Curve]) -> str:
    distinct = list(dict.fromkeys(names))
    if len(distinct) == len(curves):
        return "far from all limits"
    shown = ", ".join(distinct) if len(distinct) <= 3 else f"{len(distinct)} joints"
    return f"far from the limits of {shown}"
