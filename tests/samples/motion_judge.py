"""The judge of motions asked for in every way at once: Pinocchio and dense samples alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin

import hovi
from samples.asked_motions import RIGID_ALONE, TIME, Array, Asked

SAMPLES = 2_001
SAME, LIMIT_SLACK = 1e-5, 3e-6
"""Of ends, in [rad] or [m]; of limits, relative to their ranges."""


def judged(
    asked: Asked,
    found: hovi.Solution,
    start: tuple[Array, Array] | None = None,
    goal: Array | None = None,
    elapsed: float = 0.0,
) -> str:
    """What a success does not satisfy of what it claims; "" if nothing."""
    motion = found.trajectory
    t = np.linspace(0.0, motion.duration, SAMPLES)
    sample = motion.sample(t)
    series = {"q": sample.q, "v": sample.v, "a": sample.a, "tau": sample.tau}
    if not all(np.isfinite(x).all() for x in series.values()):
        return "samples are not finite"
    if not math.isfinite(found.cost):
        return "the cost is not finite"
    checks: Mapping[str, Callable[[], str]] = {
        "duration": lambda: _duration(asked, motion.duration, elapsed),
        "start": lambda: _start(asked, series, start, goal),
        "goal": lambda: _goal(asked, series, goal),
        "via": lambda: "" if elapsed or goal is not None else _via(asked, motion),
        "limits": lambda: over_limits(asked, series),
        "torques": lambda: _torques(asked, series),
    }
    wrong = ((name, check()) for name, check in checks.items())
    return next((f"{name}: {what}" for name, what in wrong if what), "")


def _duration(asked: Asked, T: float, elapsed: float) -> str:
    low, high = (0.6 * TIME, 2.0 * TIME) if asked.case["duration"] == "free" else (TIME, TIME)
    sequence = asked.case["goal"] == "segments" and asked.case["call"] != "study"
    more = 0.5 * TIME if sequence else 0.0
    inside = low + more - elapsed - 1e-9 <= T <= high + more - elapsed + 1e-9
    return "" if inside else f"{T} s"


def _start(
    asked: Asked,
    series: Mapping[str, Array],
    start: tuple[Array, Array] | None,
    goal: Array | None,
) -> str:
    if asked.case["goal"] == "periodic" and start is None and goal is None:
        ends = asked.robot.difference(series["q"][0], series["q"][-1])
        apart = max(np.abs(ends).max(), np.abs(series["v"][-1] - series["v"][0]).max())
        return "" if apart < SAME else f"the ends of a period differ by {apart:.3g}"
    q, v = (asked.q0, np.zeros(asked.robot.nv)) if start is None else start
    apart = np.abs(asked.robot.difference(q, series["q"][0])).max()
    if not max(apart, np.abs(series["v"][0] - v).max()) < SAME:
        return f"{apart:.3g} away"
    return ""


def _goal(asked: Asked, series: Mapping[str, Array], goal: Array | None) -> str:
    robot, kind, q, v = asked.robot, asked.case["goal"], series["q"][-1], series["v"][-1]
    if goal is None and kind == "periodic":
        return ""
    if goal is None and kind in ("position", "pose", "axis"):
        here, wanted = (robot.frame_pose(robot.tip_frame, x) for x in (q, asked.q1))
        apart = np.abs(here - wanted)
        missed = {"position": apart[:3, 3], "pose": apart, "axis": apart[:3, 0]}[kind].max()
        return "" if missed < SAME else f"the frame misses its {kind} by {missed:.3g}"
    apart, speed = robot.difference(q, asked.q1 if goal is None else goal), v.copy()
    if goal is None and kind == "free":
        apart[-1] = speed[-1] = 0.0
    if goal is None and kind == "state":
        speed -= 0.125 * np.sign(asked.d)
    missed = max(np.abs(apart).max(), np.abs(speed).max())
    return "" if missed < SAME else f"missed by {missed:.3g}"


def _via(asked: Asked, motion: hovi.Trajectory) -> str:
    robot, kind = asked.robot, asked.case["via"]
    if kind == "none" or asked.case["goal"] in ("periodic", "segments"):
        return ""
    at = 0.5 * TIME  # a via point's time is one of the first duration asked for
    if asked.case["duration"] == "free":
        return ""
    q = motion.sample([at]).q[0]
    here, wanted = (robot.frame_position(robot.tip_frame, x) for x in (q, asked.middle))
    missed = np.abs(here - wanted).max()
    if kind == "configuration":
        missed = np.abs(robot.difference(q, asked.middle)).max()
    return "" if missed < SAME else f"missed by {missed:.3g}"


def over_limits(asked: Asked, series: Mapping[str, Array]) -> str:
    """Which limit samples of a motion exceed; "" if none."""
    for name, low, high in asked.bounds:
        limited = np.isfinite(high) & np.isfinite(low)
        low, high, given = low[limited], high[limited], series[name][:, limited]
        over = np.maximum(given - high, low - given).max(axis=0, initial=0.0) / (high - low)
        if over.max(initial=0.0) > LIMIT_SLACK:
            return f"{name} is over its limit by {over.max():.3g} of its range"
    return ""


def _torques(asked: Asked, series: Mapping[str, Array]) -> str:
    tau = series["tau"]
    largest = max(float(np.abs(tau).max()), 1e-3)
    if asked.case["robot"] == "passive":
        passive = np.abs(tau[:, 1]).max() / largest
        return "" if passive < 0.02 else f"a passive joint has {passive:.3g} of the largest"
    if asked.case["robot"] == "moving base" or asked.case["effect"] not in RIGID_ALONE:
        return ""
    model = asked.robot.model.copy()
    down = 0.0 if asked.case["effect"] == "nothing" else -9.81
    model.gravity.linear, model.armature = np.array([0.0, 0.0, down]), np.zeros(model.nv)
    data, some = model.createData(), slice(None, None, 20)
    jets = zip(series["q"][some], series["v"][some], series["a"][some], strict=True)
    expected = np.array([pin.rnea(model, data, *jet) for jet in jets])
    wrong = np.abs(tau[some] - expected).max() / largest
    return "" if wrong < 1e-8 else f"torques are off by {wrong:.3g} of the largest"
