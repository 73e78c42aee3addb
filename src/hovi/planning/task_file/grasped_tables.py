"""The tables [[grasped]]."""

from __future__ import annotations

from hovi.errors import HoviError
from hovi.planning.obstacles.grasped import Grasped, as_grasped, holding
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.schema import GraspedTable
from hovi.robot.robot import Robot


def read_grasped(
    tables: list[GraspedTable], robot: Robot, toml: TomlText
) -> tuple[tuple[Grasped, ...], Robot]:
    """The objects of a file, and the robot that holds them."""
    objects = [_grasped(each, i, toml) for i, each in enumerate(tables)]
    try:
        held = as_grasped(objects)
        return held, holding(robot, held) if held else robot
    except HoviError as wrong:
        raise toml.error(("grasped",), str(wrong)) from None


def _grasped(table: GraspedTable, number: int, toml: TomlText) -> Grasped:
    try:
        return Grasped(**{key: x for key, x in table.model_dump().items() if x is not None})
    except HoviError as wrong:
        key = ("mass",) if str(wrong).startswith("the mass") else ()
        raise toml.error(("grasped", number, *key), str(wrong)) from None
