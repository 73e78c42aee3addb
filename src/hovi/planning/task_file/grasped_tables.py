"""The tables [[grasped]]."""

from __future__ import annotations

from hovi.errors import HoviError
from hovi.planning.obstacles.grasped import Grasped, as_grasped, holding, robot_holding
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.schema import GraspedTable, SegmentTable
from hovi.robot.robot import Robot


def read_grasped(
    tables: list[GraspedTable], robot: Robot, toml: TomlText
) -> tuple[tuple[Grasped, ...], Robot]:
    """The objects of a file, and the robot that holds them."""
    held = grasped_of(tables, toml)
    try:
        return held, holding(robot, held) if held else robot
    except HoviError as wrong:
        raise toml.error(("grasped",), str(wrong)) from None


def grasped_of(
    tables: list[GraspedTable], toml: TomlText, keys: tuple[str | int, ...] = ()
) -> tuple[Grasped, ...]:
    """The objects of tables. keys: of the table that they are in."""
    objects = [_grasped(each, i, toml, (*keys, "grasped")) for i, each in enumerate(tables)]
    try:
        return as_grasped(objects)
    except HoviError as wrong:
        raise toml.error((*keys, "grasped"), str(wrong)) from None


def robot_carrying(tables: list[SegmentTable], robot: Robot, toml: TomlText) -> Robot:
    """The robot with the links of what segments carry. robot: with what it holds all along."""
    found = dict[str, Grasped]()
    for number, table in enumerate(tables):
        keys = "segments", number
        for each in grasped_of(table.grasped, toml, keys):
            try:
                if each.name not in found:
                    robot = robot_holding(robot, (each,), massless=True)
            except HoviError as wrong:
                raise toml.error((*keys, "grasped"), str(wrong)) from None
            found.setdefault(each.name, each)
    return robot


def _grasped(
    table: GraspedTable, number: int, toml: TomlText, keys: tuple[str | int, ...]
) -> Grasped:
    try:
        return Grasped(**{key: x for key, x in table.model_dump().items() if x is not None})
    except HoviError as wrong:
        key = ("mass",) if str(wrong).startswith("the mass") else ()
        raise toml.error((*keys, number, *key), str(wrong)) from None
