"""The tables [[grasped]]."""

from __future__ import annotations

from hovi.errors import HoviError, InputError
from hovi.planning.clearance.obstacles import obstacle_from_dict
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
    given = {key: x for key, x in table.model_dump().items() if x is not None}
    try:
        shapes = given["shape"] if isinstance(given["shape"], list) else [given["shape"]]
        if not all(isinstance(each, dict) for each in shapes):
            raise InputError("`shape` must be a table such as an obstacle's, or a list of them.")
        return Grasped(**{**given, "shape": [obstacle_from_dict(each) for each in shapes]})
    except HoviError as wrong:
        raise toml.error(("grasped", number), f"object {table.name!r}: {wrong}") from None
