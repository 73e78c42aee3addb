"""Reading a task file: TOML -> checked tables -> robot, scene and task."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from hovi.errors import HoviError, InputError, SceneError, SchemeError, nearest
from hovi.robot import Robot, load_robot
from hovi.scene import Scene
from hovi.schemes import by_name
from hovi.state import State
from hovi.task_file.effect_tables import read_effects
from hovi.task_file.limit_tables import read_limits
from hovi.task_file.schema import EndTable, TaskTable
from hovi.task_file.sentences import TomlText, first_sentence
from hovi.task_file.task import Task

Array = npt.NDArray[np.float64]


def load_task(path: str | Path) -> Task:
    """The task that a TOML file describes.

    path: the file; the paths in it are relative to its folder.
    Raises SceneError with the file, the line, the key, what was expected and what came, and
    ModelError when the robot cannot be loaded.
    """
    toml = _read_text(Path(path))
    table = _validated(toml)
    _check_names(table, toml)
    robot = _load_robot(table, toml)
    return Task(
        scene=Scene(robot, effects=read_effects(table.effects, robot, toml)),
        start=_read_end(table.start, "start", robot, toml),
        goal=_read_end(table.goal, "goal", robot, toml),
        duration=table.duration,
        scheme=table.scheme.name,
        intervals=table.scheme.intervals,
        starts=table.starts,
        seed=table.seed,
        limits=read_limits(table.limits, robot, toml),
        name=toml.path.stem,
    )


def _read_text(path: Path) -> TomlText:
    try:
        return TomlText(path, path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SceneError(f"there is no scene file {path}.") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path}: a scene file is UTF-8 text, and this is not.") from None
    except OSError as refused:
        raise SceneError(f"{path} cannot be read: {refused.strerror}.") from None


def _validated(toml: TomlText) -> TaskTable:
    try:
        data = tomllib.loads(toml.text)
    except RecursionError:
        raise SceneError(f"{toml.path}: lists or tables are nested too deeply.") from None
    except tomllib.TOMLDecodeError as invalid:
        raise SceneError(_syntax_sentence(toml, str(invalid))) from None
    except ValueError:
        raise SceneError(f"{toml.path}: a number has too many digits.") from None
    try:
        return TaskTable.model_validate(data)
    except ValidationError as invalid:
        raise first_sentence(invalid, TaskTable, toml) from None


def _syntax_sentence(toml: TomlText, reason: str) -> str:
    place = re.search(r" \(at line (\d+), column (\d+)\)$", reason)
    if place is None:
        return f"{toml.path} is not valid TOML: {reason.removesuffix('.')}."
    line, column = place.groups()
    return f"{toml.path}, line {line}, column {column}: not valid TOML: {reason[: place.start()]}."


def _check_names(table: TaskTable, toml: TomlText) -> None:
    """What can be refused before a robot is loaded."""
    try:
        by_name(table.scheme.name)
    except SchemeError as unknown:
        raise toml.error(("scheme", "name"), str(unknown)) from None


def _load_robot(table: TaskTable, toml: TomlText) -> Robot:
    folder = toml.path.parent
    is_file = table.robot.endswith(".urdf")
    try:
        return load_robot(
            folder / table.robot if is_file else table.robot,
            package_dirs=tuple(folder / each for each in table.package_dirs),
            free_flyer=table.free_flyer,
            locked=tuple(table.locked),
            srdf=None if table.srdf is None else folder / table.srdf,
        )
    except HoviError as refused:
        line = toml.line(("robot",))
        raise type(refused)(f"{toml.path}, line {line}: {refused}") from None


def _read_end(end: EndTable, name: str, robot: Robot, toml: TomlText) -> State:
    q = _configuration(end.q, name, robot, toml)
    v = end.v if not isinstance(end.v, dict) else _velocity(end.v, name, robot, toml)
    try:
        robot.check_configuration(q, f"{name}.q")
    except InputError as wrong:
        raise toml.error((name, "q"), str(wrong)) from None
    try:
        robot.check_velocity(np.zeros(robot.nv) if v is None else v, f"{name}.v")
    except InputError as wrong:
        raise toml.error((name, "v"), str(wrong)) from None
    return State(q, v)


def _configuration(
    given: list[float] | dict[str, Any] | str, end: str, robot: Robot, toml: TomlText
) -> list[float]:
    if isinstance(given, str):
        try:
            return [float(each) for each in robot.pose(given)]
        except HoviError as unknown:
            raise toml.error((end, "q"), str(unknown)) from None
    return given if isinstance(given, list) else _by_joint(given, end, robot, toml)


def _by_joint(by_joint: dict[str, Any], end: str, robot: Robot, toml: TomlText) -> list[float]:
    left_out = [joint for joint in robot.joint_names if joint not in by_joint]
    _check_joints(by_joint, (end, "q"), robot, toml)
    if left_out:
        raise toml.error((end, "q"), f"`{end}.q` leaves out joint {left_out[0]!r}")
    q: list[float] = []
    for joint in robot.joint_names:
        size = robot.model.joints[robot.model.getJointId(joint)].nq
        q += _numbers(by_joint[joint], size, (end, "q", joint), toml)
    return q


def _velocity(by_joint: dict[str, Any], end: str, robot: Robot, toml: TomlText) -> list[float]:
    """Joints that are left out stand still."""
    _check_joints(by_joint, (end, "v"), robot, toml)
    v: list[float] = []
    for joint in robot.joint_names:
        size = robot.model.joints[robot.model.getJointId(joint)].nv
        v += _numbers(by_joint.get(joint, [0.0] * size), size, (end, "v", joint), toml)
    return v


def _check_joints(
    by_joint: dict[str, Any], keys: tuple[str, ...], robot: Robot, toml: TomlText
) -> None:
    for joint in by_joint:
        if joint not in robot.joint_names:
            sentence = f"`{'.'.join(keys)}` names a joint {joint!r} that the robot does not have; "
            raise toml.error((*keys, joint), sentence + nearest(joint, robot.joint_names))


def _numbers(value: Any, size: int, keys: tuple[str, ...], toml: TomlText) -> list[float]:
    numbers = [float(each) for each in value] if isinstance(value, list) else [float(value)]
    if len(numbers) != size:
        expected = "one number" if size == 1 else f"{size} numbers"
        raise toml.error(keys, f"`{'.'.join(keys)}` must be {expected}, but it has {len(numbers)}")
    return numbers
