"""The picture of a work-precision diagram: errors against time, on logarithmic axes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hovi.accuracy import MEASURES, Diagram, Run
from hovi.accuracy.measures import shown_size
from hovi.robot.tip_frame import names_in_words
from hovi.viewing.figures import write_figure

OWN_FAMILY = "hovi"
_LABELS = {
    "cost": "error of the cost, relative",
    "joints": "largest error of a joint [rad]",
    "tip": "largest error at {tips} [mm]",
}
_PEER_COLORS = ("#D55E00", "#E69F00", "#CC79A7", "#6b6b6b", "#009E73", "#8c510a")
_MILLISECONDS = 1e3
_ERROR_FLOOR = 1e-16  # drawn for smaller errors
_COINCIDENT_DECADES = 0.3  # errors closer than this, in decades, share one label
_MARKERS = "osD^vP*X<>"

Time = Callable[[Run], float]


def plot_work_precision(
    diagram: Diagram, path: str | os.PathLike[str], fastest: bool = False
) -> None:
    """Write `work_precision_figure` to a file: PNG, PDF or SVG. Raises DisplayError."""
    write_figure(work_precision_figure(diagram, fastest), path)


def work_precision_figure(diagram: Diagram, fastest: bool = False) -> Figure:
    """Three panels over the time of a warm solve, one over setup and first solve.

    One curve per scheme of hovi, with a point per number of intervals. For each family of reference
    tools, all points and their Pareto front. The Pareto front of all runs is shaded; the choices of
    `plan(tolerance=)` are stars.

    fastest: show the fastest repeat instead of the median, for a machine under other load.
    """
    warm = _fastest if fastest else _median
    figure = Figure(figsize=(11.0, 8.6), layout="constrained")
    panels = figure.subplots(2, 2)
    for ax, measure in zip(panels.flat, MEASURES, strict=False):
        _panel(ax, diagram, measure, warm)
        _front(ax, diagram, measure, warm)
        _choices(ax, diagram, measure, fastest)
        ax.set_xlabel("warm solve [ms]")
    _panel(panels[1, 1], diagram, "cost", _cold)
    panels[1, 1].set_xlabel("setup and first solve [ms]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
    figure.suptitle(_title(diagram), fontsize="medium")
    return figure


def _median(run: Run) -> float:
    return run.seconds


def _fastest(run: Run) -> float:
    return run.best_seconds


def _cold(run: Run) -> float:
    return run.cold_seconds


def _title(diagram: Diagram) -> str:
    start = {"near": "a guess near the motion", "cubic": "the cubic guess"}[diagram.guess]
    clock = "" if diagram.clock == "wall" else ", in processor time"
    return f"{diagram.scene}: error against time, from {start}{clock}"


def _panel(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    families = dict.fromkeys(run.family for run in diagram.runs)
    for color, family in zip(
        _PEER_COLORS * 9, [f for f in families if f != OWN_FAMILY], strict=False
    ):
        _peer_family(ax, diagram, family, measure, time, color)
    _own_schemes(ax, diagram, measure, time)
    ax.set_xscale("log")
    ax.set_yscale("log")
    tips = names_in_words(diagram.resolved.tip_frames)
    ax.set_ylabel(_LABELS[measure].format(tips=tips))
    ax.grid(color="0.9", linewidth=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def _own_schemes(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    own = dict.fromkeys(run.method for run in diagram.runs if run.family == OWN_FAMILY)
    shades = matplotlib.colormaps["viridis"]
    for i, name in enumerate(own):
        runs = [run for run in diagram.of(name) if run.counts]
        x, y = _points(runs, measure, time)
        order = next((f", order {run.order}" for run in runs if run.order), "")
        (line,) = ax.plot(x, y, linewidth=1.3, label=f"{name}{order}")
        line.set(color=shades(0.92 * i / max(len(own) - 1, 1)), marker=_MARKERS[i % 10], ms=4)


def _peer_family(
    ax: Axes, diagram: Diagram, family: str, measure: str, time: Time, color: str
) -> None:
    runs = [run for run in diagram.runs if run.family == family and run.counts]
    x, y = _points(runs, measure, time)
    ax.plot(x, y, ".", color=color, markersize=4, alpha=0.6)
    best = diagram.front(measure, lambda run: run.family == family, time)
    x, y = _points(best, measure, time)
    ax.plot(x, y, "--", color=color, linewidth=1.6, label=family)


def _front(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    x, y = _points(diagram.front(measure, time=time), measure, time)
    ax.plot(x, y, color="black", linewidth=3.5, alpha=0.25, label="cheapest", zorder=1)


def _choices(ax: Axes, diagram: Diagram, measure: str, fastest: bool) -> None:
    """Draw a star per tolerance, labelled in the panel of the cost."""
    chosen = diagram.choices
    x = [_MILLISECONDS * (c.best_seconds if fastest else c.seconds) for c in chosen]
    y = [max(shown_size(choice.error, measure), _ERROR_FLOOR) for choice in chosen]
    style = {"linestyle": "none", "marker": "*", "markersize": 12.0, "zorder": 9.0}
    if chosen:
        (stars,) = ax.plot(x, y, color="#d00000", label="chosen by a tolerance")
        stars.set(**style)
    if measure == "cost":
        _label_tolerances(ax, diagram, x, y)


def _label_tolerances(ax: Axes, diagram: Diagram, x: list[float], y: list[float]) -> None:
    """Write the tolerance beside each star; stars of nearly equal error share one label."""
    groups: list[list[int]] = []
    for i, error in enumerate(y):
        if groups and abs(math.log10(error / y[groups[-1][0]])) < _COINCIDENT_DECADES:
            groups[-1].append(i)
        else:
            groups.append([i])
    for group in groups:
        ends = (diagram.choices[i].tolerance for i in (group[0], group[-1]))
        ax.annotate(
            " to ".join(dict.fromkeys(f"{tolerance:.0e}" for tolerance in ends)),
            (max(x[i] for i in group), y[group[0]]),
            xytext=(8, -3),
            textcoords="offset points",
            color="#d00000",
            fontsize="small",
        )


def _points(runs: Sequence[Run], measure: str, time: Time) -> tuple[list[float], list[float]]:
    x = [_MILLISECONDS * time(run) for run in runs]
    return x, [max(shown_size(run.error, measure), _ERROR_FLOOR) for run in runs]
