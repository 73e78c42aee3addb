"""The tables [[obstacles]]."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from hovi.errors import HoviError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.obstacles import Obstacle, obstacle_from_dict
from hovi.planning.task_file.messages import TomlText
from hovi.robot.robot import Robot


def read_obstacles(
    tables: list[dict[str, Any]], clearance_options: Clearance, robot: Robot, toml: TomlText
) -> Sequence[Obstacle]:
    """The obstacles of a file, checked against the robot's shapes.

    clearance_options: margin and self-collision of the file.
    """
    obstacles = [_obstacle(each, i, toml) for i, each in enumerate(tables)]
    try:
        clearance = dataclasses.replace(clearance_options, obstacles=obstacles)
        if clearance.wanted:
            distances_between(robot, clearance)
    except HoviError as wrong:
        raise toml.error(("obstacles",), str(wrong)) from None
    return clearance.obstacles


def _obstacle(table: dict[str, Any], number: int, toml: TomlText) -> Obstacle:
    try:
        return obstacle_from_dict(table)
    except HoviError as wrong:
        name = table.get("name") or f"number {number + 1}"
        raise toml.error(("obstacles", number), f"obstacle {name!r}: {wrong}") from None
