"""`hovi doctor`: what will hurt about a robot's file, as `hovi info --check`."""

from __future__ import annotations

from typing import Annotated

import typer

from hovi.cli.arguments.robots import FreeFlyer, JsonObject, Mimic, PackageDirs, Srdf, XacroArgs


def doctor(
    what: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT|SCENE.toml",
            help="A .urdf or .xacro, a name of example-robot-data, or a scene for its robot.",
        ),
    ],
    mimic: Mimic = False,
    free_flyer: FreeFlyer = False,
    package_dir: PackageDirs = None,
    xacro_arg: XacroArgs = None,
    srdf: Srdf = None,
    json: JsonObject = False,
) -> None:
    """List what will hurt about a robot's file, the worst first, with the lines to write.

    The exit code is 1 if one of these stops a plan, and 0 otherwise.
    """
    from hovi.cli.commands.info import info

    info(what, mimic, free_flyer, package_dir, xacro_arg, srdf, check=True, json=json)
