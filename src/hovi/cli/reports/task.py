"""The text of `hovi info SCENE.toml`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hovi.discrete.state import State
    from hovi.planning.problem.frame_goal import FrameGoal
    from hovi.planning.problem.limits import Limits
    from hovi.planning.task_file.task import Task
    from hovi.robot.robot import Robot


def describe_task(task: Task) -> str:
    """Describe the boundary states, the scheme, the scene and the robot of a task."""
    from hovi.cli.reports.arm_limits import limit_set_of, source_lines
    from hovi.conditions.kept.kinds import as_kept
    from hovi.planning.problem.notation.objective import describe_objective
    from hovi.planning.problem.tolerance import as_number_or_text

    robot, options = task.scene.robot, task.options
    how = f"{options.scheme_name} on {options.interval_count} intervals"
    if not options.names_grid:
        how = f"tolerance {as_number_or_text(options.effective_tolerance)}"
    lines = [f"task {task.name!r}: {_duration(task)}, {how}"]
    lines.append(
        f"starts {options.starts}, seed {options.seed}, limits {_limits(task.options.limits)}"
    )
    if options.repeat > 1:
        lines.append(f"repeat {options.repeat}: the motion runs this cycle {options.repeat} times")
    if options.objective != "effort":
        lines.append(describe_objective(task.scene, options.objective))
    if options.smooth:
        lines.append("smooth: with a cost on the jerk, see the effect jerk_cost")
    arm = limit_set_of(task)
    if arm is not None:
        lines += [f"limits of a {arm.title}, published in", *source_lines(arm)]
    for each in options.grasped:
        lines.append(f"holds {each.name!r}, {each.mass:g} kg, at {each.frame!r}")
    lines += [f"keeps {each.describe()}" for each in as_kept(options.keep)]
    lines += _kept_from(task)
    lines += _end(task.start, "start", robot)
    lines += _segments(task) if task.segments else _end(task.goal, "goal", robot)
    for via in options.via:
        lines += [
            f"via at {via.time:g} s:" if via.timed else "via at a free time:",
            *(f"  {x}" for x in _end(via.goal, "via", robot)),
        ]
    return "\n".join([*lines, "", task.planned_scene.describe(), "", robot.describe()])


def _segments(task: Task) -> list[str]:
    """The segments: when they end, where, and what is theirs alone."""
    from hovi.checks.units import in_words
    from hovi.conditions.kept.kinds import as_kept
    from hovi.planning.obstacles.grasped import as_grasped
    from hovi.planning.problem.notation.ends import as_end
    from hovi.planning.sequence.segment import duration_of_segment, names_of

    robot, lines, end = task.scene.robot, [], 0.0
    free = isinstance(task.duration, tuple)
    for name, each in zip(names_of(task.segments), task.segments, strict=True):
        line = f"segment {name!r}: {in_words(duration_of_segment(each.duration))}"
        if not free:
            begin, end = end, end + each.seconds
            line += f", from {begin:g} to {end:g} s"
        lines.append(line)
        own = [effect.describe() for effect in each.effects]
        own += [f"keeps {kept.describe()}" for kept in as_kept(each.keep)]
        own += [
            f"carries {x.name!r}, {x.mass:g} kg, at {x.frame!r}" for x in as_grasped(each.grasped)
        ]
        if each.limits is not None:
            own.append(f"limits {_limits(each.limits)}")
        where = ["goal: none, where the best motion passes"]
        if each.goal is not None:
            where = _end(as_end(each.goal, robot, "goal"), "goal", robot)
        lines += [f"  {line}" for line in (*own, *where)]
    return lines


def _duration(task: Task) -> str:
    """The duration, with its weight if it is free."""
    from hovi.checks.units import in_words

    priced = isinstance(task.duration, tuple)
    weight = f", {task.options.time_weight:g} per second" if priced else ""
    return in_words(task.duration) + weight


def _end(goal: State | FrameGoal, name: str, robot: Robot) -> list[str]:
    """The conditions at one end of the motion, one per line."""
    from hovi.planning.problem.frame_goal import FrameGoal

    if isinstance(goal, FrameGoal):
        parts = ((f"{name}: frame {x.frame!r}", *_frame_parts(x)) for x in goal.parts)
        return [line for part in parts for line in part]
    q, v = goal.on(robot, name)
    lines = [f"{name} q = {_numbers(q)}", f"{name} v = {_numbers(v)}"]
    angles = goal.angles_on(robot)
    for i in np.flatnonzero(~np.isnan(angles)):
        lines.append(f"{name} angle of {robot.coordinate_names[i]} = {angles[i]:g} rad")
    if goal.a is not None:
        lines.append(f"{name} a = {_numbers(np.asarray(goal.a, dtype=float))}")
    for key in ("free", "free_velocity", "free_acceleration"):
        if getattr(goal, key):
            lines.append(f"{name} {key} = {', '.join(getattr(goal, key))}")
    return lines


def _frame_parts(goal: FrameGoal) -> list[str]:
    parts = []
    if goal.position is not None:
        parts.append(f"  position {_numbers(np.asarray(goal.position))} m")
    if goal.rotation is not None:
        parts += [f"  rotation {_numbers(row)}" for row in np.asarray(goal.rotation)]
    if goal.directions is not None:
        inner, world = (_numbers(each) for each in goal.directions)
        parts.append(f"  its axis {inner} along {world}")
    for key in ("within", "within_angle", "box_frame", "velocity", "angular_velocity"):
        if getattr(goal, key) is not None:
            parts.append(f"  {key} {getattr(goal, key)}")
    return parts


def _kept_from(task: Task) -> list[str]:
    """What is kept at a distance: obstacles, and "itself" where links are; or why links are not."""
    from hovi.planning.clearance.self_collisions import not_looked_at  # 10 ms

    options, robot = task.options, task.planned_scene.robot
    apart = bool(options.decided(robot).self_collision)
    why = "" if apart or options.self_collision is not None else not_looked_at(robot)
    names = [repr(each.name) for each in options.clearance.obstacles]
    kept_from = ", ".join(names + (["itself"] if apart else []))
    lines = [f"keeps {options.clearance.margin:g} m from {kept_from}"] if kept_from else []
    return [*lines, why] if why else lines


def _limits(limits: str | Limits | Mapping[str, Any]) -> str:
    from hovi.planning.problem.limits import Limits

    if isinstance(limits, str):
        return limits
    if isinstance(limits, Limits):
        return "given"
    given = [f"{key} = {value}" for key, value in limits.items() if key != "base"]
    return "; ".join([limits.get("base", "urdf"), *given])


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{each:.6g}" for each in values) + "]"
