"""`hovi simulate`: how a scene moves by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def simulate(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or a shipped scene's name."),
    ],
    duration: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Instead of the scene's.")
    ] = None,
    intervals: Annotated[
        int | None, typer.Option(help="Steps; 100 a second when not given.")
    ] = None,
    inner_modes: Annotated[int, typer.Option(help="R; the order is 2 (R + 1).")] = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="F.npz", help="Where the motion is written.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Simulate a scene from its start, without torques, by a variational integrator.

    Exit code 0, or 2 for bad input.
    """
    import math

    from hovi.cli.files import check_output, find_scene
    from hovi.errors import InputError
    from hovi.simulator import simulate as simulate_motion
    from hovi.task_file import load_task

    if out is not None:
        check_output(out, ".npz")
    task = load_task(find_scene(scene))
    longest = max(task.duration) if isinstance(task.duration, tuple) else task.duration
    T = longest if duration is None else duration
    if not 0 < T < math.inf:
        raise InputError(f"--duration must be a positive number of seconds, not {T}.")
    N = max(1, math.ceil(100 * T)) if intervals is None else intervals
    motion = simulate_motion(task.scene, task.start, T, intervals=N, inner_modes=inner_modes)
    energy = motion.energy
    if out is not None:
        motion.trajectory.save(out)
    report = {
        "scene": task.name,
        "duration": T,
        "intervals": N,
        "order": 2 * (inner_modes + 1),
        "q": motion.q[-1].tolist(),
        "v": motion.v[-1].tolist(),
        "energy": float(energy[0]),
        "energy_error": float(abs(energy - energy[0]).max()),
        "out": None if out is None else str(out),
    }
    _print(report, json)


def _print(report: dict[str, object], json: bool) -> None:
    if json:
        from json import dumps

        print(dumps(report))
        return
    print(f"{report['scene']}: {report['duration']} s in {report['intervals']} steps", end="")
    print(f" of order {report['order']}, no torques")
    print(f"end: q = {report['q']}, v = {report['v']}")
    print(f"energy {report['energy']:.9g} J, kept to {report['energy_error']:.2g} J")
    if report["out"] is not None:
        print(f"written to {report['out']}")
