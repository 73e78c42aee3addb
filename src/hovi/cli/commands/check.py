"""`hovi check`: planned torques played back in another simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    simulator: Annotated[
        str, typer.Option("--in", metavar="NAME", help="The simulator: mujoco.")
    ] = "mujoco",
    step: Annotated[float, typer.Option(help="Longest time step, in seconds.")] = 1e-4,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Play the planned torques back in another simulator, without feedback.

    The exit code is 0 if every joint stays within 1e-3 rad or m of the plan, 1 if not.
    """
    import json as json_text

    from hovi.cli.arguments.files import load_trajectory
    from hovi.cli.reports.playback import playback_json, print_playback
    from hovi.errors import InputError, nearest
    from hovi.exchange.mujoco_check import replay_in_mujoco

    if simulator != "mujoco":
        raise InputError(f"there is no simulator {simulator!r}: {nearest(simulator, ['mujoco'])}")
    played = replay_in_mujoco(load_trajectory(file), step)
    if json:
        print(json_text.dumps(playback_json(played)))
    else:
        print_playback(played)
    raise typer.Exit(0 if played.success else 1)
