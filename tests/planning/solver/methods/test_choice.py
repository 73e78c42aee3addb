"""Every problem is solved by the first method that supports it; methods agree."""

from __future__ import annotations

import numpy as np
import pytest

from hovi import solve
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example


def problem_of(name: str, **options: object) -> TrajectoryProblem:
    solution = plan_task(
        load_task(example(name)), max_iterations=1, starts=1, continuation=False, **options
    )
    assert solution.problem is not None
    return solution.problem


def test_inactive_limits_change_nothing() -> None:
    free = solve(problem_of("two_link_reach", limits="none"))
    wide = {"base": "none", "v": 1e3 * float(np.abs(free.trajectory.v).max())}
    between = solve(problem_of("two_link_reach", limits=wide))
    assert between.success
    assert between.cost == pytest.approx(free.cost, rel=1e-6)
