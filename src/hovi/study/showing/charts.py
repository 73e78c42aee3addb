"""Pictures of a study: histograms, a column against a parameter, and maps over two parameters."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from hovi.errors import InputError
from hovi.study.showing.plans import Plans
from hovi.system.dataclass import dataclass
from hovi.viewing.curves.shown_figure import ShownFigure
from hovi.viewing.figures import write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

Array = npt.NDArray[np.float64]

BINS = 30
MAX_POINTS = 20_000
"""Largest number of points of a scatter plot; of more, equally spaced ones are drawn."""
SPARSE = 4
"""Number of places on a grid of all values, per plan, from which plans are on no grid."""
PIXELS = 400
"""Pixels of a map along each side, where plans are on no grid."""
FARTHEST = 2.0
"""Distance up to which a pixel has the color of a plan, relative to 1 / sqrt(number of plans), both
axes having length 1."""
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
_COORDINATES = "x", "y", "z"
_ENTRY = re.compile(r"(start|goal)\.(q|position)\[(\d+)\]")
_FAILED = {
    "unreachable": ("#b8b8b8", "no configuration meets it"),
    "infeasible": ("#c0392b", "infeasible"),
    "refused": ("#7d3c98", "refused"),
}
_OTHER = ("#e67e22", "no resolved minimum")


def draw_histograms(plans: Plans, path: Path) -> None:
    """Write `histograms_of` to a file."""
    write_figure(histograms_of(plans), path)


def histograms_of(plans: Plans) -> ShownFigure:
    """Histograms of what minima cost and take, and how many plans ended how."""
    success = plans.success
    values = {name: plans.numbers(name)[success] for name in HISTOGRAMS}
    drawn = {name: x[np.isfinite(x)] for name, x in values.items() if np.isfinite(x).any()}
    rows = 1 + len(drawn) // 2
    figure = ShownFigure(figsize=(9.0, 2.6 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    _draw_status(axes[0], plans)
    for ax, (name, numbers) in zip(axes[1:], drawn.items(), strict=False):
        logarithmic = _is_wide(numbers)
        ax.hist(numbers, bins=_bins(numbers, logarithmic), color="#2e6f9e")
        ax.set_xscale("log" if logarithmic else "linear")
        ax.set(xlabel=_label(name, plans), ylabel="plans")
        ax.yaxis.get_major_locator().set_params(integer=True)
    for ax in axes[1 + len(drawn) :]:
        ax.set_axis_off()
    return figure


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
        figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    if _is_wide(y[found]):
        ax.set_yscale("log")
    ax.set(xlabel=_label(parameter, plans), ylabel=_label(value, plans))
    write_figure(figure, path)


def draw_map(
    plans: Plans, path: Path, over: tuple[str, str] | None = None, value: str = "cost"
) -> None:
    """Write `map_of` to a file."""
    write_figure(map_of(plans, over, value), path)


def map_of(plans: Plans, over: tuple[str, str] | None = None, value: str = "cost") -> ShownFigure:
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
    x, y = plans.numbers(over[0]), plans.numbers(over[1])
    z = np.where(plans.success, plans.numbers(value), np.nan)
    best = _best(x, y, z)
    shown = _Cells.of(x[best], y[best])
    figure = ShownFigure(figsize=(7.2, 5.8), layout="constrained")
    ax = figure.subplots()
    norm = "log" if _is_wide(z[best]) else "linear"
    drawn = shown.draw(ax, z[best], cmap="viridis", norm=norm)
    _draw_failures(ax, shown, np.array(plans.columns["status"])[best], np.isfinite(z[best]))
    figure.colorbar(drawn, ax=ax, label=_label(value, plans))
    ax.set(xlabel=_label(over[0], plans), ylabel=_label(over[1], plans))
    if all("position" in name for name in over):
        ax.set_aspect("equal")
    if ax.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    ax.set_title(f"{int(plans.success.sum()):,} of {len(plans):,} plans are minima", fontsize=10)
    return figure


@dataclass(frozen=True, eq=False)
class _Cells:
    """The part of a map that each plan has, without overlaps.

    On a grid that is a rectangle up to halfway to its neighbors; elsewhere, all points to which the
    plan is the nearest one, but for those far from any.
    edges: of the rectangles, ascending, along x and y. plan: of each, (rows, columns), or -1.
    """

    edges: tuple[Array, Array]
    plan: npt.NDArray[np.intp]

    @classmethod
    def of(cls, x: Array, y: Array) -> _Cells:
        """Of plans at different places, (M,) each."""
        (columns, i), (rows, j) = (np.unique(each, return_inverse=True) for each in (x, y))
        if len(columns) * len(rows) <= SPARSE * len(x):
            plan = np.full((len(rows), len(columns)), -1, dtype=np.intp)
            plan[j, i] = np.arange(len(x))
            return cls((_halfway(columns), _halfway(rows)), plan)
        from scipy.spatial import cKDTree  # slow to import, and rarely needed

        low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
        size = np.where(high > low, high - low, 1.0)
        reach = FARTHEST / np.sqrt(len(x))
        sides = np.linspace(-reach, 1.0 + reach, PIXELS + 1)
        middle = (sides[1:] + sides[:-1]) / 2
        pixels = np.stack(np.meshgrid(middle, middle), axis=-1)
        tree = cKDTree((np.stack([x, y], axis=1) - low) / size)
        far, nearest = tree.query(pixels, distance_upper_bound=reach)
        edges = low[0] + size[0] * sides, low[1] + size[1] * sides
        return cls(edges, np.where(np.isfinite(far), nearest, -1))

    def draw(self, ax: Axes, values: Array, **style: Any) -> QuadMesh:
        """Color the parts of plans by values, (M,); those of NaN stay as they are."""
        known = np.append(values, np.nan)[self.plan]  # -1 is the last
        return ax.pcolormesh(*self.edges, np.ma.masked_invalid(known), rasterized=True, **style)


def _halfway(values: Array) -> Array:
    """The edges of cells around ascending values, (n + 1,)."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def _draw_failures(
    ax: Axes, shown: _Cells, status: npt.NDArray[np.str_], success: npt.NDArray[np.bool_]
) -> None:
    """The places without any minimum, by how plans ended there."""
    for name in dict.fromkeys(status[~success].tolist()):
        color, label = _FAILED.get(name, _OTHER)
        here = np.where((status == name) & ~success, 1.0, np.nan)
        shown.draw(ax, here, cmap=ListedColormap([color]))
        if label not in ax.get_legend_handles_labels()[1]:
            ax.plot([], [], "s", color=color, label=label)


def _best(x: Array, y: Array, z: Array) -> npt.NDArray[np.intp]:
    """A row for each place: the one with the least value, or the first one without any."""
    rows = np.argsort(np.where(np.isfinite(z), z, np.inf), kind="stable")
    rows = rows[np.isfinite(x[rows]) & np.isfinite(y[rows])]
    places = np.stack([x[rows], y[rows]], axis=1)
    _, first = np.unique(places, axis=0, return_index=True)
    return np.asarray(rows[np.sort(first)])


def _draw_status(ax: Axes, plans: Plans) -> None:
    counts = plans.by_status()
    names = list(counts)[::-1]
    colors = ["#2e6f9e" if name == "minimum" else "#c0392b" for name in names]
    bars = ax.barh(names, [counts[name] for name in names], color=colors)
    ax.bar_label(bars, fmt="{:,.0f}", padding=3)
    ax.margins(x=0.25)
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


def _label(name: str, plans: Plans) -> str:
    """What an axis says: the joint or the coordinate that a column is of, with its unit."""
    if name in _LABELS:
        return _LABELS[name]
    found = _ENTRY.fullmatch(name)
    if found is None:
        return name
    end, what, entry = found[1], found[2], int(found[3])
    if what == "q" and entry < len(plans.coordinates):
        joint, _, unit = plans.coordinates[entry].rpartition(" ")
        return f"{joint} at the {end} {unit}"
    if what == "position" and entry < len(_COORDINATES):
        return f"{_COORDINATES[entry]} of the {end} [m]"
    return name
