"""Reading a scene file: TOML -> validated tables -> robot, scene and task."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from hovi.checks.arguments import check_arguments
from hovi.checks.units import as_duration
from hovi.errors import HoviError, InputError, SceneError, SchemeError
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.obstacles.preparation import prepared_within
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.search.options import INTERVALS_TWICE, TOLERANCE_AND_SCHEME, PlanOptions
from hovi.planning.sequence.segment import duration_of
from hovi.planning.task_file.effect_tables import read_effects
from hovi.planning.task_file.goal_tables import Begin, read_end, read_goal, read_via
from hovi.planning.task_file.limit_tables import read_limits
from hovi.planning.task_file.messages import TomlText, first_sentence
from hovi.planning.task_file.scene_cache import (
    MOTION_KEYS,
    ROBOT_KEYS,
    SCENE_KEYS,
    SceneCache,
    chosen,
    others,
)
from hovi.planning.task_file.schema import FORMAT, PLAIN, SchemeTable, ShapedTable, TaskTable
from hovi.planning.task_file.segment_tables import check_keys, read_segments
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import shipped_urdf
from hovi.robot.formats.recognized import require_untrusted
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from hovi.system.files import reason, require_file

if TYPE_CHECKING:
    from hovi.conditions.kept.keep import Keep
    from hovi.planning.obstacles.grasped import Grasped

MAX_BYTES = 2_000_000
"""Maximum size of a scene file."""
MAX_DOTS = 1_000
"""Maximum number of dots in a line; parsing time is quadratic in the parts of a dotted key."""


@check_arguments
def load_task(path: str | Path) -> Task:
    """The task of a scene file.

    path: the file; paths in it are relative to its folder.
    Raises SceneError with file, line, key, expected and given value, and ModelError if the robot
    cannot be loaded.
    """
    toml = read_toml(Path(path))
    return task_of(parsed(toml), toml)


def task_of(data: Mapping[str, Any], toml: TomlText, cache: SceneCache | None = None) -> Task:
    """The task of a scene file's table, which may differ from its text in some values.

    data: as TOML has it. toml: the text, for the lines in messages, and the path, to which others
        are relative.
    cache: of what is built, to be used for one folder only.
    Raises as load_task does.
    """
    table = _validated(data, toml)
    _check_scheme(table, toml)
    check_keys(table, toml)
    kept, name = SceneCache() if cache is None else cache, toml.path.stem
    robot = kept.get("robot", chosen(data, ROBOT_KEYS), lambda: _load_robot(table, toml))
    grasped, held = kept.get(
        "grasped",
        chosen(data, (*ROBOT_KEYS, "grasped")),
        lambda: _grasped(table, robot, toml),
    )
    scene = kept.get("scene", chosen(data, SCENE_KEYS), lambda: _scene(table, robot, toml))
    start = read_end(table.start, ("start",), held, toml)
    begin, note = Begin(table.group, start), _note(table, robot, toml)
    if table.segments:
        held = _carrying(table, held, toml)
        segments = read_segments(table.segments, held, toml, begin)
        whole = duration_of(segments)
        options = _options(table, whole, held, grasped, toml)
        task = Task.of_segments(scene, start, segments, options, name)
        return dataclasses.replace(task, note=note)
    assert table.goal is not None
    duration = _duration(table.duration, toml)
    goal = read_goal(table.goal, ("goal",), held, toml, begin)
    without = MOTION_KEYS[:2] if table.via else MOTION_KEYS  # via points are before its end
    options = kept.get(
        "options",
        others(data, without),
        lambda: _options(table, duration, held, grasped, toml),
    )
    return Task(scene, start, goal, duration, options, name, note=note)


def _options(
    table: ShapedTable,
    duration: float | tuple[float, float],
    robot: Robot,
    grasped: tuple[Grasped, ...],
    toml: TomlText,
) -> PlanOptions:
    """The options of a file: single values unchanged, the others from their tables.

    robot: with what it holds.
    """
    plain = {name: getattr(table, name) for name in PLAIN}
    if may_touch(table):
        plain["self_collision"] = False
    try:
        options = PlanOptions(**plain, grasped=grasped)
    except InputError as wrong:
        key = next((name for name in PLAIN if _is_about(wrong, name)), "")
        raise toml.error((key,), str(wrong)) from None
    tolerance = _read_tolerance(table.tolerance, robot, toml)
    scheme = _scheme(table)
    if tolerance is not None and scheme.name is not None:
        raise toml.error(("tolerance",), TOLERANCE_AND_SCHEME.removesuffix("."))
    return options.with_changes(
        via=read_via(table.via, duration, robot, toml),
        scheme=scheme.name,
        intervals=scheme.intervals,
        limits=read_limits(table.limits, robot, toml),
        keep=_kept(table, robot, toml),
        obstacles=_obstacles(table, options, robot, toml),
        tolerance=tolerance,
        group=table.group,
    )


def may_touch(table: ShapedTable) -> bool:
    """Whether links of a file may meet since it is of format 1 and says nothing of it."""
    return table.format == 1 and getattr(table, "self_collision", None) is None


def _note(table: ShapedTable, robot: Robot, toml: TomlText) -> str:
    """What is assumed of a file of format 1 whose robot has collision shapes; "" for others."""
    from hovi.planning.clearance.self_collisions import can_keep_apart, names_shapes  # 10 ms

    if not (may_touch(table) and names_shapes(robot) and can_keep_apart(robot)):
        return ""
    return (
        f"{toml.path.name} has no `format`, so links may meet, as in format 1: write `format = "
        f"{FORMAT}` to keep them apart, or self_collision = false."
    )


def _is_about(wrong: InputError, option: str) -> bool:
    """Whether an error is about an option."""
    return str(wrong).startswith((option, f"`{option}`", f"there is no {option} "))


def _obstacles(
    table: ShapedTable, options: PlanOptions, robot: Robot, toml: TomlText
) -> Sequence[Obstacle]:
    if not table.obstacles and not options.clearance.wanted:
        return ()
    from hovi.planning.task_file.obstacle_tables import read_obstacles  # most tasks have none

    try:
        with prepared_within(options.time_limit_seconds):
            return read_obstacles(table.obstacles, options.clearance, robot, toml)
    except InputError as late:
        raise toml.error(("obstacles",), str(late)) from None


def _kept(table: ShapedTable, robot: Robot, toml: TomlText) -> tuple[Keep, ...]:
    if not table.keep:
        return ()
    from hovi.planning.task_file.keep_tables import read_kept  # most motions keep nothing

    return read_kept(table.keep, robot, toml)


def _grasped(table: ShapedTable, robot: Robot, toml: TomlText) -> tuple[tuple[Grasped, ...], Robot]:
    """What the robot holds, and the robot that holds it."""
    if not table.grasped:
        return (), robot
    from hovi.planning.task_file.grasped_tables import read_grasped  # most robots hold nothing

    return read_grasped(table.grasped, robot, toml)


def _carrying(table: ShapedTable, robot: Robot, toml: TomlText) -> Robot:
    """The robot with the links of what segments carry."""
    if not any(each.grasped for each in table.segments):
        return robot
    from hovi.planning.task_file.grasped_tables import robot_carrying  # most carry nothing

    return robot_carrying(table.segments, robot, toml)


def _scene(table: ShapedTable, robot: Robot, toml: TomlText) -> Scene:
    effects = read_effects(table.effects, robot, toml)
    try:
        return Scene(robot, effects=effects, passive=table.passive, begin=table.begin)
    except SceneError as wrong:
        raise toml.error(("passive",), str(wrong)) from None


def _duration(given: Any, toml: TomlText) -> float | tuple[float, float]:
    """A duration in [s], or the bounds of a free one."""
    try:
        return as_duration(given)
    except InputError as wrong:
        raise toml.error(("duration",), str(wrong)) from None


def read_toml(path: Path) -> TomlText:
    """The text of a scene file. Raises SceneError."""
    try:
        require_file(path, MAX_BYTES)
        return TomlText(path, path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SceneError(f"there is no scene file {path}.") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path} is not UTF-8 text, as a scene file must be.") from None
    except OSError as refused:
        raise SceneError(f"{path} cannot be read: {reason(refused)}.") from None


def parsed(toml: TomlText) -> dict[str, Any]:
    """The table of a TOML file. Raises SceneError, with the line, for text that is no TOML."""
    for number, line in enumerate(toml.text.splitlines(), start=1):
        if line.count(".") > MAX_DOTS:
            raise SceneError(
                f"{toml.path}, line {number}: more than {MAX_DOTS:,} dots in one line."
            )
    try:
        return tomllib.loads(toml.text)
    except RecursionError:
        raise SceneError(f"{toml.path}: lists or tables are nested too deeply.") from None
    except tomllib.TOMLDecodeError as invalid:
        raise SceneError(_syntax_sentence(toml, str(invalid))) from None
    except ValueError:
        raise SceneError(f"{toml.path}: a number has too many digits.") from None


def _validated(data: Mapping[str, Any], toml: TomlText) -> ShapedTable:
    try:
        return TaskTable.model_validate(data)
    except ValidationError as invalid:
        raise first_sentence(invalid, TaskTable, toml) from None


def _syntax_sentence(toml: TomlText, reason: str) -> str:
    if toml.path.suffix.lower() != ".toml":
        return (
            f'a scene file ends in .toml and names its robot, such as robot = "arm.urdf", but '
            f"{toml.path.name!r} is no TOML; `hovi info` describes a robot."
        )
    place = re.search(r" \(at line (\d+), column (\d+)\)$", reason)
    if place is None:
        return f"{toml.path} is not valid TOML: {reason.removesuffix('.')}."
    line, column = place.groups()
    return f"{toml.path}, line {line}, column {column}: not valid TOML: {reason[: place.start()]}."


def _check_scheme(table: ShapedTable, toml: TomlText) -> None:
    """Check the scheme, before the robot is loaded."""
    scheme = _scheme(table)
    if table.intervals is not None and scheme.intervals != table.intervals:
        raise toml.error(("intervals",), INTERVALS_TWICE)
    if scheme.name is None:
        return
    try:
        by_name(scheme.name)
    except SchemeError as unknown:
        raise toml.error(("scheme", "name"), str(unknown)) from None


def _scheme(table: ShapedTable) -> SchemeTable:
    """The table [scheme], also where its keys are given by themselves."""
    scheme = table.scheme if isinstance(table.scheme, SchemeTable) else None
    if scheme is None:
        return SchemeTable(name=str(table.scheme), intervals=table.intervals)
    if scheme.intervals is None:
        return SchemeTable(name=scheme.name, intervals=table.intervals)
    return scheme


def _load_robot(table: ShapedTable, toml: TomlText) -> Robot:
    folder = toml.path.parent
    is_file = table.robot.endswith(".urdf")
    try:
        require_untrusted(table.robot)
        return load_robot(
            _urdf(folder, table.robot) if is_file else table.robot,
            package_dirs=tuple(folder / each for each in table.package_dirs),
            free_flyer=table.free_flyer,
            mimic=table.mimic,
            locked=table.locked,
            tools=table.tools,
            srdf=None if table.srdf is None else folder / table.srdf,
        )
    except HoviError as refused:
        line = toml.line(("robot",))
        raise type(refused)(f"{toml.path}, line {line}: {refused}") from None


def _urdf(folder: Path, name: str) -> Path:
    """The URDF of a scene file; where it is missing, the one of this name that ships with hovi.

    So a copy of a scene that ships with hovi can be planned from any folder.
    """
    path, shipped = folder / name, shipped_urdf(name)
    return path if shipped is None or path.exists() else shipped


def _read_tolerance(given: Any, robot: Robot, toml: TomlText) -> float | str | None:
    if given is None:
        return None
    try:
        Tolerance.of(given, robot)
    except InputError as wrong:
        raise toml.error(("tolerance",), str(wrong).removesuffix(".")) from None
    return given if isinstance(given, str) else float(given)
