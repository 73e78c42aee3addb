"""The tables [[obstacles]], and the keys `margin` and `self_collision`."""

from __future__ import annotations

from typing import Any

from hovi.errors import HoviError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.obstacles import Obstacle, obstacle_from_dict
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.schema import TaskTable
from hovi.robot.robot import Robot


def read_clearance(table: TaskTable, robot: Robot, toml: TomlText) -> Clearance:
    """What the motion keeps away from, checked against the robot's shapes."""
    obstacles = [_obstacle(each, i, toml) for i, each in enumerate(table.obstacles)]
    try:
        clearance = Clearance(obstacles, table.margin, table.self_collision)
        if clearance.wanted:
            distances_between(robot, clearance)
    except HoviError as wrong:
        raise toml.error(("obstacles",), str(wrong)) from None
    return clearance


def _obstacle(table: dict[str, Any], number: int, toml: TomlText) -> Obstacle:
    try:
        return obstacle_from_dict(table)
    except HoviError as wrong:
        name = table.get("name") or f"number {number + 1}"
        raise toml.error(("obstacles", number), f"obstacle {name!r}: {wrong}") from None
