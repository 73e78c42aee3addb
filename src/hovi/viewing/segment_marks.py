"""Lines in a plot over time where the segments of a motion meet, and their names."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes

from hovi.discrete.measures.motion_segments import motion_segments
from hovi.discrete.trajectory import Trajectory

_GRAY = "0.45"
_LONGEST_NAME = 40
_ABOVE_TITLE = 16.0
"""Height in [pt] of the names where a small title is below them."""


def draw_segments(axes: Sequence[Axes], trajectory: Trajectory) -> None:
    """Mark where segments meet in all axes, and name them above the first, and above its title."""
    segments = motion_segments(trajectory)
    height = _ABOVE_TITLE if axes[0].get_title(loc="right") else 2.0
    for each in segments[1:]:
        for ax in axes:
            ax.axvline(each.begin, color=_GRAY, linewidth=0.9, linestyle=":")
    for each in segments:
        axes[0].annotate(
            each.name[:_LONGEST_NAME],
            ((each.begin + each.end) / 2, 1.0),
            (0.0, height),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=8,
            color=_GRAY,
            parse_math=False,
        )
