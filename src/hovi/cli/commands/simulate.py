"""`hovi simulate`: the motion of a scene without torques, or under the torques of a plan."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hovi.flows.execution.tracking import Tracking
    from hovi.flows.simulator import Simulation
    from hovi.planning.task_file.task import Task


def simulate(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    plan: Annotated[
        Path | None,
        typer.Option(metavar="F.npz", help="A motion whose torques are applied."),
    ] = None,
    feedback: Annotated[
        str,
        typer.Option(metavar="none|pd|computed-torque", help="Feedback towards the plan."),
    ] = "none",
    bandwidth: Annotated[float, typer.Option(help="Of the feedback, in rad/s.")] = 10.0,
    duration: Annotated[
        str | None, typer.Option(metavar="SECONDS", help="Override the scene's.")
    ] = None,
    intervals: Annotated[
        int | None,
        typer.Option(help="Steps; default: 100 per second, or 400 with a plan."),
    ] = None,
    inner_modes: Annotated[int, typer.Option(help="R, for a scheme of order 2 (R + 1).")] = 1,
    out: Annotated[Path | None, typer.Option(metavar="F.npz", help="Path of the motion.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Simulate a scene with a variational integrator, without torques or under those of a plan.

    Exit code 0, or 2 for invalid input.
    """
    from hovi.cli.arguments.files import check_output, find_scene
    from hovi.errors import InputError
    from hovi.planning.task_file.reading import load_task
    from hovi.system.progress import progress

    if out is not None:
        check_output(out, ".npz")
    if plan is not None and duration is not None:
        raise InputError(
            "--duration cannot be combined with --plan, which has its own duration; leave one out."
        )
    if plan is None and feedback != "none":
        raise InputError("--feedback needs a plan to track; give one with --plan F.npz.")
    with progress(quiet=json, doing="reading the scene"):
        task = load_task(find_scene(scene))
    task.require_one_motion("a simulation")
    with progress(quiet=json, doing="simulating"):
        if plan is None:
            motion = _simulate(task, duration, intervals, inner_modes)
            report = _report(task, motion, out)
        else:
            tracking = _track(task, plan, feedback, bandwidth, intervals, inner_modes)
            motion = tracking.simulation
            report = _report(task, motion, out) | _deviation(tracking, plan, feedback, bandwidth)
    if out is not None:
        motion.trajectory.save(out)
    if json:
        from json import dumps

        print(dumps(report))
    else:
        _print(report, motion)


def _simulate(
    task: Task, duration: str | None, intervals: int | None, inner_modes: int
) -> Simulation:
    import math

    from hovi.cli.arguments.durations import positive_seconds
    from hovi.flows.simulator import simulate as simulate_motion

    longest = max(task.duration) if isinstance(task.duration, tuple) else task.duration
    T = longest if duration is None else positive_seconds("--duration", duration)
    N = max(1, math.ceil(100 * T)) if intervals is None else intervals
    return simulate_motion(
        task.held_scene, task.start_state, T, intervals=N, inner_modes=inner_modes
    )


def _track(
    task: Task,
    plan: Path,
    feedback: str,
    bandwidth: float,
    intervals: int | None,
    inner_modes: int,
) -> Tracking:
    from hovi.cli.arguments.files import load_trajectory
    from hovi.flows.execution.tracking import play

    return play(
        task.held_scene,
        load_trajectory(plan),
        feedback,
        bandwidth=bandwidth,
        intervals=intervals,
        inner_modes=inner_modes,
    )


def _report(task: Task, motion: Simulation, out: Path | None) -> dict[str, Any]:
    from hovi.cli.reports.simulation import exceeded_limits

    energy, (driven, resisted) = motion.energy, motion.work
    balance = energy - energy[0] - driven - resisted
    return {
        "scene": task.name,
        "duration": float(motion.t[-1]),
        "intervals": len(motion.t) - 1,
        "order": motion.order,
        "q": motion.q[-1].tolist(),
        "positions": motion.trajectory.positions(float(motion.t[-1]))[0].tolist(),
        "v": motion.v[-1].tolist(),
        "energy": float(energy[0]),
        "energy_end": float(energy[-1]),
        "work_of_torques": float(driven[-1]),
        "work_of_effects": float(resisted[-1]),
        "energy_error": float(abs(balance).max()),
        "limits_passed": [asdict(each) for each in exceeded_limits(motion)],
        "out": None if out is None else str(out),
    }


def _deviation(tracking: Tracking, plan: Path, feedback: str, bandwidth: float) -> dict[str, Any]:
    joints, tip = abs(tracking.joint_deviation), tracking.tip_distance
    return {
        "plan": str(plan),
        "feedback": feedback,
        "bandwidth": None if feedback == "none" else bandwidth,
        "tip_deviation_end": float(tip.largest[-1]),
        "tip_deviation_max": float(tip.largest.max()),
        "tip_frame_end": tip.frame_at(-1),
        "tip_frame_max": tip.frame,
        "joint_deviation_end": joints[-1].tolist(),
        "joint_deviation_max": joints.max(axis=0).tolist(),
        "joint_units": [units.q for units in tracking.simulation.scene.robot.coordinate_units],
        "feedback_torque_max": abs(tracking.feedback_torque).max(axis=0).tolist(),
    }


def _print(report: dict[str, Any], motion: Simulation) -> None:
    from hovi.cli.reports.simulation import end_state, exceeded_limits, limits_sentence, print_end

    drive = f"playing {report['plan']}" if "plan" in report else "no torques"
    print(f"{report['scene']}: {report['duration']:g} s in {report['intervals']} steps", end="")
    print(f" of order {report['order']}, {drive}")
    print_end(end_state(motion))
    print(
        f"energy {report['energy']:.9g} J to {report['energy_end']:.9g} J: torques "
        f"{report['work_of_torques']:+.6g} J, effects {report['work_of_effects']:+.6g} J, "
        f"balanced to {report['energy_error']:.2g} J"
    )
    exceeded = exceeded_limits(motion)
    if exceeded:
        print(limits_sentence(exceeded))
    if "plan" in report:
        _print_deviation(report, [units.tau for units in motion.scene.robot.coordinate_units])
    if report["out"] is not None:
        print(f"wrote {report['out']}")


def _print_deviation(report: dict[str, Any], efforts: list[str]) -> None:
    units = report["joint_units"]
    if report["bandwidth"] is not None:
        peak = _with_units(report["feedback_torque_max"], efforts)
        print(f"feedback: {report['feedback']} of {report['bandwidth']:g} rad/s, at most {peak}")
    print(
        f"{report['tip_frame_end']} is off by {1e3 * report['tip_deviation_end']:.4g} mm at the "
        f"end, {report['tip_frame_max']} by {1e3 * report['tip_deviation_max']:.4g} mm at most"
    )
    print(f"joints at the end: {_with_units(report['joint_deviation_end'], units)}")
    print(f"joints at most:    {_with_units(report['joint_deviation_max'], units)}")


def _with_units(values: list[float], units: list[str]) -> str:
    """Values with their units; a common unit is written once."""
    if len(set(units)) == 1:
        return f"{_list(values)} {units[0]}"
    return "[" + ", ".join(f"{x:.4g} {unit}" for x, unit in zip(values, units, strict=True)) + "]"


def _list(values: list[float]) -> str:
    return "[" + ", ".join(f"{each:.4g}" for each in values) + "]"
