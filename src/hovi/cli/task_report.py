"""The text of `hovi info SCENE.toml`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hovi.task_file import Task


def describe_task(task: Task) -> str:
    """The ends, the scheme, the scene and the robot of a task."""
    robot = task.scene.robot
    lines = [
        f"task {task.name!r}: {task.duration:g} s, {task.scheme} on {task.intervals} intervals"
    ]
    lines.append(f"starts {task.starts}, seed {task.seed}, limits {_limits(task)}")
    for name, state in (("start", task.start), ("goal", task.goal)):
        q, v = state.on(robot, name)
        lines.append(f"{name} q = {_numbers(q)}")
        lines.append(f"{name} v = {_numbers(v)}")
    return "\n".join([*lines, "", task.scene.describe(), "", robot.describe()])


def _limits(task: Task) -> str:
    from hovi.limits import Limits

    if isinstance(task.limits, str):
        return task.limits
    if isinstance(task.limits, Limits):
        return "given"
    base = task.limits.get("base", "urdf")
    given = [f"{key} = {value}" for key, value in task.limits.items() if key != "base"]
    return "; ".join([base, *given])


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(f"{each:.6g}" for each in values) + "]"
