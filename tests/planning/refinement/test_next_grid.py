"""Initial motions on the next grid are the curve that is known already."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Tolerance
from hovi.planning.refinement.candidate import Candidate, contributions
from hovi.planning.refinement.error_estimate import FinerSolution, finer_than
from hovi.planning.refinement.next_grid import (
    TARGET_SHARE,
    _demands,
    interpolated_to,
    next_grid,
)
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q, REACH_V

STEPS = np.array([0.1, 0.3, 0.2, 0.4])
S = np.linspace(0.0, 1.0, 21)


@pytest.fixture(scope="module")
def finer(arm_scene: Scene) -> FinerSolution:
    """On four unequal intervals with four inner modes."""
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid(STEPS, (galerkin(2),) * 4))
    problem = TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))
    found = finer_than(solve_on_grid(problem))
    assert found is not None
    return found


def curve(problem: TrajectoryProblem, finer: FinerSolution) -> np.ndarray:
    """q of the initial motion on a problem's grid, densely sampled over the duration."""
    motion = problem.trajectory(interpolated_to(finer, problem))
    return motion.sample(np.linspace(0.0, 1.0, 201)).q


@pytest.mark.parametrize("modes", [(4, 4, 4, 4), (6, 4, 5, 8)])
def test_with_as_many_modes_on_the_same_intervals_it_is_the_same_curve(
    finer: FinerSolution, modes: tuple[int, ...]
) -> None:
    problem = finer.problem.on(Grid(STEPS, tuple(galerkin(r) for r in modes)))
    expected = finer.trajectory.sample(np.linspace(0.0, 1.0, 201)).q
    np.testing.assert_allclose(curve(problem, finer), expected, rtol=0, atol=1e-12)


def test_with_fewer_modes_each_interval_keeps_those_that_it_has(finer: FinerSolution) -> None:
    problem = finer.problem.on(Grid(STEPS, tuple(galerkin(r) for r in (2, 4, 0, 3))))
    path = interpolated_to(finer, problem)
    for k, r in enumerate((2, 4, 0, 3)):
        np.testing.assert_array_equal(path.inner[k, :r], finer.path.inner[k, :r])
        assert not path.inner[k, r:].any()
    np.testing.assert_array_equal(path.q, finer.path.q)
    np.testing.assert_array_equal(path.z, finer.path.z)


@pytest.mark.parametrize("modes", [2, 4, 6])
def test_on_halved_intervals_it_is_the_curve_up_to_interpolation(
    finer: FinerSolution, modes: int
) -> None:
    halves = Grid(STEPS, (galerkin(modes),) * 4).halved(np.ones(4, dtype=bool))
    expected = finer.trajectory.sample(np.linspace(0.0, 1.0, 201)).q
    allowed = {2: 1e-3, 4: 1e-9, 6: 1e-11}[modes]
    found = curve(finer.problem.on(halves), finer)
    np.testing.assert_allclose(found, expected, rtol=0, atol=allowed)


@pytest.mark.parametrize("size", [1e-5, 1e-7, 1e-9])
def test_intervals_that_meet_their_demands_meet_the_tolerance(
    arm_scene: Scene, size: float
) -> None:
    """Each takes the same share of the target, so that larger contributions fall further."""
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid(STEPS, (galerkin(2),) * 4))
    found = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V)))
    candidate = Candidate.of(found, Tolerance(size))
    assert candidate.finer is not None
    (demand,) = _demands(candidate, candidate.finer)
    known = contributions(candidate.finer)
    scale = max(1.0, candidate.error / known.sum())
    assert demand.power == 2
    np.testing.assert_allclose(demand.factor * known * scale, TARGET_SHARE * size / 4, rtol=1e-12)


@pytest.mark.parametrize("error", [1e-4, 5e-3, 2e-2, 0.1])
def test_the_modes_are_trusted_up_to_an_error_of_one_per_cent(
    arm_scene: Scene, error: float
) -> None:
    """Beyond that an interval gets six of them at most, whatever the tolerance."""
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid(STEPS, (galerkin(4),) * 4))
    found = solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V)))
    candidate = dataclasses.replace(Candidate.of(found, Tolerance(1e-14)), contradicted=error)
    assert (next_grid(candidate).inner_modes > 6) == (error <= 0.01)
