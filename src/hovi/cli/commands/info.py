"""`hovi info`: describe a robot or a scene."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from hovi.cli.arguments.robots import PackageDirs, XacroArgs, robot_of


def info(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="ROBOT|SCENE.toml|FILE.npz",
            help="A .urdf or .xacro, a name of example-robot-data, a scene file, a shipped "
            "scene's name or a motion; without it, all names are listed.",
        ),
    ] = None,
    mimic: Annotated[
        bool, typer.Option("--mimic", help="Apply the <mimic> tags of the URDF.")
    ] = False,
    free_flyer: Annotated[
        bool, typer.Option("--free-flyer", help="Give the robot a floating base.")
    ] = False,
    package_dir: PackageDirs = None,
    xacro_arg: XacroArgs = None,
) -> None:
    """Describe a robot, a scene and the effects that it leaves out, or a motion."""
    from hovi.errors import InputError, nearest
    from hovi.robot.bundled_models import example_scenes
    from hovi.robot.example_robots import example_names
    from hovi.robot.formats.recognized import format_of
    from hovi.robot.loading import is_path

    robots, scenes = example_names(), example_scenes()
    if what is None:
        print(_listed("robots of example-robot-data", robots))
        print(_listed("scenes that ship with hovi", scenes))
    elif what.lower().endswith(".toml") or what in scenes:
        print(_scene(what))
    elif what.lower().endswith(".npz"):
        print(_motion(what))
    elif is_path(what) or what in robots or format_of(what) == "description":
        print(robot_of(what, mimic, free_flyer, package_dir or (), xacro_arg or ()).describe())
    else:
        raise InputError(
            f"there is no robot or scene {what!r}; {nearest(what, (*robots, *scenes))} "
            "(A path ends in .urdf, .toml or .npz.)"
        )


def _listed(title: str, names: Sequence[str]) -> str:
    import textwrap

    lines = textwrap.fill(", ".join(sorted(names)), 80, initial_indent="  ", subsequent_indent="  ")
    return f"{title}:\n{lines}\n"


def _scene(scene: str) -> str:
    from hovi.cli.arguments.files import find_scene
    from hovi.cli.reports.task import describe_task
    from hovi.planning.task_file.reading import load_task

    return describe_task(load_task(find_scene(scene)))


def _motion(file: str) -> str:
    from hovi.cli.arguments.files import load_trajectory
    from hovi.discrete.output.caution import caution_lines

    motion = load_trajectory(Path(file))
    lines = caution_lines([motion.metadata])
    return "\n".join([repr(motion), *(f"caution: {each}" for each in lines)])
