"""A report of a motion in one file: replay, curves, peaks, certificate, effects and scene."""

from __future__ import annotations

import base64
import dataclasses
import html
import io
import json
import os
from collections.abc import Iterator
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.conditions.excess import excess_along
from hovi.discrete.measures.motion_effort import effort_of
from hovi.discrete.measures.motion_extremes import extremes
from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, HoviError
from hovi.flows.execution.dynamics_replay import DynamicsReplay, replay_dynamics
from hovi.planning.clearance.clearance_violation import closest_along
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import KINDS
from hovi.planning.task_file.motion_task import task_of_motion
from hovi.planning.task_file.writing import task_text
from hovi.scene.scene import Scene
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.files import reason, whole_file
from hovi.version import __version__
from hovi.viewing.curves.given_motion import motion_in
from hovi.viewing.documents.motion_peaks import NO_LIMIT, QUANTITIES, Peak, motion_peaks
from hovi.viewing.plotting import motion_figure
from hovi.viewing.recorded_limits import (
    imposed_clearance,
    kept_distances,
    led_back_sentence,
    recorded_limits,
    segment_limits,
)
from hovi.viewing.replay_session import page_of

if TYPE_CHECKING:
    from hovi.planning.solver.solver import Solution

Array = npt.NDArray[np.float64]
Row = tuple[str, ...]

_FRAME = Path(__file__).with_name("report.html")
_SAMPLES = 401
_SECONDS = 30.0
_HASH_SALT = "hovi"  # so that the same motion gives the same picture
_SCENE_HEAD = (
    "# The scene of this motion, for hovi plan; its ends are joints, but for the goal of a frame.\n"
)
_MAX_SCENE = 60_000  # [characters]


@check_arguments_except("trajectory")
def write_report(trajectory: Trajectory | Solution, path: str | os.PathLike[str]) -> None:
    """Write one HTML file about a motion that needs no network, for somebody without hovi.

    It replays the motion, and shows its curves, the peaks of each joint next to their limits, what
    was recorded of its solution, what is checked now (a simulation of its torques, its margins),
    what each effect of the scene contributes to the torques, a scene file, and the versions. The
    same motion gives the same bytes.

    path: the file; it is written completely or not at all. Raises DisplayError.
    """
    trajectory = motion_in(trajectory)
    text = report_html(trajectory)
    try:
        with whole_file(path) as stream:
            stream.write(text.encode())
    except OSError as error:
        raise DisplayError(f"cannot write the report {str(path)!r}: {reason(error)}.") from error


def report_html(trajectory: Trajectory) -> str:
    """The text of the report."""
    page = page_of(trajectory)
    versions = trajectory.metadata.get("versions")
    planned = (
        "" if not isinstance(versions, dict) else ", ".join(f"{k} {v}" for k, v in versions.items())
    )
    footer = f"Written by hovi {__version__}." + (f" Planned with {planned}." if planned else "")
    return Template(_FRAME.read_text(encoding="utf-8")).substitute(
        title=html.escape(page.title),
        summary=html.escape(_summary(trajectory)),
        cautions=_cautions(trajectory),
        page=html.escape(page.offline_html()),
        curves=_curves(trajectory),
        peaks=_peaks(trajectory),
        certificate=_table(tuple(_certificate(trajectory))),
        effects=_effects(trajectory),
        scene=html.escape(_scene(trajectory)),
        footer=html.escape(footer),
    )


def _summary(trajectory: Trajectory) -> str:
    data, robot, grid = trajectory.metadata, trajectory.robot, trajectory.grid
    name = "a robot" if robot is None else robot.name
    schemes = " and ".join(dict.fromkeys(scheme.name for scheme, _ in grid.groups))
    parts = [
        f"A motion of {name} in {trajectory.duration:g} s, by {schemes} on {grid.intervals} "
        f"{'interval' if grid.intervals == 1 else 'intervals'}."
    ]
    if "status" in data:
        parts.append(f"Status: {data['status']}.")
    return " ".join(parts)


def _cautions(trajectory: Trajectory) -> str:
    """A list of them; "" without any."""
    lines = caution_lines([trajectory.metadata])
    items = "".join(f"<li>{html.escape(each)}</li>" for each in lines)
    return f"<ul id='cautions'>{items}</ul>" if items else ""


def _curves(trajectory: Trajectory) -> str:
    stream = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": _HASH_SALT}):
        motion_figure(trajectory).savefig(stream, format="svg", metadata={"Date": None})
    return base64.b64encode(stream.getvalue()).decode()


def _certificate(trajectory: Trajectory) -> Iterator[Row]:
    """What was recorded when the motion was planned, and what is checked now."""
    data = trajectory.metadata
    recorded = {
        "cost": "cost (discrete action)",
        "error_estimate": "estimated error of the cost, relative",
        "n_neg": "negative eigenvalues of the Hessian (0 at a minimum)",
    }
    for key, label in recorded.items():
        value = data.get(key)
        if isinstance(value, int | float):
            yield label, f"{value:.10g}"
    effort = effort_of(trajectory)
    if effort is not None:
        yield "effort, 1/2 integral of the squared torques", f"{effort:.10g}"
    yield "torques simulated again", _replayed(trajectory)
    found = extremes(trajectory)
    for name, each in (("acceleration", found.acceleration), ("jerk", found.jerk)):
        yield f"largest {name}", f"{each.value:.4g} {each.unit} at {each.joint}, {each.t:.3g} s"
    yield from _margins(trajectory)


def _replayed(trajectory: Trajectory) -> str:
    """What a simulation of the torques from each node misses at the next one."""
    try:
        with Deadline(_SECONDS).in_force():
            replay: DynamicsReplay = replay_dynamics(trajectory)
    except (HoviError, OutOfTimeError) as error:
        return f"none: {str(error).removesuffix('.')}"
    misses = f"{replay.frame} by {1e3 * replay.largest_tip:.1e} mm"
    if not replay.sliding.all():
        misses = f"{replay.angle:.1e} rad, {misses}"
    return (
        "Boost's odeint on Pinocchio's ABA, from every node, misses the next by "
        f"{misses}: this certifies dynamics and torques, not optimality"
    )


def _margins(trajectory: Trajectory) -> Iterator[Row]:
    limits, kept = recorded_limits(trajectory), kept_distances(trajectory)
    names = trajectory.metadata.get("conditions")
    if isinstance(names, list) and names:
        known = ", ".join(str(each) for each in names)
        yield "conditions", f"{known}: a saved motion knows their names, and not their bounds"
    if limits is None:
        yield "limits", "none were imposed"
    else:
        for each in limits.conditions:
            sides = excess_along(trajectory, each)
            joint = int(np.argmax(sides.max(axis=(0, 1))))
            percent = f"{-100 * float(sides.max()):.2g} % of the range"
            yield f"margin to the limits on {each.name}", f"{percent}, at {each.of[joint]}"
        if limits.excused:
            yield "start", led_back_sentence(trajectory)
        margin = closeness(trajectory, limits)
        whose = "limits" if "limits" in trajectory.metadata else "loosest limits of any segment"
        for k, kind in enumerate(KINDS[: len(margin)]):
            if np.isfinite(margin[k]).any():
                joint = int(np.argmin(margin[k]))
                percent = f"{100 * float(margin[k, joint]):.2g} % of the range"
                yield (
                    f"margin to the {whose} on {kind}",
                    (f"{percent}, at {trajectory.coordinate_names[joint]}"),
                )
    if kept is not None:
        clearance, distances = kept
        found = closest_along(trajectory, distances, clearance.margin)
        least = float((found.distance - distances.allowance).min())
        yield "least distance", f"{least:.4g} m (margin {clearance.margin:g} m)"


def _effects(trajectory: Trajectory) -> str:
    """What each effect adds to the torques along the motion; the description for segments."""
    scene = trajectory.scene
    if scene is None:
        parts = trajectory.segments
        texts = [] if parts is None else [_description(each) for each in parts.scenes]
        return "".join(f"<pre>{html.escape(each)}</pre>" for each in dict.fromkeys(texts))
    rows: list[Row] = [("effect", "root mean square of its torques", "largest", "at")]
    for each in scene.effects:
        rows.append((each.key, *_contribution(trajectory, scene, each.key)))
    description = f"<pre>{html.escape(_description(scene))}</pre>"
    note = (
        "<p>The torques of the motion less those that the same motion would take without the "
        "effect.</p>"
    )
    return (note + _table(tuple(rows), True) if scene.effects else "") + description


def _description(scene: Scene) -> str:
    """What a scene simulates and leaves out, without measured times."""
    return scene.describe().partition("\nderivatives:")[0]


def _contribution(trajectory: Trajectory, scene: Scene, key: str) -> Row:
    """Root mean square, largest value, and where it is, of the torques of one effect."""
    t = np.linspace(0.0, trajectory.duration, _SAMPLES)
    try:
        bare = dataclasses.replace(trajectory, scene=scene.without(key))
        difference: Array = trajectory.sample(t).tau - bare.sample(t).tau
    except HoviError as error:
        return "", "", str(error)
    k, joint = np.unravel_index(np.argmax(np.abs(difference)), difference.shape)
    name = trajectory.coordinate_names[int(joint)]
    unit = "N" if scene.robot.sliding[int(joint)] else "N m"
    return (
        f"{np.sqrt(np.mean(difference**2)):.4g}",
        f"{abs(difference[k, joint]):.4g} {unit}",
        f"{name}, {t[k]:.3g} s",
    )


def _peaks(trajectory: Trajectory) -> str:
    """A table by quantity, of each segment."""
    segments = motion_peaks(trajectory)
    whose = "the motion was planned within" if segments[0].imposed else "of the URDF, not imposed"
    parts = [
        f"<p>The largest value of each joint, and when; limits are those {whose}. The margin is "
        "the least distance from them, in percent of their range; a yellow row is at a limit.</p>"
    ]
    for each in segments:
        if each.name:
            parts.append(f"<h3>{html.escape(f'{each.name}, {each.begin:.4g} to {each.end:.4g} s')}")
            parts.append("</h3>")
        tables = [_peak_table(QUANTITIES[q], peaks) for q, peaks in each.peaks.items()]
        parts.append(f"<div class='peaks'>{''.join(tables)}</div>")
    return "".join(parts)


def _peak_table(title: str, peaks: tuple[Peak, ...]) -> str:
    """Joints, peaks and times, and limits where there are any; one unit of all is in the title."""
    units = {each.unit for each in peaks}
    title += f" [{units.pop()}]" if len(units) == 1 else ""
    limited = any(np.isfinite(each.margin) for each in peaks)
    title += "" if limited else ", without limits"
    columns = ("joint", "peak", "at [s]", "limit", "margin")[: 5 if limited else 3]
    rows = []
    for each in peaks:
        unit = f" {each.unit}" if units else ""
        texts = [f"{each.value:.4g}{unit}", f"{each.t:.3f}"]
        if limited:
            margin = "" if np.isinf(each.margin) else f"{100 * each.margin + 0.0:.1f} %"
            texts += [each.limit + unit * (each.limit != NO_LIMIT), margin]
        cells = "".join(f"<td class='number'>{html.escape(text)}</td>" for text in texts)
        mark = " class='limit'" if each.at_limit else ""
        rows.append(f"<tr{mark}><td>{html.escape(each.joint)}</td>{cells}</tr>")
    head = "".join(f"<th>{each}</th>" for each in columns)
    return f"<table><caption>{html.escape(title)}</caption><tr>{head}</tr>{''.join(rows)}</table>"


def _scene(trajectory: Trajectory) -> str:
    """A scene file of the motion; what is recorded of its scenes where there can be none."""
    try:
        return _scene_file(trajectory)[:_MAX_SCENE]
    except HoviError as error:
        shown = [f"# no scene file: {error}"]
    for each in trajectory.scenes:
        data = each.to_dict()
        data["robot"] = each.robot.name  # its file has a section of its own in the motion
        shown.append(json.dumps(data, indent=2, default=str))
    return "\n".join(dict.fromkeys(shown))[:_MAX_SCENE]


def _scene_file(trajectory: Trajectory) -> str:
    limits, parts = recorded_limits(trajectory), segment_limits(trajectory)
    task = task_of_motion(trajectory, limits, parts, imposed_clearance(trajectory))
    names = trajectory.metadata.get("conditions")
    left_out = [str(each) for each in names] if isinstance(names, list) else []
    note = f"# Without its conditions: {', '.join(left_out)}.\n" if left_out else ""
    return _SCENE_HEAD + note + task_text(task)


def _table(rows: tuple[Row, ...], head: bool = False) -> str:
    lines = []
    for k, row in enumerate(rows):
        tag = "th" if head and k == 0 else "td"
        cells = "".join(f"<{tag}>{html.escape(each)}</{tag}>" for each in row)
        lines.append(f"<tr>{cells}</tr>")
    return "\n".join(lines) if not head else f"<table>{''.join(lines)}</table>"
