"""The distance to what a motion keeps away from, drawn over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.violation import distances_over_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

_SAMPLES = 600
_NEAREST = 3
_COLORS = ("#333333", "#D55E00", "#0072B2")


def draw_distances(
    ax: Axes, trajectory: Trajectory, clearance: Clearance, distances: Distances
) -> None:
    """The distances of the pairs that come nearest over time, and the margin as a dashed line."""
    t = np.linspace(0.0, trajectory.duration, _SAMPLES)
    d = distances_over_time(trajectory, distances, t)
    nearest = np.argsort(d.min(axis=0), kind="stable")[:_NEAREST]
    for color, k in zip(_COLORS, nearest, strict=False):
        pair = distances.pairs[k]
        label = f"{pair.link} to {pair.other}"
        ax.plot(t, d[:, k], color=color, linewidth=1.4, label=label)
    ax.axhline(clearance.margin, color="0.35", linewidth=0.9, linestyle="--", label="margin")
    ax.set_ylim(bottom=min(0.0, float(d.min())))
    ax.set_ylabel("distance [m]")
    ax.grid(color="0.88", linewidth=0.6)
    ax.spines["top"].set_visible(False)
    ax.legend(loc="upper right", fontsize=8, frameon=False, ncols=2)
