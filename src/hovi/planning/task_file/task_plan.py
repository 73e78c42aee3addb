"""plan_task: plan a task, such as one from a scene file."""

from __future__ import annotations

import dataclasses
from typing import Any

from hovi.checks.arguments import check_arguments
from hovi.discrete.output.caution import LEFT_OUT, Caution
from hovi.planning.refinement.faults.cautions import with_cautions_of_motion
from hovi.planning.search.planner import plan
from hovi.planning.solver.iterates import Cancel, OnIterate
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task
from hovi.system.progress import Progress


@check_arguments
def plan_task(
    task: Task,
    progress: Progress | None = None,
    on_iterate: OnIterate | None = None,
    cancel: Cancel | None = None,
    **changes: Any,
) -> Solution:
    """Plan a task with its options.

    task: the scene, the ends, the duration or the segments, and the options.
    progress, on_iterate, cancel: as for `plan`.
    changes: options that override those of the task.
    Raises as `plan` does.
    """
    found = _planned(task, progress, on_iterate=on_iterate, cancel=cancel, **changes)
    note = "" if "self_collision" in changes else task.note
    if not note:
        return found
    found = dataclasses.replace(found, message=f"{found.message} {note}")
    return with_cautions_of_motion(found, [Caution(LEFT_OUT, note)])


def _planned(task: Task, progress: Progress | None, **changes: Any) -> Solution:
    if task.segments:
        from hovi.planning.sequence.sequence_planner import plan_sequence  # rarely needed

        given = task.scene, task.start, task.segments
        return plan_sequence(*given, progress=progress, options=task.options, **changes)
    ends = task.start, task.goal, task.duration
    return plan(task.scene, *ends, progress=progress, options=task.options, **changes)
