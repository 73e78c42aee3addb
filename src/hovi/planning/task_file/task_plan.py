"""plan_task: a task, from a scene file for instance, planned as it says."""

from __future__ import annotations

from typing import Any

from hovi.planning.search.job import Progress
from hovi.planning.search.planner import plan
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task


def plan_task(task: Task, progress: Progress | None = None, **changes: Any) -> Solution:
    """The motion that a task asks for: `plan` with all that it says.

    task: what is planned.
    progress: called with a line of text and the fraction done.
    changes: options of `plan` in place of what the task says.
    Raises what `plan` raises.
    """
    ends = task.start, task.goal, task.duration
    return plan(task.scene, *ends, progress=progress, options=task.options, **changes)
