"""Resolved motions, compared with solutions of Pontryagin's equations."""

from __future__ import annotations

import numpy as np
import pytest

from hovi import Solution, plan
from hovi.accuracy.budget import Budget
from hovi.accuracy.resolved_motion import ResolvedMotion, resolve
from hovi.errors import UnmeasurableError
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.scene.scene import Scene
from oracles.pontryagin_oracle import extremal


def resolved(scene: str) -> tuple[ResolvedMotion, Solution]:
    task = load_task(example(scene))
    found = plan(
        task.scene, task.start, task.goal, task.duration, limits="none", self_collision=False
    )
    assert found.problem is not None
    return resolve(found.problem, found, Budget(600.0)), found


@pytest.mark.parametrize(
    ("scene", "tolerance"),
    [
        ("two_link_reach", 1e-6),
        pytest.param("ur5_reach", 1e-6, marks=pytest.mark.long),
        pytest.param("panda_reach", 1e-5, marks=pytest.mark.long),
    ],
)
def test_a_resolved_motion_solves_pontryagins_equations(scene: str, tolerance: float) -> None:
    motion, found = resolved(scene)
    path, problem = motion.trajectory, found.problem
    assert problem is not None
    momenta = np.moveaxis(path.momenta, 1, 0)
    guess = np.concatenate([path.q, path.v, *momenta], axis=1).T
    true = extremal(
        problem.scene.model, [x[i] for i in (0, 1) for x in problem.ends], path.t, guess, tolerance
    )
    assert motion.cost == pytest.approx(true.cost, rel=1e-2 * tolerance)
    t = motion.reference.times
    np.testing.assert_allclose(path.configurations(t), true.q(t), rtol=0, atol=0.1 * tolerance)
    assert motion.uncertainty.cost <= 1e-12
    assert motion.uncertainty.largest_q <= 1e-9


def test_a_motion_of_zero_cost_raises(arm_scene: Scene) -> None:
    hanging = [-np.pi / 2, 0.0]
    found = plan(arm_scene, hanging, hanging, 1.0, limits="none")
    assert found.problem is not None
    with pytest.raises(UnmeasurableError, match="errors are relative to its cost"):
        resolve(found.problem, found, Budget(600.0))


def test_without_time_the_error_is_that_which_plan_estimates(arm_scene: Scene) -> None:
    found = plan(arm_scene, [-np.pi / 2, 0.0], [0.3, 0.7], 1.0, limits="none")
    assert found.problem is not None
    assert found.accuracy is not None
    motion = resolve(found.problem, found, Budget(1e-9))
    assert not motion.converged
    assert motion.trajectory is found.trajectory
    assert motion.uncertainty is found.accuracy.estimate


def test_without_time_and_estimate_a_larger_budget_is_named(arm_scene: Scene) -> None:
    ends, grid = ([-np.pi / 2, 0.0], [0.3, 0.7]), {"scheme": "galerkin-2", "intervals": 8}
    found = plan(arm_scene, *ends, 1.0, limits="none", **grid)
    assert found.problem is not None
    with pytest.raises(UnmeasurableError, match="use a larger budget"):
        resolve(found.problem, found, Budget(1e-9))
