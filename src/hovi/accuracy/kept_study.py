"""What each condition that a motion keeps costs, and by how much it would be missed without."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from hovi.conditions.condition import Condition
from hovi.conditions.excess import excess_along
from hovi.conditions.kept.kinds import as_kept
from hovi.conditions.missed_along import missed_along
from hovi.conditions.sets import TwoSided
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.progress import Progress, silent

COLUMNS = "kept", "effort", "change", "steps", "time [s]", "without it"


@dataclass(frozen=True)
class KeptTrial:
    """A task planned without one condition that it keeps; all of them for the first one.

    title: of the condition. success: whether a minimum was found; if not, the other numbers have no
    meaning. effort: of the motion. steps, seconds: of the plan. missed: by how much the motion
    misses what is left out, in words. fixed_by: what made the last refinement of its grid, "" for
    none.
    """

    title: str
    success: bool
    effort: float
    steps: int
    seconds: float
    missed: str
    fixed_by: str = ""


def kept_study(
    task: Task, progress: Progress | None = None, time_limit: float | None = None
) -> list[KeptTrial]:
    """Plan a task with all that it keeps, and then without each of its conditions alone.

    time_limit: of all plans, in [s], shared evenly by those that are left.
    Raises InputError for a task that keeps nothing along the whole motion, or of which no motion is
    found.
    """
    task.require_one_motion("a study of what is kept")
    report, deadline, kept = progress or silent, Deadline(time_limit), as_kept(task.options.keep)
    if not kept:
        raise InputError(f"{task.name!r} keeps nothing: add a table [[keep]] to its file.")
    report("planning with all that is kept", 0.0)
    whole, seconds = _planned(task, _share(deadline, 1 + len(kept)))
    if not whole.success or whole.problem is None:
        raise InputError(f"no motion that keeps all was found: {whole.message}")
    trials = [_trial("(all)", whole, seconds, "")]
    for i, each in enumerate(kept):
        report(f"planning without {each.title}", (1 + i) / (1 + len(kept)))
        others = [*kept[:i], *kept[i + 1 :]]
        left = _share(deadline, len(kept) - i)
        found, seconds = _planned(task.with_options(keep=others), left)
        missed = _missed(whole.problem, found) if found.success else found.message
        trials.append(_trial(each.title, found, seconds, missed))
    return trials


def kept_rows(trials: list[KeptTrial]) -> list[list[str]]:
    """Rows of COLUMNS: the motion that keeps all, then one without each condition."""
    whole = trials[0].effort
    return [
        [
            each.title,
            f"{each.effort:.6g}" if each.success else "no minimum",
            "" if i == 0 or not each.success else f"{100 * (each.effort / whole - 1):+.3g} %",
            str(each.steps),
            f"{each.seconds:.2g}",
            each.missed,
        ]
        for i, each in enumerate(trials)
    ]


def _trial(title: str, found: Solution, seconds: float, missed: str) -> KeptTrial:
    effort = np.nan if found.effort is None else float(found.effort)
    fixed_by = "" if found.accuracy is None else found.accuracy.fixed_by
    return KeptTrial(title, found.success, effort, found.nit, seconds, missed, fixed_by)


def _planned(task: Task, limit: float | None) -> tuple[Solution, float]:
    began = time.perf_counter()
    return plan_task(task, time_limit=limit), time.perf_counter() - began


def _share(deadline: Deadline, plans: int) -> float | None:
    left = deadline.seconds_left
    return None if left is None else max(left, 0.0) / plans


def _missed(whole: TrajectoryProblem, found: Solution) -> str:
    """By how much a motion misses the conditions that its own problem does not have, in words."""
    kept = set() if found.problem is None else {each.name for each in found.problem.conditions}
    motion: Trajectory = found.trajectory
    values = [each for each in whole.along if each.name not in kept]
    words = [f"missed by {_in_unit(x.size, x.given.unit)}" for x in missed_along(values, motion)]
    for each in whole.bounds:
        if each.name not in kept:
            over = float(excess_along(motion, each).max())
            words.append(_beyond(each, over) if over > 0 else "kept all the same")
    return ", ".join(words)


def _beyond(given: Condition[TwoSided, Any], over: float) -> str:
    """How far a bound is exceeded. over: of the scale, which is the bound itself for squares."""
    _, upper = given.on.at(np.zeros(1), given.y.size)
    if given.scale is not None and bool(np.all(upper == given.scale)):
        return f"{np.sqrt(1.0 + over):.3g} times its bound"
    return f"{100 * over:.3g} % of its scale beyond a bound"


def _in_unit(size: float, unit: str) -> str:
    if unit == "rad":
        return f"{np.rad2deg(size):.3g} deg"
    return f"{1e3 * size:.3g} mm" if unit == "m" else f"{size:.3g} {unit}".rstrip()
