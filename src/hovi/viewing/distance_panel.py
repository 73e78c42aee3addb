"""The panel of a plot that shows the distances to obstacles over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import distances_over_time
from hovi.planning.clearance.distances import Distances

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

_SAMPLES = 600
_SHOWN_PAIRS = 3
_CONSTANT = 1e-6
"""Largest change of a distance that counts as none, in [m]."""
_COLORS = ("#333333", "#D55E00", "#0072B2")


def draw_distances(
    ax: Axes, trajectory: Trajectory, clearance: Clearance, distances: Distances
) -> None:
    """Draw the distances of the closest pairs over time, and the margin as a dashed line.

    Pairs whose distance never changes, such as those of a locked gripper, are left out.
    """
    t = np.linspace(0.0, trajectory.duration, _SAMPLES)
    d = distances_over_time(trajectory, distances, t) - distances.allowance
    largest = np.where(np.isfinite(d), d, -np.inf).max(axis=0)  # infinite where nothing is carried
    changing = np.flatnonzero(largest - d.min(axis=0) > _CONSTANT)
    closest = changing[np.argsort(d[:, changing].min(axis=0), kind="stable")[:_SHOWN_PAIRS]]
    for color, k in zip(_COLORS, closest, strict=False):
        pair = distances.pairs[k]
        label = f"{pair.link} to {pair.other}"
        ax.plot(t, d[:, k], color=color, linewidth=1.4, label=label)
    ax.axhline(clearance.margin, color="0.35", linewidth=0.9, linestyle="--", label="margin")
    ax.set_ylim(bottom=min(0.0, float(d[:, closest].min(initial=0.0))))
    ax.set_ylabel("distance [m]")
    ax.grid(color="0.88", linewidth=0.6)
    ax.spines["top"].set_visible(False)
    # above the panel, since curves may be anywhere in it
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8, frameon=False, ncols=2)
