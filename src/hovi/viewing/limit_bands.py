"""Limits in a plot over time: a band along each bound, and a mark where a curve leans on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

Array = npt.NDArray[np.float64]

NEAR = 0.15
"""Bounds are drawn where their own curve leaves at most this share of their range."""
SQUASHING = 0.6
"""Bounds farther from all curves than this share of the curves' extent would squash them."""
LIMIT, AT_LIMIT = "limit", "at a limit"
"""What the legend calls a band and a mark; also the group ids of their lines."""
_SHARED = "0.35"
_THICKNESS = 0.025
_DASH = 6.0


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a plot, in the units of the plot.

    name: of the joint coordinate. color: as Matplotlib takes it.
    t, y: its points, NaN where it is broken. lower, upper: its bounds, infinite without one.
    active: where it stands at a bound, of y's shape.
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
        """The distance of its bounds, or the size of its only one."""
        both = self.upper - self.lower
        one = self.lower if np.isfinite(self.lower) else self.upper
        return both if np.isfinite(both) else max(1.0, abs(one))


def draw_limits(ax: Axes, curves: Sequence[Curve]) -> None:
    """Bands beyond the bounds that are near the curves, marks where curves lean on bounds.

    A bound's line has dashes in the colors of all joints that it is for. Bounds that no curve
    comes near are left out, which is said above the axes.
    """
    low = float(min(np.nanmin(curve.y) for curve in curves))
    high = float(max(np.nanmax(curve.y) for curve in curves))
    reach = SQUASHING * max(high - low, 1e-9)
    bounds = _near_bounds(curves)
    shown = {k: v for k, v in bounds.items() if low - reach <= k[0] <= high + reach}
    if shown:
        _draw_bands(ax, shown, low, high)
    for curve in curves:
        if curve.active.any():
            leaning = np.where(curve.active, curve.y, np.nan)
            (mark,) = ax.plot(curve.t, leaning, "-", color=curve.color, linewidth=5.0, alpha=0.4)
            mark.set(gid=AT_LIMIT, solid_capstyle="butt")
    drawn = {curve.name for members in shown.values() for curve in members}
    far = [c.name for c in curves if c.name not in drawn and np.isfinite([c.lower, c.upper]).any()]
    if far:
        ax.set_title(_far_sentence(far, curves), loc="right", fontsize=7, color="0.4")


def legend_entries(axes: Sequence[Axes]) -> list[tuple[Artist, str]]:
    """Handles and labels for the bands and marks that are drawn in any of the axes."""
    drawn = {line.get_gid() for ax in axes for line in ax.lines}
    looks: dict[str, Line2D] = {
        LIMIT: Line2D([], [], color=_SHARED, linewidth=0.9, linestyle=(0, (_DASH, _DASH / 2))),
        AT_LIMIT: Line2D([], [], color=_SHARED, linewidth=5.0, alpha=0.4),
    }
    return [(line, label) for label, line in looks.items() if label in drawn]


def _near_bounds(curves: Sequence[Curve]) -> dict[tuple[float, float], list[Curve]]:
    """Curves by (bound that they come near, direction in which it is exceeded)."""
    found: dict[tuple[float, float], list[Curve]] = {}
    for curve in curves:
        for bound, outward in ((curve.lower, -1.0), (curve.upper, 1.0)):
            room = outward * bound - np.nanmax(outward * curve.y)
            if np.isfinite(bound) and room <= NEAR * curve.range:
                found.setdefault((bound, outward), []).append(curve)
    return found


def _draw_bands(
    ax: Axes, bounds: dict[tuple[float, float], list[Curve]], low: float, high: float
) -> None:
    low, high = min(low, *(k[0] for k in bounds)), max(high, *(k[0] for k in bounds))
    thickness = _THICKNESS * (high - low)
    for (bound, outward), members in bounds.items():
        color = members[0].color if len(members) == 1 else _SHARED
        for k, member in enumerate(members):
            dashes = (_DASH, _DASH * max(0.5, len(members) - 1))
            look = (-_DASH * k, dashes)
            ax.axhline(bound, color=member.color, linewidth=1.1, linestyle=look, gid=LIMIT)
        edge = bound + outward * thickness
        ax.axhspan(min(bound, edge), max(bound, edge), color=color, alpha=0.25, linewidth=0)
    ax.set_ylim(low - 2 * thickness, high + 2 * thickness)


def _far_sentence(names: Sequence[str], curves: Sequence[Curve]) -> str:
    distinct = list(dict.fromkeys(names))
    if len(distinct) == len(curves):
        return "far from all limits"
    shown = ", ".join(distinct) if len(distinct) <= 3 else f"{len(distinct)} joints"
    return f"far from the limits of {shown}"
