"""Motions compared joint by joint: positions, velocities and efforts, with their limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError
from hovi.planning.problem.limits import KINDS, Limits
from hovi.viewing.curves.colors import COLORS
from hovi.viewing.curves.shown_figure import ShownFigure

Array = npt.NDArray[np.float64]

_SAMPLES = 600
_STYLES = ("-", "--", ":", "-.")
_COLUMNS = (
    ("q", ("angle [rad]", "position [m]")),
    ("v", ("velocity [rad/s]", "velocity [m/s]")),
    ("tau", ("torque [N m]", "force [N]")),
)


def joint_figure(
    motions: Sequence[Trajectory], labels: Sequence[str], limits: Sequence[Limits | None]
) -> ShownFigure:
    """One row of panels per joint; limits of a motion are dashed lines in its color.

    motions: of robots with the same joints; a shorter one ends earlier. labels: for the legend.
    limits: those each was planned with. A limit far from all curves does not widen the axes.
    Raises DisplayError for robots with different joints.
    """
    names = motions[0].coordinate_names
    if any(each.coordinate_names != names for each in motions):
        raise DisplayError("motions are compared joint by joint: plot motions of the same robot.")
    size = (11.0, 1.0 + 1.7 * len(names))
    figure = ShownFigure(figsize=size, layout="constrained")
    axes = figure.subplots(len(names), len(_COLUMNS), sharex=True, squeeze=False)
    for number, motion in enumerate(motions):
        color, style = COLORS[number % 4], _STYLES[number % 4]
        for column, values in enumerate(_values(motion)):
            for joint, ax in enumerate(axes[:, column]):
                t = np.linspace(0.0, motion.duration, len(values))
                ax.plot(t, values[:, joint], style, color=color, label=labels[number])
    for column, (kind, _) in enumerate(_COLUMNS):
        for joint, ax in enumerate(axes[:, column]):
            _draw_limits(ax, limits, kind, joint)
    for joint, row in enumerate(axes):
        robot = motions[0].robot
        sliding = robot is not None and bool(robot.sliding[joint])
        for (_, units), ax in zip(_COLUMNS, row, strict=True):
            ax.set_ylabel(units[sliding])
            ax.set_title(names[joint], fontsize="medium", loc="left")
            ax.grid(color="0.88", linewidth=0.6)
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    if len(motions) > 1:
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def _values(motion: Trajectory) -> tuple[Array, Array, Array]:
    """Positions, velocities and efforts, (M, nv) each."""
    times = np.linspace(0.0, motion.duration, _SAMPLES)
    sample, q = motion.sample(times), motion.positions(times)
    tau = sample.tau if sample.tau.shape == sample.v.shape else np.full_like(sample.v, np.nan)
    return q, sample.v, tau


def _draw_limits(ax: Axes, limits: Sequence[Limits | None], kind: str, joint: int) -> None:
    """Dashed lines at limits of the motions that are within a range of all curves."""
    row = KINDS.index(kind)
    low, high = ax.get_ylim()
    reach = high - low
    for number, limit in enumerate(limits):
        sides = () if limit is None else (limit.lower[row, joint], limit.upper[row, joint])
        for bound in sides:
            if low - reach <= bound <= high + reach:
                dashes, color = (0, (4, 3)), COLORS[number % 4]
                ax.axhline(bound, color=color, linestyle=dashes, linewidth=0.9, gid="limit")
