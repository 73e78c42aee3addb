"""The motion of a diagram: within limits, and found by fall-backs where the first search fails."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from hovi import PlanOptions, plan
from hovi.accuracy.budget import Budget
from hovi.accuracy.reference_search import Reference, find_reference
from hovi.accuracy.resolved_motion import LIMIT_TOLERANCE_FRACTION
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.errors import InputError, UnmeasurableError
from hovi.planning.problem.limits import TOLERANCE, Limits
from hovi.planning.task_file.task import Task
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import hermite_simpson
from oracles.on_grid import solve_on_grid
from samples import paper_arm

PEAKS = np.array([8.04, 8.89])
"""Largest torques of the reach without limits, in [N m]."""
UR10_REACH = (
    [0.785998, 2.495768, 1.732184, -1.726574, -1.255592, 2.347106],
    [-0.714002, 2.311882, 1.783933, -1.139169, -1.248656, 0.906886],
)


def reach(scene: Scene, **options: object) -> Task:
    ends = State(paper_arm.HANG), State(paper_arm.REACH_Q, paper_arm.REACH_V)
    return Task(scene, *ends, 1.0, PlanOptions(**options))  # type: ignore[arg-type]


def torque_limits(most: np.ndarray) -> Limits:
    lower = np.full((4, 2), -np.inf)
    lower[3] = -most
    return Limits(lower, -lower)


def reference(task: Task, seconds: float = 60.0) -> Reference:
    return find_reference(task, Budget(seconds), lambda text, fraction: None)


def test_a_motion_within_limits_is_the_minimum_within_limits(arm_scene: Scene) -> None:
    most = 0.9 * PEAKS
    found = reference(reach(arm_scene, limits=torque_limits(most)), 120.0)
    motion, resolved = found.resolved.trajectory, found.resolved
    x, w = np.polynomial.legendre.leggauss(12)
    t = (motion.t[:-1, None] + np.diff(motion.t)[:, None] * (x + 1) / 2).ravel()
    weights = (np.diff(motion.t)[:, None] * w / 2).ravel()
    model, sample = arm_scene.model, motion.sample(t)
    data = model.createData()
    tau = np.array(
        [pin.rnea(model, data, *jet) for jet in zip(sample.q, sample.v, sample.a, strict=True)]
    )
    assert (np.abs(tau) <= most * (1 + 2.1 * LIMIT_TOLERANCE_FRACTION * TOLERANCE)).all()
    assert np.abs(tau).max(axis=0) == pytest.approx(most, rel=1e-3)
    assert weights @ (tau**2).sum(axis=1) / 2 == pytest.approx(resolved.cost, rel=1e-9)
    problem = found.problem.on(Grid.uniform(1.0, 256, hermite_simpson()))
    other = solve_on_grid(problem, motion)
    assert other.cost == pytest.approx(resolved.cost, rel=2e-5)
    assert resolved.cost > 1.003 * paper_arm.REACH_COST
    assert 0 < resolved.limit_effect < 1e-5
    assert resolved.uncertainty.cost < 1e-4
    assert any("All runs hold the limits" in note for note in found.notes)


def test_the_effect_of_the_limits_tolerance_is_that_of_looser_limits(arm_scene: Scene) -> None:
    tolerance, most = 1e-4, 0.9 * PEAKS
    limits = torque_limits(most)
    loose = Limits(limits.lower, limits.upper, tolerance)
    found = reference(reach(arm_scene, limits=loose), 600.0)
    grid = found.problem.grid
    ends = found.problem.start, found.problem.goal
    costs = [
        plan(arm_scene, *ends, 1.0, scheme=grid.schemes[0], intervals=64, limits=each).cost
        for each in (torque_limits(most), torque_limits(most * (1 + 12 * tolerance)))
    ]  # the range is twice the torque, and a bound is shifted by six tolerances
    assert found.resolved.limit_effect == pytest.approx(1 - costs[1] / costs[0], rel=0.1)


def test_limits_that_the_motion_does_not_reach_are_left_out_and_noted(arm_scene: Scene) -> None:
    found = reference(reach(arm_scene, limits=torque_limits(1.2 * PEAKS)))
    assert not found.problem.limited
    assert found.resolved.limit_effect == 0
    assert found.resolved.cost == pytest.approx(paper_arm.REACH_COST, rel=1e-9)
    (note,) = found.notes
    assert note.startswith("The motion stays 8.3 % of the ranges or more away from its limits")


def test_where_the_first_search_fails_heavy_rotors_help(arm_scene: Scene) -> None:
    task = reach(arm_scene, limits="none", max_iterations=4, continuation=False)
    found = reference(task)
    direct = plan(arm_scene, task.start, task.goal, 1.0, options=task.options)
    assert found.resolved.cost == pytest.approx(paper_arm.REACH_COST, rel=1e-9)
    how = "The motion was found from heavy rotors made lighter; from its own guess: "
    assert found.notes[0] == how + direct.message


def test_where_nothing_helps_one_sentence_tells_why_and_what_was_tried(arm_scene: Scene) -> None:
    hopeless = reach(arm_scene, limits="none", max_iterations=1, continuation=False)
    with pytest.raises(UnmeasurableError) as raised:
        reference(hopeless)
    told = str(raised.value)
    assert "was found: the iteration limit was reached after 1 steps" in told
    assert told.endswith("Nor was one found from more starts or from heavy rotors made lighter.")


def test_where_time_is_up_a_larger_budget_is_named(arm_scene: Scene) -> None:
    with pytest.raises(UnmeasurableError, match=r"A larger budget allows a longer search\.$"):
        reference(reach(arm_scene, limits="none"), seconds=1e-3)


def test_invalid_input_is_refused_and_not_tried_again(arm_scene: Scene) -> None:
    task = Task(arm_scene, State([0.0]), State(paper_arm.REACH_Q), 1.0, PlanOptions())
    with pytest.raises(InputError, match="start"):
        reference(task)


@pytest.mark.long
def test_a_wrist_that_spins_is_measured_from_heavy_rotors() -> None:
    scene = Scene(load_robot("ur10"), [Gravity()])
    start, goal = UR10_REACH
    task = Task(scene, State(start), State(goal), 1.114, PlanOptions(limits="none"))
    found = reference(task, seconds=600.0)
    assert "spins at up to" in found.notes[0]
    assert found.resolved.uncertainty.cost < 1e-9
