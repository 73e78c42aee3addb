"""A study of effects as a table, as JSON and as a figure."""

from __future__ import annotations

import json
import math
import os
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hovi.accuracy.effect_study.study import EffectStudy, EffectTrial
from hovi.robot.tip_frame import names_in_words
from hovi.viewing.figures import write_figure

COLUMNS = (
    "effect",
    "torque [N m]",
    "cost",
    "change",
    "tip [mm]",
    "open loop [mm]",
    "held [mm]",
    "instructions",
    "us/point",
    "ratio",
    "plan [s]",
)
_EFFECT, _TIME = "#0072B2", "#D55E00"


def study_note(study: EffectStudy) -> str:
    """What the columns are, and at which frames lengths are measured."""
    tips = names_in_words(study.task.scene.robot.tip_frames)
    return (
        "torque: largest change along the scene's own motion; cost, change, tip: the motion "
        "planned with the effect, the tip plus or minus the estimated errors of this motion and of "
        "the scene's own; open loop, held: tip deviation at the end when the planned torques are "
        "applied with the effect, without and with a feedback of 10 rad/s; the tip is "
        f"{tips}; us/point: one evaluation with derivatives; ratio: us/point relative to the "
        "unchanged scene."
    )


def study_rows(study: EffectStudy) -> list[list[str]]:
    """Rows of COLUMNS: the unchanged scene, then one row per trial."""
    own = ["(unchanged)", "", f"{study.solution.cost:.6g}", "", "", "", "", ""]
    own += [f"{1e6 * study.seconds:.3g}", "1", f"{study.plan_seconds:.2g}"]
    return [own, *(_row(study, trial) for trial in study.trials)]


def _row(study: EffectStudy, trial: EffectTrial) -> list[str]:
    return [
        trial.name,
        f"{trial.torque:.3g}",
        f"{trial.cost:.6g}" if trial.success else "no minimum",
        f"{100 * study.change(trial):+.3g} %" if trial.success else "-",
        _with_noise(trial),
        _millimetres(trial.open_loop),
        _millimetres(trial.held),
        f"{trial.instructions:+d}",
        f"{1e6 * trial.seconds:.3g}",
        f"{trial.seconds / study.seconds:.3g}",
        f"{trial.plan_seconds:.2g}",
    ]


def _with_noise(trial: EffectTrial) -> str:
    """The distance of the tip, plus or minus what the grids contribute, rounded up to a digit."""
    if trial.tip is None:
        return "-"
    if trial.tip_noise is None:
        return f"{_millimetres(trial.tip)} ± ?"
    return f"{_millimetres(trial.tip)} ± {_rounded_up(1e3 * trial.tip_noise)}"


def _rounded_up(number: float) -> str:
    """With one significant digit."""
    if number == 0.0:
        return "0"
    unit = 10.0 ** math.floor(math.log10(number))
    return f"{float(f'{unit * math.ceil(number / unit):.1g}'):g}"


def _millimetres(distance: float | None) -> str:
    if distance is None:
        return "diverged"
    return f"{1e3 * distance:.3g}" if distance < 1 else f"{1e3 * distance:.0f}"


def study_json(study: EffectStudy) -> str:
    """The study as one JSON object; non-finite numbers become null."""
    trials = [
        {
            "effect": trial.effect.key,
            "added": trial.added,
            "description": trial.effect.describe(),
            "torque": trial.torque,
            "cost": trial.cost,
            "cost_change": _finite(study.change(trial)),
            "success": trial.success,
            "nit": trial.nit,
            "tip": trial.tip,
            "tip_noise": trial.tip_noise,
            "open_loop": trial.open_loop,
            "held": trial.held,
            "instructions": trial.instructions,
            "seconds_per_point": trial.seconds,
            "plan_seconds": trial.plan_seconds,
        }
        for trial in study.trials
    ]
    fields: dict[str, Any] = {
        "scene": study.task.name,
        "tip_frames": list(study.task.scene.robot.tip_frames),
        "cost": study.solution.cost,
        "seconds_per_point": study.seconds,
        "plan_seconds": study.plan_seconds,
        "trials": trials,
        "untried": [effect.key for effect in study.untried],
        "failed": [{"effect": each.effect.key, "reason": each.reason} for each in study.failed],
    }
    return json.dumps(fields, allow_nan=False)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def plot_study(study: EffectStudy, path: str | os.PathLike[str]) -> None:
    """Write `study_figure` to a PNG, PDF or SVG by its suffix. Raises DisplayError."""
    write_figure(study_figure(study), path)


def study_figure(study: EffectStudy) -> Figure:
    """Bars of the changes of torque, cost and tip, and of the evaluation time, per effect.

    If no minimum was found with an effect, the cost has no bar.
    """
    trials = study.trials[::-1]
    names = [trial.name for trial in trials]
    figure = Figure(figsize=(11.0, 1.4 + 0.38 * len(trials)), layout="constrained")
    panels = figure.subplots(1, 4, sharey=True)
    _bars(panels[0], names, [t.torque for t in trials], "change of torque [N m]")
    changes = [100 * abs(study.change(t)) for t in trials]
    signs = ["-" if study.change(t) < 0 else "+" for t in trials]
    _bars(panels[1], names, changes, "change of the cost [%]", signs, without="no minimum")
    deviations = [1e3 * (np.nan if t.held is None else t.held) for t in trials]
    tips = names_in_words(study.task.scene.robot.tip_frames)
    _bars(panels[2], names, deviations, f"deviation of {tips} at the end, held [mm]")
    ratios = [t.seconds / study.seconds for t in trials]
    _bars(panels[3], names, ratios, "evaluation time, relative", color=_TIME)
    panels[3].axvline(1.0, color="0.4", linewidth=0.8)
    figure.suptitle(f"{study.task.name}: influence and evaluation time of each effect")
    return figure


def _bars(
    ax: Axes,
    names: list[str],
    values: list[float],
    label: str,
    signs: list[str] | None = None,
    color: str = _EFFECT,
    without: str | None = None,
) -> None:
    """Draw bars on a logarithmic axis over at most six decades, each with its number.

    without: label of a non-finite value, drawn without a bar; by default a full bar, "diverged".
    """
    largest = max([v for v in values if np.isfinite(v)], default=1.0) or 1.0
    least = largest * 1e-6
    lowest = min([max(v, least) for v in values if np.isfinite(v)], default=largest) / 3
    full = largest if without is None else lowest
    shown = [max(v, least) if np.isfinite(v) else full for v in values]
    ax.barh(names, shown, left=0.0, color=color, height=0.6)
    ax.set_xscale("log")
    ax.set_xlim(lowest, largest * 30)
    for i, (value, end) in enumerate(zip(values, shown, strict=True)):
        sign = signs[i] if signs else ""
        text = sign + _short(value) if np.isfinite(value) else without or "diverged"
        ax.annotate(text, (end, i), (4, 0), textcoords="offset points", va="center", fontsize=8)
    ax.set_xlabel(label, fontsize=9)
    ax.tick_params(labelsize=9)
    ax.spines[["top", "right"]].set_visible(False)


def _short(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"
