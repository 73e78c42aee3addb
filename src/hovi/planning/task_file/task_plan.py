"""plan_task: a task, from a scene file for instance, planned as it says."""

from __future__ import annotations

from typing import Any

from hovi.planning.search.job import Progress
from hovi.planning.search.option_fields import spell_out
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.planner import plan
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task


def plan_task(task: Task, progress: Progress | None = None, **changes: Any) -> Solution:
    """The motion that a task asks for: `plan` with all that it says.

    task: what is planned.
    progress: called with a line of text and the fraction done.
    The options of `plan` take the place of what the task says. Raises what `plan` raises.
    """
    options = task.options.with_changes(**changes)
    return plan(task.scene, task.start, task.goal, task.duration, progress, options)


spell_out(plan_task, PlanOptions)
