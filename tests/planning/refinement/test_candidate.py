"""Estimates that may not be trusted: under limits, and where contributions cancel."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import hovi
from hovi import Solution
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import deviation
from hovi.discrete.state import State
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy, Tolerance
from hovi.planning.refinement.adaptive import solve_to_tolerance
from hovi.planning.refinement.candidate import contributions, error_of_cost
from hovi.planning.refinement.error_estimate import finer_than
from hovi.scene.scene import Scene
from hovi.schemes import by_name
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

REACH = State(REACH_Q, REACH_V)
FAST = {"base": "none", "v": 6.0}


def reach(
    scene: Scene, scheme: str, intervals: int, goal: State = REACH, limits: object = None
) -> TrajectoryProblem:
    grid = Grid.uniform(1.0, intervals, by_name(scheme))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    bounds = None if limits is None else as_limits(scene.robot, limits)
    return TrajectoryProblem(ld, State(HANG), goal, bounds)


def refined(scene: Scene, goal: State = REACH, **options: Any) -> tuple[Solution, Accuracy]:
    """A plan to a tolerance and its accuracy."""
    found = hovi.plan(scene, HANG, goal, 1.0, **({"limits": "none"} | options))
    assert found.accuracy is not None
    return found, found.accuracy


# Limits


@pytest.fixture(scope="module")
def limited_reference(arm_scene: Scene) -> Solution:
    return solve_on_grid(reach(arm_scene, "galerkin-2x8", 256, limits=FAST))


def assert_honest(ratios: list[float]) -> None:
    """Estimates over true errors: rarely below, never far below, nor far above."""
    assert min(ratios) > 0.8
    assert np.mean(np.array(ratios) > 1.0) >= 0.8
    assert max(ratios) < 4.0


def test_under_limits_estimates_are_not_below_the_true_errors(
    arm_scene: Scene, limited_reference: Solution
) -> None:
    """Where a limit becomes active within an interval, halves of it are hardly better."""
    ratios = []
    for intervals in (6, 8, 10, 12, 16, 20, 24):
        for scheme in ("galerkin-2", "galerkin-2x8"):
            problem = reach(arm_scene, scheme, intervals, limits=FAST)
            found = hovi.solve(problem, limited_reference.trajectory)
            true = abs(found.cost / limited_reference.cost - 1.0)
            if found.error_estimate is not None:
                ratios.append(found.error_estimate / true)
    assert len(ratios) >= 10
    assert_honest(ratios)


def test_under_limits_errors_of_joints_are_not_below_the_true_ones(
    arm_scene: Scene, limited_reference: Solution
) -> None:
    ratios = []
    for intervals in (6, 8, 10, 12, 16, 24):
        found, accuracy = refined(arm_scene, limits=FAST, intervals=intervals, tolerance="3 deg")
        costs = found.cost, limited_reference.cost
        true = deviation(found.trajectory, limited_reference.trajectory, costs)
        ratios.append(accuracy.error / accuracy.tolerance.measure(true))
    assert min(ratios) > 0.8
    assert max(ratios) < 6.0


def test_estimates_within_limits_are_not_below_the_true_errors(
    arm_scene: Scene, limited_reference: Solution
) -> None:
    """Of every grid of a refinement, whose motions are compared with ever finer ones."""
    ratios = []
    for intervals in (6, 8, 10, 12, 16):
        _, accuracy = refined(arm_scene, limits=FAST, intervals=intervals, tolerance=1e-4)
        assert accuracy.reached
        for done in accuracy.rounds:
            true = abs(done.cost / limited_reference.cost - 1.0)
            ratios.append(done.error / max(true, 1e-5))
    assert len(ratios) >= 10
    assert_honest(ratios)


# Cancellation


def few_points(scene: Scene, goal: State, intervals: int) -> TrajectoryProblem:
    """A reach on r + 2 points an interval, on which the cost may be too small as well."""
    return reach(scene, "galerkin-4", 2 * intervals // 3, goal)


@cache
def first_error(scene: Scene, shoulder: float, intervals: int) -> float:
    """The relative error of the cost on few points: by two more modes, with sign."""
    found = solve_on_grid(few_points(scene, State([shoulder, 0.5]), intervals))
    assert found.problem is not None
    return found.cost / solve_on_grid(found.problem.finer, found.trajectory).cost - 1


def test_a_cost_without_error_by_cancellation_is_not_within_a_tolerance(arm_scene: Scene) -> None:
    """The errors of the intervals have both signs, and their sum says nothing about the motion."""
    found = 0
    for intervals in (5, 6, 8):
        goals = np.linspace(-1.0, 1.0, 17)
        errors = [first_error(arm_scene, float(x), intervals) for x in goals]
        for i in np.flatnonzero(np.diff(np.sign(errors))):
            error = partial(first_error, arm_scene, intervals=intervals)
            root = brentq(error, *goals[i : i + 2], xtol=1e-13)
            size = 0.02 * max(abs(errors[i]), abs(errors[i + 1]))
            goal = State([root, 0.5])
            problem = few_points(arm_scene, goal, intervals)
            accuracy = solve_to_tolerance(problem, Tolerance(size)).accuracy
            assert accuracy is not None
            assert accuracy.rounds[0].error < 0.1 * size
            assert len(accuracy.rounds) > 1
            assert accuracy.reached
            assert abs(first_error(arm_scene, root, intervals)) < 0.1 * size
            found += 1
    assert found >= 3


def test_within_limits_errors_of_intervals_that_cancel_count_by_their_magnitudes(
    arm_scene: Scene,
) -> None:
    found = solve_on_grid(reach(arm_scene, "galerkin-2x8", 16, limits=FAST))
    finer = finer_than(found)
    assert finer is not None
    cancelled = replace(finer, cost=finer.known)
    magnitudes = contributions(cancelled).sum()
    assert magnitudes > 1e-5
    assert error_of_cost(found, cancelled) >= magnitudes


@pytest.mark.parametrize("intervals", [8, 12, 16])
def test_an_estimate_up_to_four_fifths_of_a_tolerance_is_within_it(
    arm_scene: Scene, intervals: int
) -> None:
    _, coarse = refined(arm_scene, intervals=intervals, tolerance=1.0)
    error = coarse.rounds[0].error
    for share, accepted in ((2.0, True), (1.3, True), (1.2, False), (0.5, False)):
        _, accuracy = refined(arm_scene, intervals=intervals, tolerance=share * error)
        assert accuracy.reached
        assert accuracy.rounds[0].error == pytest.approx(error, rel=1e-6)
        assert (len(accuracy.rounds) == 1) == accepted


def test_a_coarse_estimate_without_limits_has_a_larger_safety_factor(arm_scene: Scene) -> None:
    """Above a thousandth the finer solution is not better by orders; below, it is."""
    for intervals, factor in ((12, 3.0), (24, 1.0)):
        found = hovi.solve(reach(arm_scene, "hermite-simpson", intervals))
        assert found.problem is not None
        finer = solve_on_grid(found.problem.finer, found.trajectory)
        difference = abs(found.cost / finer.cost - 1)
        assert (difference > 1e-3) == (factor > 1)
        assert found.error_estimate == pytest.approx(factor * difference, rel=1e-2)
