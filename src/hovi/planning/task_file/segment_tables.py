"""[[segments]]: the segments of a sequence, checked against the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hovi.errors import InputError
from hovi.planning.problem.notation.ends import as_end
from hovi.planning.search.options import PlanOptions
from hovi.planning.sequence.segment import (
    Segment,
    checked_segments,
    duration_of_segment,
    names_of,
)
from hovi.planning.task_file.effect_tables import effect_table, read_effects
from hovi.planning.task_file.goal_tables import NO_GROUP, Begin, goal_value, read_goal
from hovi.planning.task_file.limit_tables import limits_value, read_limits
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.schema import SegmentTable, ShapedTable, TaskTable
from hovi.robot.robot import Robot

if TYPE_CHECKING:
    from hovi.conditions.kept.keep import Keep
    from hovi.planning.obstacles.grasped import Grasped


def check_keys(table: ShapedTable, toml: TomlText) -> None:
    """Raise SceneError unless a file has segments, or a duration and a goal, and not both."""
    for key in ("duration", "goal"):
        given = getattr(table, key) is not None
        if not given and not table.segments:
            expected = TaskTable.model_fields[key].description
            raise toml.error((), f"`{key}` is missing; it must be {expected}")
        if given and table.segments:
            raise toml.error(
                (key,), f"a file with [[segments]] takes no `{key}`: every segment has its own"
            )


def read_segments(
    tables: Sequence[SegmentTable], robot: Robot, toml: TomlText, begin: Begin = NO_GROUP
) -> list[Segment]:
    """The segments of a file, in its order. begin: as for `read_end`."""
    segments = [_read_segment(table, i, robot, toml, begin) for i, table in enumerate(tables)]
    try:
        checked_segments(segments, PlanOptions())
    except InputError as wrong:
        raise toml.error(("segments",), str(wrong)) from None
    return segments


def _read_segment(
    table: SegmentTable, number: int, robot: Robot, toml: TomlText, begin: Begin
) -> Segment:
    keys = ("segments", number)
    goal, limits = table.goal, table.limits
    try:
        duration = duration_of_segment(table.duration)
    except InputError as wrong:
        raise toml.error((*keys, "duration"), str(wrong)) from None
    return Segment(
        None if goal is None else read_goal(goal, (*keys, "goal"), robot, toml, begin),
        duration,
        effects=read_effects(table.effects, robot, toml, keys),
        limits=None if limits is None else read_limits(limits, robot, toml, (*keys, "limits")),
        keep=_kept(table, robot, toml, number),
        grasped=_grasped(table, toml, number),
        name=table.name,
    )


def _grasped(table: SegmentTable, toml: TomlText, number: int) -> tuple[Grasped, ...]:
    if not table.grasped:
        return ()
    from hovi.planning.task_file.grasped_tables import grasped_of  # most segments carry nothing

    return grasped_of(table.grasped, toml, ("segments", number))


def _kept(table: SegmentTable, robot: Robot, toml: TomlText, number: int) -> tuple[Keep, ...]:
    if not table.keep:
        return ()
    from hovi.planning.task_file.keep_tables import read_kept  # most segments keep nothing

    return read_kept(table.keep, robot, toml, ("segments", number))


def segments_value(segments: Sequence[Segment], robot: Robot) -> list[dict[str, Any]]:
    """The inverse of `read_segments`."""
    named = zip(names_of(segments), segments, strict=True)
    return [_segment_table(each, name, robot) for name, each in named]


def _segment_table(segment: Segment, name: str, robot: Robot) -> dict[str, Any]:
    """The table of a segment. name: of it in messages."""
    table: dict[str, Any] = {"name": segment.name} if segment.name else {}
    T = segment.duration
    table["duration"] = list(T) if isinstance(T, tuple) else T
    if segment.limits is not None:
        table["limits"] = limits_value(segment.limits, robot)
    if segment.goal is not None:
        table["goal"] = goal_value(as_end(segment.goal, robot, name), robot)
    if segment.keep:
        from hovi.planning.task_file.keep_tables import keep_table

        table["keep"] = [keep_table(each) for each in segment.keep]
    if segment.grasped:
        from hovi.planning.obstacles.grasped import as_grasped

        table["grasped"] = [each.to_dict() for each in as_grasped(segment.grasped)]
    if segment.effects:
        table["effects"] = {each.key: effect_table(each) for each in segment.effects}
    return table
