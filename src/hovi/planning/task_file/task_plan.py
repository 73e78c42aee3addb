"""plan_task: a task, from a scene file for instance, planned as it says."""

from __future__ import annotations

from typing import Any

from hovi.planning.search.planner import plan
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task


def plan_task(task: Task, **options: Any) -> Solution:
    """The motion that a task asks for: `plan` with all that it says.

    task: what is planned. options: of `plan`, in place of what the task says or besides.
    Raises what `plan` raises.
    """
    clearance = task.clearance
    said: dict[str, Any] = {
        "time_weight": task.time_weight,
        "via": task.via,
        "scheme": task.scheme,
        "intervals": task.intervals,
        "tolerance": task.tolerance,
        "limits": task.limits,
        "obstacles": clearance.obstacles,
        "margin": clearance.margin,
        "self_collision": clearance.self_collision,
        "starts": task.starts,
        "seed": task.seed,
    }
    return plan(task.scene, task.start, task.goal, task.duration, **(said | options))
