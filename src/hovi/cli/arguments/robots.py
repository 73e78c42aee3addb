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

Mimic = Annotated[bool, typer.Option("--mimic", help="Apply the <mimic> tags of the URDF.")]
FreeFlyer = Annotated[bool, typer.Option("--free-flyer", help="Give the robot a floating base.")]
Srdf = Annotated[
    Path | None, typer.Option("--srdf", help="An SRDF of the robot.", metavar="FILE.srdf")
]
JsonObject = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def robot_of(
    robot: str,
    mimic: bool,
    free_flyer: bool,
    package_dirs: Sequence[Path],
    xacro_args: Sequence[str],
    srdf: Path | None = None,
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
        srdf=srdf,
        xacro_args={name: value for name, _, value in pairs},
    )
