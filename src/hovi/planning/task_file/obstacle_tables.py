"""The tables [[obstacles]]."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hovi.errors import HoviError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.obstacles import obstacles_from_table
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.task_file.messages import TomlText
from hovi.robot.robot import Robot


def read_obstacles(
    tables: list[dict[str, Any]], clearance_options: Clearance, robot: Robot, toml: TomlText
) -> Sequence[Obstacle]:
    """The obstacles of a file, checked against the robot's shapes.

    clearance_options: margin and self-collision of the file.
    """
    obstacles = list[Obstacle]()
    for i, each in enumerate(tables):
        try:
            obstacles += obstacles_from_table(each, i, toml.path.parent)
        except HoviError as wrong:
            raise toml.error(("obstacles", i), str(wrong)) from None
    try:
        clearance = dataclasses.replace(clearance_options, obstacles=obstacles)
        if clearance.wanted:
            distances_between(robot, clearance)
    except HoviError as wrong:
        raise toml.error(("obstacles",), str(wrong)) from None
    return clearance.obstacles


def obstacle_table(obstacle: Obstacle, folder: Path | None) -> dict[str, Any]:
    """The table of an obstacle in a file of a folder; paths are relative to the folder.

    folder: None for the name of a file alone.
    """
    table = obstacle.to_dict()
    if "file" in table:
        file = Path(table["file"])
        table["file"] = file.name if folder is None else os.path.relpath(file, folder.resolve())
    return table
