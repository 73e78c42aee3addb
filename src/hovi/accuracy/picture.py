"""The picture of a work-precision diagram: errors against time, on logarithmic axes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from hovi.accuracy import MEASURES, Choice, Diagram, Run
from hovi.accuracy.measures import shown_size
from hovi.discrete.measures.motion_error import MotionError
from hovi.robot.tip_frame import names_in_words
from hovi.viewing.figures import write_figure

OWN_FAMILY = "hovi"
TEXT_SIZE = 14.0
"""Of labels in the file of a picture, in points: it is read at half of its width on a page."""
_LABELS = {
    "cost": "error of the cost, relative",
    "joints": "largest error of a joint [rad]",
    "tip": "largest error at {tips} [mm]",
}
_PEER_COLORS = ("#D55E00", "#E69F00", "#CC79A7", "#6b6b6b", "#009E73", "#8c510a")
_MILLISECONDS = 1e3
_ERROR_FLOOR = 1e-16  # drawn for smaller errors
_COINCIDENT_DECADES = 0.3  # errors closer than this, in decades, share one label
ERROR_LABELS = 7
"""Largest number of labels of errors on an axis."""
_MARKERS = "osD^vPhX<>"  # stars are choices of plan
_CHOICE, _DEFAULT = "#d00000", "#ffb000"

Time = Callable[[Run], float]


def plot_work_precision(
    diagram: Diagram, path: str | os.PathLike[str], fastest: bool = False
) -> None:
    """Write `work_precision_figure` to a file: PNG, PDF or SVG. Raises DisplayError."""
    with matplotlib.rc_context({"font.size": TEXT_SIZE}):
        write_figure(work_precision_figure(diagram, fastest), path)


def work_precision_figure(diagram: Diagram, fastest: bool = False) -> Figure:
    """Three panels over the time of a warm solve, one over setup and first solve.

    One curve per scheme of hovi, with a point per number of intervals. For each family of reference
    tools, all points and their Pareto front. The Pareto front of all runs is shaded; the choices of
    `plan(tolerance=)` are stars, and so is its default. Within limits points are not joined, dotted
    lines show the error of the resolved motion, and a dashed one the effect of the limits'
    tolerance on the cost.

    fastest: show the fastest repeat instead of the median, for a machine under other load.
    """
    warm = _fastest if fastest else _median
    figure = Figure(figsize=(11.0, 10.5), layout="constrained")
    panels = figure.subplots(2, 2)
    for ax, measure in zip(panels.flat, MEASURES, strict=False):
        _panel(ax, diagram, measure, warm)
        _front(ax, diagram, measure, warm)
        _choices(ax, diagram, measure, fastest)
        _default(ax, diagram, measure, fastest)
        _least_errors(ax, diagram, measure)
        ax.set_xlabel(f"warm solve [ms, {diagram.clock}]")
    _panel(panels[1, 1], diagram, "cost", _cold)
    panels[1, 1].set_xlabel(f"setup and first solve [ms, {diagram.clock}]")
    for ax in panels.flat:
        if not np.isfinite(ax.dataLim.minpos).all():  # nothing to show, and no range of a log axis
            ax.set(xlim=(1.0, 10.0), ylim=(1e-3, 1.0))
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
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
    limits = "within limits, " if diagram.limited else ""
    title = f"{diagram.scene}: error against time, {limits}from {start}"
    if diagram.default is None or diagram.default.counts:
        return title
    return f"{title}\nplan's default found {diagram.default.found}, and has no star"


def _panel(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    families = dict.fromkeys(run.family for run in diagram.runs)
    for color, family in zip(
        _PEER_COLORS * 9, [f for f in families if f != OWN_FAMILY], strict=False
    ):
        _peer_family(ax, diagram, family, measure, time, color)
    _own_schemes(ax, diagram, measure, time)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.xaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    least, most = ax.get_xlim()
    if most < 300 * least:  # or labels of 2 and 5 in every decade overlap
        ax.xaxis.set_minor_formatter("{x:g}")
    else:
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(axis="x", which="minor", labelsize="small")
    ax.yaxis.set_major_locator(LogLocator(numticks=ERROR_LABELS))
    tips = names_in_words(diagram.resolved.tip_frames)
    ax.set_ylabel(_LABELS[measure].format(tips=tips))
    ax.margins(y=0.08)  # for labels below stars
    ax.grid(color="0.9", linewidth=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def _own_schemes(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    own = dict.fromkeys(run.method for run in diagram.runs if run.family == OWN_FAMILY)
    shades = matplotlib.colormaps["viridis"]
    for i, name in enumerate(own):
        runs = [run for run in diagram.of(name) if run.counts]
        x, y = _points(diagram, runs, measure, time)
        order = next((f", order {run.order}" for run in runs if run.order), "")
        order, width = ("", 0.0) if diagram.limited else (order, 1.3)  # kinks set the order
        label = f"{name}{order}" if runs else None
        (line,) = ax.plot(x, y, linewidth=width, label=label)
        line.set(color=shades(0.92 * i / max(len(own) - 1, 1)), marker=_MARKERS[i % 10], ms=4)


def _peer_family(
    ax: Axes, diagram: Diagram, family: str, measure: str, time: Time, color: str
) -> None:
    runs = [run for run in diagram.runs if run.family == family and run.counts]
    x, y = _points(diagram, runs, measure, time)
    ax.plot(x, y, ".", color=color, markersize=3, alpha=0.4)
    best = diagram.front(measure, lambda run: run.family == family, time)
    x, y = _points(diagram, best, measure, time)
    ax.plot(x, y, "--", color=color, linewidth=2.2, label=family)


def _front(ax: Axes, diagram: Diagram, measure: str, time: Time) -> None:
    x, y = _points(diagram, diagram.front(measure, time=time), measure, time)
    ax.plot(x, y, color="black", linewidth=3.5, alpha=0.25, label="cheapest", zorder=1)


def _choices(ax: Axes, diagram: Diagram, measure: str, fastest: bool) -> None:
    """Draw a star per tolerance, labelled in the panel of the cost."""
    chosen = [choice for choice in diagram.choices if choice.counts]
    x = [_MILLISECONDS * (c.best_seconds if fastest else c.seconds) for c in chosen]
    y = [_height(diagram, choice.error, measure) for choice in chosen]
    style = {"linestyle": "none", "marker": "*", "markersize": 12.0, "zorder": 9.0}
    if chosen:
        (stars,) = ax.plot(x, y, color=_CHOICE, label="chosen by a tolerance")
        stars.set(**style)
    if measure == "cost":
        _label_tolerances(ax, chosen, x, y)


def _default(ax: Axes, diagram: Diagram, measure: str, fastest: bool) -> None:
    """Draw the star of plan's default."""
    choice = diagram.default
    if choice is None or not choice.counts:
        return
    x = _MILLISECONDS * (choice.best_seconds if fastest else choice.seconds)
    y = _height(diagram, choice.error, measure)
    label = f"plan's default, {choice.tolerance:.0e}"
    (star,) = ax.plot([x], [y], linestyle="none", color=_DEFAULT, label=label)
    star.set(marker="*", markersize=17.0, markeredgecolor="black", zorder=10.0)


def _least_errors(ax: Axes, diagram: Diagram, measure: str) -> None:
    """Draw the errors below which differences mean nothing, within limits."""
    if not diagram.limited:
        return
    own = shown_size(diagram.resolved.uncertainty, measure)
    ax.axhline(own, color="0.4", linestyle=":", linewidth=1.2, label="error of the reference")
    if measure == "cost":
        effect, label = diagram.resolved.limit_effect, "effect of the limits' tolerance"
        ax.axhline(effect, color="0.4", linestyle="--", linewidth=1.2, label=label)


def _label_tolerances(ax: Axes, chosen: Sequence[Choice], x: list[float], y: list[float]) -> None:
    """Write the tolerance next to each star; stars of nearly equal error share one label."""
    groups: list[list[int]] = []
    for i, error in enumerate(y):
        if groups and abs(math.log10(error / y[groups[-1][0]])) < _COINCIDENT_DECADES:
            groups[-1].append(i)
        else:
            groups.append([i])
    for group in groups:
        ends = (chosen[i].tolerance for i in (group[0], group[-1]))
        ax.annotate(
            " to ".join(dict.fromkeys(f"{tolerance:.0e}" for tolerance in ends)),
            (max(x[i] for i in group), y[group[0]]),
            xytext=(0, -15),
            textcoords="offset points",
            ha="center",
            color=_CHOICE,
            fontsize="small",
        )


def _points(
    diagram: Diagram, runs: Sequence[Run], measure: str, time: Time
) -> tuple[list[float], list[float]]:
    x = [_MILLISECONDS * time(run) for run in runs]
    return x, [_height(diagram, run.error, measure) for run in runs]


def _height(diagram: Diagram, error: MotionError, measure: str) -> float:
    """The error as drawn: within limits not below that of the reference."""
    known = shown_size(diagram.resolved.uncertainty, measure) if diagram.limited else 0.0
    return max(shown_size(error, measure), known, _ERROR_FLOOR)
