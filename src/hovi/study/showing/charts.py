"""Pictures of a study: histograms, a column against a parameter, and maps over two parameters."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from hovi.errors import InputError
from hovi.study.showing.plans import Plans
from hovi.viewing.figures import write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

BINS = 30
MAX_POINTS = 20_000
"""Largest number of points of a scatter plot; of more, equally spaced ones are drawn."""
LOG_RANGE = 30.0
"""Ratio of the 98th to the 2nd percentile from which a scale is logarithmic."""
HISTOGRAMS = ("cost", "nit", "margin", "seconds")
_LABELS = {
    "cost": "cost",
    "effort": "effort",
    "nit": "steps of the optimiser",
    "margin": "smallest margin to a limit, fraction of its range",
    "least_distance": "least distance [m]",
    "seconds": "wall time of a plan [s]",
    "motion_duration": "duration [s]",
}
_COORDINATES = {"[0]": "x", "[1]": "y", "[2]": "z"}
_FAILED = {
    "unreachable": ("#b8b8b8", "no configuration meets it"),
    "infeasible": ("#c0392b", "infeasible"),
    "refused": ("#7d3c98", "refused"),
}
_OTHER = ("#e67e22", "no resolved minimum")


def draw_histograms(plans: Plans, path: Path) -> None:
    """Histograms of what minima cost and take, and how many plans ended how."""
    success = plans.success
    values = {name: plans.numbers(name)[success] for name in HISTOGRAMS}
    drawn = {name: x[np.isfinite(x)] for name, x in values.items() if np.isfinite(x).any()}
    figure = Figure(figsize=(9.0, 2.6 * (1 + (len(drawn) + 1) // 2)), layout="constrained")
    axes = figure.subplots(1 + (len(drawn) + 1) // 2, 2, squeeze=False).ravel()
    _draw_status(axes[0], plans)
    for ax, (name, numbers) in zip(axes[1:], drawn.items(), strict=False):
        logarithmic = _is_wide(numbers)
        ax.hist(numbers, bins=_bins(numbers, logarithmic), color="#2e6f9e")
        ax.set_xscale("log" if logarithmic else "linear")
        ax.set(xlabel=_label(name), ylabel="plans")
    for ax in axes[1 + len(drawn) :]:
        ax.set_axis_off()
    write_figure(figure, path)


def draw_against(plans: Plans, parameter: str, path: Path, value: str = "cost") -> None:
    """A column of the minima against a parameter, with failures at the bottom.

    Raises InputError for columns without numbers.
    """
    x, y, success = plans.numbers(parameter), plans.numbers(value), plans.success
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    ax = figure.subplots()
    some = np.arange(0, len(x), 1 + len(x) // MAX_POINTS)
    found = some[success[some]]
    ax.plot(x[found], y[found], ".", color="#2e6f9e", markersize=4, label="minimum")
    failed = some[~success[some]]
    if len(failed):
        bottom = ax.get_xaxis_transform()
        label = "without a minimum"
        ax.plot(x[failed], np.full(len(failed), 0.02), "|", color="#c0392b", transform=bottom)
        ax.plot([], [], "|", color="#c0392b", label=label)
        ax.legend()
    if _is_wide(y[found]):
        ax.set_yscale("log")
    ax.set(xlabel=_label(parameter), ylabel=_label(value))
    write_figure(figure, path)


def draw_map(
    plans: Plans, path: Path, over: tuple[str, str] | None = None, value: str = "cost"
) -> None:
    """A column over two parameters: where minima are, what they cost, and where there are none.

    over: names of the parameters, along x and y; the first two that vary by default. Where several
        plans have the same values of both, the best one is drawn.
    Raises InputError if fewer parameters vary, and for columns without numbers.
    """
    if over is None:
        if len(plans.varying) < 2:
            raise InputError(
                "a map needs two parameters that vary; give a parameter with --against."
            )
        over = plans.varying[0], plans.varying[1]
    x, y, z = plans.numbers(over[0]), plans.numbers(over[1]), plans.numbers(value)
    figure = Figure(figsize=(7.2, 5.8), layout="constrained")
    ax = figure.subplots()
    _draw_failures(ax, plans, x, y)
    best = _best(x, y, np.where(plans.success, z, np.nan))
    size = _marker_size(x, y)
    drawn = ax.scatter(
        *(x[best], y[best]),
        c=z[best],
        s=size**2,
        marker="s",
        linewidths=0,
        cmap="viridis",
        norm="log" if _is_wide(z[best]) else "linear",
    )
    figure.colorbar(drawn, ax=ax, label=_label(value))
    ax.set(xlabel=_label(over[0]), ylabel=_label(over[1]))
    if all("position" in name for name in over):
        ax.set_aspect("equal")
    if ax.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    ax.set_title(f"{int(plans.success.sum()):,} of {len(plans):,} plans are minima", fontsize=10)
    write_figure(figure, path)


def _draw_failures(ax: Axes, plans: Plans, x: Array, y: Array) -> None:
    """The places without any minimum, by how plans ended there."""
    status, success = np.array(plans.columns["status"]), plans.success
    reached = set(zip(x[success], y[success], strict=True))
    missed = np.array([place not in reached for place in zip(x, y, strict=True)], dtype=bool)
    size = _marker_size(x, y)
    for name in dict.fromkeys(status[missed].tolist()):
        color, label = _FAILED.get(name, _OTHER)
        here = (status == name) & missed
        known = label in ax.get_legend_handles_labels()[1]
        ax.scatter(
            *(x[here], y[here]),
            color=color,
            s=size**2,
            marker="s",
            linewidths=0,
            label=None if known else label,
        )


def _best(x: Array, y: Array, z: Array) -> npt.NDArray[np.intp]:
    """Rows with a value, of those at one place the one with the least."""
    rows = np.flatnonzero(np.isfinite(z))
    rows = rows[np.argsort(z[rows], kind="stable")]
    places = np.stack([x[rows], y[rows]], axis=1)
    _, first = np.unique(places, axis=0, return_index=True)
    return np.asarray(rows[np.sort(first)])


def _marker_size(x: Array, y: Array) -> float:
    """The side of a square in points, so that those of a grid nearly touch."""
    columns, rows = len(np.unique(x)), len(np.unique(y))
    if columns * rows > 4 * len(x):  # no grid
        columns = rows = max(1, int(np.sqrt(len(x))))
    return float(np.clip(345.0 / max(columns, rows, 1), 1.5, 40.0))


def _draw_status(ax: Axes, plans: Plans) -> None:
    counts = plans.by_status()
    names = list(counts)[::-1]
    colors = ["#2e6f9e" if name == "minimum" else "#c0392b" for name in names]
    bars = ax.barh(names, [counts[name] for name in names], color=colors)
    ax.bar_label(bars, fmt="{:,.0f}", padding=3)
    ax.margins(x=0.15)
    ax.set(xlabel="plans")


def _is_wide(values: Array) -> bool:
    values = values[np.isfinite(values)]
    if len(values) == 0 or values.min() <= 0:
        return False
    low, high = np.quantile(values, [0.02, 0.98])
    return bool(high > LOG_RANGE * low)


def _bins(values: Array, logarithmic: bool) -> Array:
    low, high = values.min(), values.max()
    if low == high:
        return np.array([low - 0.5, high + 0.5])
    if logarithmic:
        return np.geomspace(low, high, BINS + 1)
    return np.linspace(low, high, BINS + 1)


def _label(name: str) -> str:
    if name in _LABELS:
        return _LABELS[name]
    end, _, entry = name.partition(".position")
    return f"{_COORDINATES[entry]} of the {end} [m]" if entry in _COORDINATES else name
