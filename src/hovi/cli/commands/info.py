"""`hovi info`: describe a robot or a scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from hovi.cli.arguments.robots import (
    FreeFlyer,
    JsonObject,
    Mimic,
    PackageDirs,
    Srdf,
    XacroArgs,
    robot_of,
)

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot


def info(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="ROBOT|SCENE.toml|FILE.npz",
            help="A .urdf or .xacro, a name of example-robot-data, a scene file, a shipped "
            "scene's name or a motion; without it, all names are listed.",
        ),
    ] = None,
    mimic: Mimic = False,
    free_flyer: FreeFlyer = False,
    package_dir: PackageDirs = None,
    xacro_arg: XacroArgs = None,
    srdf: Srdf = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="List what will hurt instead, with the lines to write."),
    ] = False,
    kept: Annotated[
        bool,
        typer.Option("--kept", help="Plan a scene without each condition that it keeps instead."),
    ] = False,
    json: JsonObject = False,
) -> None:
    """Describe a robot, a scene and the effects that it leaves out, or a motion.

    With --check the exit code is 1 if something stops a plan, and 0 otherwise. With --kept a table
    says what each table [[keep]] of a scene costs in effort, steps and time.
    """
    from hovi.errors import InputError, nearest
    from hovi.robot.bundled_models import example_scenes
    from hovi.robot.example_robots import example_names
    from hovi.robot.formats.recognized import format_of
    from hovi.robot.loading import is_path

    robots, scenes = example_names(), example_scenes()
    if json and not check:
        raise InputError("--json is for --check: hovi info ROBOT --check --json.")
    if check and (what is None or what.lower().endswith(".npz")):
        raise InputError("what will hurt is asked of a robot: give its file or name, or a scene.")
    if kept and (what is None or not (what.lower().endswith(".toml") or what in scenes)):
        raise InputError("what is kept is asked of a scene: hovi info SCENE.toml --kept.")
    if kept:
        _kept(str(what))
    elif what is None:
        print(_listed("robots of example-robot-data", robots))
        print(_listed("scenes that ship with hovi", scenes))
    elif what.lower().endswith(".toml") or what in scenes:
        _scene(what, check, json)
    elif what.lower().endswith(".npz"):
        print(_motion(what))
    elif is_path(what) or what in robots or format_of(what) == "description":
        robot = robot_of(what, mimic, free_flyer, package_dir or (), xacro_arg or (), srdf)
        if check:
            _examine(robot, json)
        print(robot.describe())
    else:
        raise InputError(
            f"there is no robot or scene {what!r}; {nearest(what, (*robots, *scenes))} "
            "(A path ends in .urdf, .toml or .npz.)"
        )


def _listed(title: str, names: Sequence[str]) -> str:
    import textwrap

    lines = textwrap.fill(", ".join(sorted(names)), 80, initial_indent="  ", subsequent_indent="  ")
    return f"{title}:\n{lines}\n"


def _scene(scene: str, check: bool, json: bool) -> None:
    from hovi.cli.arguments.files import find_scene
    from hovi.cli.reports.task import describe_task
    from hovi.planning.task_file.reading import load_task

    task = load_task(find_scene(scene))
    if check:
        _examine(task.scene.robot, json, task.scene.model)
    print(describe_task(task))


def _kept(scene: str) -> None:
    from hovi.accuracy.kept_study import COLUMNS, kept_rows, kept_study
    from hovi.cli.arguments.files import find_scene
    from hovi.cli.reports.terminal_table import print_table
    from hovi.planning.task_file.reading import load_task
    from hovi.system.progress import progress

    with progress(quiet=False, doing="reading the scene") as report:
        task = load_task(find_scene(scene))
        trials = kept_study(task, report)
    print_table(COLUMNS, kept_rows(trials), task.name, [0, 5])
    if trials[0].fixed_by:
        print(f"grid     of all of them last refined for {trials[0].fixed_by}")


def _examine(robot: Robot, json: bool, model: pin.Model | None = None) -> NoReturn:
    """Print what will hurt about a robot, and exit. model: with the rotors of a scene."""
    import json as json_text

    from hovi.cli.reports.findings import findings_json, findings_of, print_findings, stops

    found = findings_of(robot, model)
    if json:
        print(json_text.dumps(findings_json(robot, found)))
    else:
        print_findings(robot, found)
    raise typer.Exit(1 if stops(found) else 0)


def _motion(file: str) -> str:
    from hovi.cli.arguments.files import load_trajectory
    from hovi.cli.reports.segments import span_text
    from hovi.discrete.measures.motion_segments import motion_segments
    from hovi.discrete.output.caution import caution_lines

    motion = load_trajectory(Path(file))
    segments = [f"segment {span_text(each)}" for each in motion_segments(motion)]
    cautions = [f"caution: {each}" for each in caution_lines([motion.metadata])]
    return "\n".join([repr(motion), *segments, *cautions])
