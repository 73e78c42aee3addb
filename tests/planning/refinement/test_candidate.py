"""Estimates that may not be trusted: under limits, and where contributions cancel."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from hovi import Solution
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import deviation
from hovi.discrete.state import State
from hovi.effects.running_cost import RunningCost
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import CURVE_TOLERANCE, Quantity, Tolerance
from hovi.planning.refinement.adaptive import refine_to_tolerance
from hovi.planning.refinement.candidate import BARRIER_EXCESS, Candidate, error_of_cost
from hovi.planning.refinement.error_estimate import (
    LIMITED_SAFETY_FACTOR,
    FinerSolution,
    finer_than,
)
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


# Narrow features


@pytest.mark.parametrize(
    ("narrow", "along", "carried"),
    [
        (False, 0.9 * CURVE_TOLERANCE, True),
        (False, 1.1 * CURVE_TOLERANCE, False),
        (True, 0.9e-6, True),
        (True, 1.1e-6, False),
        (True, 0.9 * CURVE_TOLERANCE, False),
    ],
)
def test_where_effects_may_be_narrow_the_tolerance_holds_along_the_curve(
    arm_scene: Scene, narrow: bool, along: float, carried: bool
) -> None:
    """Elsewhere the integral along the curve may differ by more than a tight tolerance."""
    solution = solve_on_grid(reach(arm_scene, "galerkin-2", 8))
    tight = Tolerance.of(1e-6, arm_scene.robot)
    assert Candidate(solution, tight, along=along, narrow=narrow).is_carried == carried


def test_effects_that_may_be_narrow_are_known_of_a_candidate(arm_scene: Scene) -> None:
    pulse = RunningCost({"pulse": "exp(-((t - 0.5) / 0.01)**2)"})
    pulsed = Scene(arm_scene.robot, [pulse])
    for scene, narrow in ((arm_scene, False), (pulsed, True)):
        solution = solve_on_grid(reach(scene, "galerkin-2", 8))
        assert Candidate.of(solution, Tolerance.of(1e-3, scene.robot)).narrow == narrow


# Limits


@pytest.fixture(scope="module")
def limited_reference(arm_scene: Scene) -> Solution:
    return solve_on_grid(reach(arm_scene, "galerkin-2x8", 256, limits=FAST))


@pytest.mark.parametrize("size", [1e-3, "1 deg"])
def test_under_limits_estimates_are_not_below_the_true_errors(
    arm_scene: Scene, limited_reference: Solution, size: float | str
) -> None:
    """Where a limit becomes active within an interval, halves of it are hardly better."""
    tolerance, ratios = Tolerance.of(size, arm_scene.robot), []
    for intervals in (6, 8, 10, 12, 16, 20, 24):
        for scheme in ("galerkin-2", "galerkin-2x8"):
            problem = reach(arm_scene, scheme, intervals, limits=FAST)
            found = solve_on_grid(problem, limited_reference.trajectory)
            costs = found.cost, limited_reference.cost
            true = deviation(found.trajectory, limited_reference.trajectory, costs)
            ratios.append(Candidate.of(found, tolerance).error / tolerance.measure(true))
    assert min(ratios) > 0.8
    assert np.mean(np.array(ratios) > 1.0) > 0.8
    assert max(ratios) < 4.0


def test_estimates_with_known_decay_are_not_below_the_true_errors(
    arm_scene: Scene, limited_reference: Solution
) -> None:
    """A finer motion is compared with a still finer one, which is nearer to it than it was."""
    tolerance, ratios, factors = Tolerance(1e-3, Quantity.COST), [], []
    for intervals in (6, 8, 10, 12, 16):
        problem = reach(arm_scene, "galerkin-2x8", intervals, limits=FAST)
        coarse = solve_on_grid(problem, limited_reference.trajectory)
        finer = finer_than(coarse)
        assert finer is not None
        found = finer.finish()
        assert found is not None
        before = finer.cost_decrease(found)
        known = Candidate.of(found, tolerance, previous_decrease=before)
        assert known.finer is not None
        factors.append(known.finer.safety_factor)
        assert known.error <= Candidate.of(found, tolerance).error
        true = abs(found.cost / limited_reference.cost - 1.0)
        ratios.append(known.error / true)
    assert min(factors) < LIMITED_SAFETY_FACTOR
    assert min(ratios) > 0.8
    assert np.mean(np.array(ratios) > 1.0) >= 0.8
    assert max(ratios) < 4.0


@pytest.mark.parametrize(
    ("before", "factor"),
    [(None, 3.0), (5.0, 2.25), (1.6, 2.0 / 0.75), (1.2, 3.0), (0.9, 3.0), (-4.0, 3.0)],
)
def test_the_safety_factor_is_that_of_a_geometric_decay(
    before: float | None, factor: float, limited_reference: Solution
) -> None:
    problem, path = limited_reference.problem, limited_reference.trajectory.path
    assert problem is not None
    gains = np.zeros(problem.grid.intervals)
    finer = FinerSolution(problem, path, 99.0, 100.0, gains, lambda: None, previous_decrease=before)
    assert finer.safety_factor == pytest.approx(factor, rel=1e-12)


def test_a_motion_is_the_finer_one_if_it_costs_as_much(limited_reference: Solution) -> None:
    found, problem = limited_reference, limited_reference.problem
    assert problem is not None
    gains, path = np.zeros(problem.grid.intervals), found.trajectory.path

    def decrease(before: float, after: float) -> float | None:
        known, cost = before * found.cost, after * found.cost
        return FinerSolution(problem, path, cost, known, gains, lambda: None).cost_decrease(found)

    assert decrease(1.001, 1.0) == pytest.approx(1e-3 * found.cost)
    assert decrease(1.001, 1.0 - 5e-5) == pytest.approx(1.05e-3 * found.cost)
    assert decrease(1.001, 1.0 - 2e-4) is None
    assert decrease(1.001, 1.0 + 2e-4) is None
    assert decrease(0.999, 1.0) is None


def test_an_error_within_limits_contains_what_a_barrier_costs(
    arm_scene: Scene, limited_reference: Solution
) -> None:
    problem = reach(arm_scene, "galerkin-2x8", 64, limits=FAST)
    known = [solve_on_grid(problem, limited_reference.trajectory, barrier=b) for b in (1e-5, 1e-7)]
    excess = known[0].cost / known[1].cost - 1.0
    assert 1e-6 < excess < BARRIER_EXCESS * 1e-5
    errors = [Candidate.of(each, Tolerance(1e-3, Quantity.COST)).error for each in known]
    assert errors[1] < 0.5 * BARRIER_EXCESS * 1e-5 < BARRIER_EXCESS * 1e-5 < errors[0]


# Cancellation


def cancelled(scene: Scene, scheme: str, intervals: int, near: tuple[float, float]) -> Solution:
    """A reach whose goal is chosen such that the cost has no error on its grid, by cancellation."""

    def solved(shoulder: float) -> Solution:
        return solve_on_grid(reach(scene, scheme, intervals, State([shoulder, 0.5])))

    def error(shoulder: float) -> float:
        finer = Candidate.of(solved(shoulder), Tolerance(1e-3)).finer
        assert finer is not None
        return finer.known / finer.cost - 1

    return solved(brentq(error, *near, xtol=1e-13))


@pytest.mark.parametrize(
    ("scheme", "intervals", "near", "size"),
    [
        ("galerkin-1", 6, (-0.75, -0.5), 5e-6),
        ("galerkin-2", 12, (-0.25, 0.0), 2e-9),
        ("taylor-midpoint", 12, (-1.0, -0.75), 1e-3),
    ],
)
def test_a_cost_without_error_by_cancellation_is_not_within_a_tolerance(
    arm_scene: Scene, scheme: str, intervals: int, near: tuple[float, float], size: float
) -> None:
    """The errors of the intervals have both signs, and their sum says nothing about the motion."""
    found, tolerance = cancelled(arm_scene, scheme, intervals, near), Tolerance(size)
    candidate = Candidate.of(found, tolerance)
    assert candidate.finer is not None
    assert candidate.error < 0.1 * size
    gains = candidate.finer.gains / found.cost
    assert np.abs(gains).sum() > 20 * size
    assert not candidate.within_tolerance
    stopped = refine_to_tolerance(found, tolerance, time_limit=1e-9).accuracy
    assert stopped is not None
    assert not stopped.reached
    assert stopped.reason == "the time limit was reached"
    refined = refine_to_tolerance(found, tolerance).accuracy
    assert refined is not None
    assert refined.reached
    assert len(refined.rounds) > 1


@pytest.mark.parametrize("scheme", ["galerkin-2x8", "galerkin-4x10"])
def test_contributions_of_one_sign_are_within_a_tolerance(arm_scene: Scene, scheme: str) -> None:
    found = solve_on_grid(reach(arm_scene, scheme, 12))
    error = Candidate.of(found, Tolerance(1e-3)).error
    finer = Candidate.of(found, Tolerance(1e-3)).finer
    assert finer is not None
    assert np.abs(finer.gains).sum() == pytest.approx(abs(finer.gains.sum()), rel=1e-2)
    for share, accepted in ((2.0, True), (1.3, True), (1.2, False), (0.5, False)):
        candidate = Candidate.of(found, Tolerance(share * error))
        assert candidate.error == pytest.approx(error, rel=1e-12)
        assert candidate.within_tolerance == (accepted and candidate.is_carried)


def test_a_coarse_estimate_without_limits_has_a_larger_safety_factor(arm_scene: Scene) -> None:
    """Above a thousandth the finer solution is not better by orders; below, it is."""
    for intervals, factor in ((12, 3.0), (24, 1.0)):
        found = solve_on_grid(reach(arm_scene, "hermite-simpson", intervals))
        finer = Candidate.of(found, Tolerance(1e-3)).finer
        assert finer is not None
        difference = abs(finer.known - finer.cost) / finer.cost
        assert (difference > 1e-3) == (factor > 1)
        assert error_of_cost(found, finer) == pytest.approx(factor * difference, rel=1e-3)


def test_a_motion_without_estimate_is_not_within_any_tolerance(arm_scene: Scene) -> None:
    found = solve_on_grid(reach(arm_scene, "galerkin-2", 12))
    stopped = dataclasses.replace(found, success=False)
    candidate = Candidate.of(stopped, Tolerance(1.0))
    assert candidate.finer is None
    assert np.isnan(candidate.error)
    assert not candidate.within_tolerance


@pytest.mark.parametrize(
    ("size", "along", "carried"),
    [(1e-2, 5e-3, True), (1e-2, 2e-2, False), (1e-6, 5e-4, True), (1e-6, 5e-3, False),
     ("1 mm", 5e-4, True), ("1 mm", 5e-3, False)],
)  # fmt: skip
def test_the_curve_is_as_good_as_the_tolerance_or_a_thousandth(
    arm_scene: Scene, size: float | str, along: float, carried: bool
) -> None:
    found = solve_on_grid(reach(arm_scene, "galerkin-2x8", 16))
    candidate = Candidate.of(found, Tolerance.of(size, arm_scene.robot))
    assert dataclasses.replace(candidate, along=along).is_carried == carried
