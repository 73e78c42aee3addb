"""The tables [[obstacles]]."""

from __future__ import annotations

import dataclasses
import inspect
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hovi.errors import HoviError, InputError, nearest
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.obstacles import obstacle_from_dict
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.obstacle_files import load_obstacles
from hovi.planning.task_file.messages import TomlText
from hovi.robot.loading import as_names
from hovi.robot.robot import Robot


def read_obstacles(
    tables: list[dict[str, Any]], clearance_options: Clearance, robot: Robot, toml: TomlText
) -> Sequence[Obstacle]:
    """The obstacles of a file, checked against the robot's shapes.

    clearance_options: margin and self-collision of the file.
    """
    obstacles = [x for i, each in enumerate(tables) for x in _obstacles(each, i, toml)]
    try:
        clearance = dataclasses.replace(clearance_options, obstacles=obstacles)
        if clearance.wanted:
            distances_between(robot, clearance)
    except HoviError as wrong:
        raise toml.error(("obstacles",), str(wrong)) from None
    return clearance.obstacles


def _obstacles(table: dict[str, Any], number: int, toml: TomlText) -> Sequence[Obstacle]:
    """The obstacle of a table, or those of the file that it names."""
    if isinstance(table.get("file"), str):
        table = {**table, "file": str(toml.path.parent / table["file"])}
    try:
        if table.get("kind") == "file":
            return _from_file(table, toml.path.parent)
        return (obstacle_from_dict(table, "file"),)
    except HoviError as wrong:
        name = table.get("name") or f"number {number + 1}"
        raise toml.error(("obstacles", number), f"obstacle {name!r}: {wrong}") from None


def _from_file(table: dict[str, Any], folder: Path) -> Sequence[Obstacle]:
    """Raises HoviError for unknown keys, and as load_obstacles."""
    known = inspect.signature(load_obstacles).parameters
    given = {key: value for key, value in table.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"obstacles of a file have no `{key}`: {nearest(key, known)}")
    if "file" not in given:
        raise InputError("obstacles of a file need `file`.")
    folders = as_names(given.get("package_dirs", ()))
    given["package_dirs"] = [folder / each for each in folders]
    return load_obstacles(**given)


def obstacle_table(obstacle: Obstacle, folder: Path) -> dict[str, Any]:
    """The table of an obstacle in a file of a folder; paths are relative to the folder."""
    table = obstacle.to_dict()
    if "file" in table:
        table["file"] = os.path.relpath(table["file"], folder.resolve())
    return table
