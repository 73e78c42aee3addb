"""A robot's file as a person types it, with the folders of its packages and its arguments."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hovi.errors import InputError

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

PackageDirs = Annotated[
    list[Path] | None,
    typer.Option("--package-dir", help="A folder of ROS packages; repeatable.", metavar="FOLDER"),
]
XacroArgs = Annotated[
    list[str] | None,
    typer.Option(
        "--xacro-arg", help="An argument of a xacro file; repeatable.", metavar="NAME:=VALUE"
    ),
]


def robot_of(
    robot: str,
    mimic: bool,
    free_flyer: bool,
    package_dirs: Sequence[Path],
    xacro_args: Sequence[str],
) -> Robot:
    """The robot of a file or a name. Raises InputError for an argument without `:=`."""
    from hovi.robot.loading import load_robot

    pairs = [each.partition(":=") for each in xacro_args]
    for given, (name, sign, _) in zip(xacro_args, pairs, strict=True):
        if not (name and sign):
            raise InputError(f"--xacro-arg takes NAME:=VALUE, such as name:=ur, not {given!r}.")
    return load_robot(
        robot,
        mimic=mimic,
        free_flyer=free_flyer or None,
        package_dirs=package_dirs,
        xacro_args={name: value for name, _, value in pairs},
    )
