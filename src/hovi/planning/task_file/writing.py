"""Writing a task file that `load_task` reads back as the same task."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import tomlkit
from tomlkit.items import Table

from hovi.errors import SceneError
from hovi.planning.task_file.effect_tables import effect_table
from hovi.planning.task_file.goal_tables import goal_table, state_table, via_table
from hovi.planning.task_file.limit_tables import limits_value
from hovi.planning.task_file.task import Task
from hovi.robot.example_robots import example_robot
from hovi.robot.source import RobotSource
from hovi.robot.srdf import read_srdf_file
from hovi.system.files import reason, whole_file


def save_task(task: Task, path: str | Path) -> Path:
    """Write a task as TOML; returns the path.

    task: what to write.
    path: the file, replaced whole or not at all; its folder is made. The URDF of a robot that
        came from a file is written beside it when it is not there yet, its SRDF too.
    Raises SceneError when the robot has no file, or when another file of the same name is there.
    """
    path = Path(path)
    source = task.scene.robot.source
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _keep_robot_beside(source, path)
        _write(path, tomlkit.dumps(_document(task, path.parent)).encode("utf-8"))
    except OSError as refused:
        raise SceneError(f"{path} cannot be written: {reason(refused)}.") from None
    return path


def _document(task: Task, folder: Path) -> tomlkit.TOMLDocument:
    source = task.scene.robot.source
    document = tomlkit.document()
    document["robot"] = source.reference
    if source.locked:
        document["locked"] = list(source.locked)
    if source.package_dirs:
        document["package_dirs"] = _relative(source, folder)
    if _own_srdf(source) is not None:
        document["srdf"] = _srdf_name(source)
    if source.free_flyer:
        document["free_flyer"] = True
    if source.mimic:
        document["mimic"] = True
    if task.scene.passive:
        document["passive"] = list(task.scene.passive)
    free = isinstance(task.duration, tuple)
    document["duration"] = _floats(task.duration) if free else float(cast(float, task.duration))
    if task.time_weight:
        document["time_weight"] = float(task.time_weight)
    limits = limits_value(task.limits, task.scene.robot)
    if isinstance(limits, str):
        document["limits"] = limits
    document["starts"] = task.starts
    document["seed"] = task.seed
    if task.tolerance is not None:
        document["tolerance"] = task.tolerance
    if task.clearance.wanted:
        document["margin"] = float(task.clearance.margin)
        document["self_collision"] = task.clearance.self_collision
    if isinstance(limits, dict):
        document["limits"] = _table(limits)
    document["start"] = _table(state_table(task.start, task.scene.robot, "start"))
    document["goal"] = _table(goal_table(task.goal, task.scene.robot))
    if task.via:
        tables = tomlkit.aot()
        for via in task.via:
            tables.append(_table(via_table(via, task.scene.robot)))
        document["via"] = tables
    if task.clearance.obstacles:
        obstacles = tomlkit.aot()
        for obstacle in task.clearance.obstacles:
            obstacles.append(_table(obstacle.to_dict()))
        document["obstacles"] = obstacles
    document["scheme"] = _table({"name": task.scheme, "intervals": task.intervals})
    if task.scene.effects:
        effects = tomlkit.table(is_super_table=True)
        for effect in task.scene.effects:
            effects[effect.key] = _table(effect_table(effect))
        document["effects"] = effects
    return document


def _table(values: dict[str, Any]) -> Table:
    table = tomlkit.table()
    for key, value in values.items():
        table[key] = value
    return table


def _floats(values: npt.ArrayLike) -> list[float]:
    return [float(each) for each in np.asarray(values)]


def _relative(source: RobotSource, folder: Path) -> list[str]:
    """Package folders as a file in `folder` names them."""
    return [os.path.relpath(each, folder.resolve()) for each in source.package_dirs]


def _keep_robot_beside(source: RobotSource, path: Path) -> None:
    if source.kind == "model":
        raise SceneError(
            "a robot given as a pinocchio.Model has no file that a task file can name; "
            "load it from a URDF to save the task."
        )
    if source.kind == "urdf" and source.urdf is not None:
        _keep_beside(path.parent / Path(source.reference).name, source.urdf, "URDF")
    srdf = _own_srdf(source)
    if srdf is not None:
        _keep_beside(path.parent / _srdf_name(source), srdf, "SRDF")


def _keep_beside(file: Path, text: str, what: str) -> None:
    content = text.encode("utf-8")
    if not file.exists():
        _write(file, content)
    elif file.read_bytes() != content:
        raise SceneError(f"{file} is another {what} than the task's; choose another folder.")


def _own_srdf(source: RobotSource) -> str | None:
    """The text of the SRDF, unless it is the one that comes with an example robot."""
    if source.kind == "example" and source.srdf is not None:
        theirs = example_robot(source.reference).srdf
        return None if theirs and read_srdf_file(theirs) == source.srdf else source.srdf
    return source.srdf


def _srdf_name(source: RobotSource) -> str:
    return f"{Path(source.reference).stem}.srdf"


def _write(path: Path, content: bytes) -> None:
    with whole_file(path) as stream:
        stream.write(content)
