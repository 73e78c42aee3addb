"""Writing a task file that `load_task` reads back as the same task."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from hovi.checks.arguments import check_arguments
from hovi.errors import SceneError, SchemeError
from hovi.planning.problem.tolerance import as_number_or_text
from hovi.planning.search.option_fields import option_infos
from hovi.planning.search.options import PlanOptions
from hovi.planning.task_file.effect_tables import effect_table
from hovi.planning.task_file.goal_tables import end_table, goal_value, via_table
from hovi.planning.task_file.limit_tables import limits_value
from hovi.planning.task_file.obstacle_tables import obstacle_table
from hovi.planning.task_file.schema import FORMAT, PLAIN
from hovi.planning.task_file.segment_tables import segments_value
from hovi.planning.task_file.task import Task
from hovi.robot.example_robots import example_robot
from hovi.robot.source import RobotSource
from hovi.robot.srdf import read_srdf_file
from hovi.schemes import by_name
from hovi.system.files import make_folders, reason, whole_file

_TABLES = (
    "tools",
    "limits",
    "start",
    "goal",
    "segments",
    "via",
    "keep",
    "obstacles",
    "grasped",
    "scheme",
)
"""Keys that may hold tables, in the order in which the tables are written."""
_EMPTY: tuple[Any, ...] = (None, [], {})


@check_arguments
def save_task(task: Task, path: str | Path) -> Path:
    """Write a task as TOML; returns the path.

    path: the file, which is replaced atomically; its folder is created. The URDF and the SRDF of
        a robot that was loaded from files are written next to it unless they exist.
    Raises SceneError if the robot has no file, if a different file of that name exists, or for an
    option that scene files have no key for.
    """
    path = Path(path)
    content = task_text(task, path.parent).encode("utf-8")
    try:
        make_folders(path.parent)
        _keep_robot_beside(task.scene.robot.source, path)
        _write(path, content)
    except OSError as refused:
        raise SceneError(f"{path} cannot be written: {reason(refused)}.") from None
    return path


def task_text(task: Task, folder: Path | None = None) -> str:
    """A task as TOML. Raises SceneError for an option that scene files have no key for.

    folder: that of the file, to which paths are relative; None for the names of files alone, as for
        readers on another machine.
    """
    return tomlkit.dumps(_document(task, folder))


def _document(task: Task, folder: Path | None) -> tomlkit.TOMLDocument:
    """The task as TOML, in which tables come after plain keys."""
    robot = task.scene.robot
    keys = {
        "format": FORMAT,
        **_robot_keys(task, folder),
        "duration": None if task.segments else _duration(task.duration),
        **_option_keys(task, folder),
        "start": end_table(task.start, robot, "start"),
        "goal": None if task.segments else goal_value(task.goal, robot),
        "segments": segments_value(task.segments, robot),
    }
    plain = {key: value for key, value in keys.items() if not _is_table(value)}
    tables = {key: keys[key] for key in _TABLES if _is_table(keys.get(key))}
    document = tomlkit.document()
    for key, value in (plain | tables).items():
        if value not in _EMPTY:
            document[key] = _item(value)
    if task.scene.effects:
        effects = tomlkit.table(is_super_table=True)
        for effect in task.scene.effects:
            effects[effect.key] = _item(effect_table(effect))
        document["effects"] = effects
    return document


def _robot_keys(task: Task, folder: Path | None) -> dict[str, Any]:
    """The robot, how it is loaded, and which of its joints are passive."""
    source = task.scene.robot.source
    return {
        "robot": source.reference,
        "locked": _locked(source),
        "package_dirs": _relative(source, folder),
        "srdf": None if _own_srdf(source) is None else _srdf_name(source),
        "free_flyer": _free_flyer(source),
        "mimic": source.mimic or None,
        "tools": {each.name: each.to_dict() for each in source.tools},
        "passive": list(task.scene.passive),
        "begin": float(task.scene.begin) or None,
    }


def _free_flyer(source: RobotSource) -> bool | None:
    """Whether the base floats, unless that is the default."""
    floats = source.kind == "example" and example_robot(source.reference).free_flyer
    return None if source.free_flyer == floats else source.free_flyer


def _locked(source: RobotSource) -> Any:
    """The names of the locked joints, or a table in one line with their positions."""
    if not source.locked_at:
        return list(source.locked)
    table = tomlkit.inline_table()
    table.update(source.held)
    return table


def _option_keys(task: Task, folder: Path | None) -> dict[str, Any]:
    """The options by key: single values by their own rule, and those with a special form."""
    options, robot = task.options, task.scene.robot
    plain = {name: _plain(name, options) for name in PLAIN}
    shaped = {
        "limits": limits_value(options.limits, robot),
        "tolerance": as_number_or_text(options.tolerance),
        "via": [via_table(each, robot) for each in options.via],
        "keep": _kept(options),
        "obstacles": [obstacle_table(each, folder) for each in options.obstacles],
        "grasped": [each.to_dict() for each in options.grasped],
        "scheme": _scheme_table(options),
        "intervals": None,
        "group": options.group,
    }
    keys = plain | shaped
    for name in option_infos(PlanOptions):
        if name not in keys and not _is_default(name, options):
            raise SceneError(
                f"scene files have no key for option {name!r}: pass it to hovi.plan_task, and save "
                "the task without it."
            )
    return {name: keys[name] for name in option_infos(PlanOptions) if name in keys}


def _kept(options: PlanOptions) -> list[dict[str, Any]]:
    if not options.keep:
        return []
    from hovi.planning.task_file.keep_tables import keep_table  # most motions keep nothing

    return [keep_table(each) for each in options.keep]


def _plain(name: str, options: PlanOptions) -> Any:
    """The value to be written; None to leave the key out."""
    key, default = PLAIN[name], getattr(PlanOptions, name)
    named = not _is_default(name, options) if key.written is None else key.written(options)
    if not named:
        return None
    value = getattr(options, name)
    if name == "guess" and not isinstance(value, str):
        raise SceneError(
            "scene files have no key for a motion as option 'guess': pass it to hovi.plan_task, "
            "and save the task without it."
        )
    return value if default is None else type(default)(value)


def _is_default(name: str, options: PlanOptions) -> bool:
    value, default = getattr(options, name), getattr(PlanOptions, name)
    return value is default or (isinstance(value, str | float | int) and value == default)


def _scheme_table(options: PlanOptions) -> dict[str, Any]:
    """The table [scheme], with what is named. Raises SceneError for a custom scheme."""
    table = {"name": _scheme_name(options), "intervals": options.intervals}
    return {key: value for key, value in table.items() if value is not None}


def _scheme_name(options: PlanOptions) -> str | None:
    """The name of the scheme, if one is named. Raises SceneError for a custom scheme."""
    if options.scheme is None:
        return None
    name = options.scheme_name
    try:
        known = by_name(name).key == options.table.key
    except SchemeError:
        known = False
    if not known:
        raise SceneError(
            f"scene files cannot store the custom scheme {name!r}: pass it to hovi.plan_task, and "
            "save the task without it."
        )
    return name


def _duration(duration: float | tuple[float, float]) -> float | list[float]:
    return [float(each) for each in duration] if isinstance(duration, tuple) else float(duration)


def _is_table(value: Any) -> bool:
    """Whether TOML stores a value as a table or an array of tables."""
    if isinstance(value, InlineTable):
        return False
    return isinstance(value[0] if isinstance(value, list) and value else value, dict)


def _item(value: Any) -> Any:
    """A value as a TOML item."""
    if not _is_table(value):
        return value
    if isinstance(value, list):
        tables = tomlkit.aot()
        for each in value:
            tables.append(_item(each))
        return tables
    table = tomlkit.table()
    for key, each in value.items():
        table[key] = each
    return table


def _relative(source: RobotSource, folder: Path | None) -> list[str]:
    """Package folders relative to `folder`; none without one."""
    if folder is None:
        return []
    return [os.path.relpath(each, folder.resolve()) for each in source.package_dirs]


def _keep_robot_beside(source: RobotSource, path: Path) -> None:
    if source.kind == "model":
        raise SceneError(
            "a robot from a pinocchio.Model has no file to which a scene file can refer; load it "
            "from a URDF to save the task."
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
        raise SceneError(
            f"{file} exists and differs from the task's {what}; choose another folder."
        )


def _own_srdf(source: RobotSource) -> str | None:
    """The text of the SRDF, unless it is that of an example robot."""
    if source.kind == "example" and source.srdf is not None:
        shipped = example_robot(source.reference).srdf
        return None if shipped and read_srdf_file(shipped) == source.srdf else source.srdf
    return source.srdf


def _srdf_name(source: RobotSource) -> str:
    return f"{Path(source.reference).stem}.srdf"


def _write(path: Path, content: bytes) -> None:
    with whole_file(path) as stream:
        stream.write(content)
