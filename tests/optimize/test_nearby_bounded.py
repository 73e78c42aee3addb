"""Whole Newton steps from the solution of a nearby problem with bounds."""

from __future__ import annotations

import dataclasses

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.barrier import Bounds
from hovi.optimize.bounded_objective import BoundedOutcome, Outputs, Refinement
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.nearby_bounded import ROOM, follow_bounded
from hovi.system.deadline import OutOfTimeError
from optimize.test_interior_point import Program, Quadratic

Array = npt.NDArray[np.float64]

OPTIONS = Criteria(barrier=1e-8, enough=1e-7, max_iterations=20)
"""As for replanning within limits."""


def random_problem(seed: int, move: float) -> tuple[Quadratic, Quadratic]:
    """A convex program with half of its bounds active, and one whose gradient and bounds moved."""
    random = np.random.default_rng(seed)
    n, R = 20, 60
    B, A, g = random.normal(size=(n, n)), random.normal(size=(R, n)), random.normal(size=n)
    H, bound = B @ B.T + np.eye(n), random.uniform(0.05, 0.2, R)
    moved, shift = g + move * random.normal(size=n), move * A @ random.normal(size=n)
    second = Quadratic(H, moved, A, shift - bound, shift + bound)
    return Quadratic(H, g, A, -bound, bound), second


def solved(problem: Quadratic, x: Array) -> BoundedOutcome[Array]:
    return minimize_bounded(problem, x, Criteria(barrier=1e-8, enough=1e-9))


def excess(problem: Quadratic, x: Array) -> float:
    """How far outputs are outside their bounds at most."""
    y = problem.A @ x
    return float(np.maximum(problem.bounds.lower - y, y - problem.bounds.upper).max())


def follow(problem: Quadratic, known: BoundedOutcome[Array]) -> BoundedOutcome[Array]:
    barrier = dataclasses.replace(known.barrier, bounds=problem.bounds)
    return follow_bounded(problem, known.x, barrier, OPTIONS)


@pytest.mark.parametrize("seed", range(5))
def test_the_solution_of_a_nearby_problem_is_found_in_a_few_steps(seed: int) -> None:
    first, second = random_problem(seed, 0.003)
    known, cold = solved(first, np.zeros(20)), solved(second, np.zeros(20))
    held = known.barrier.zl + known.barrier.zu > 1e-3
    assert held.sum() >= 5
    found = follow(second, known)
    assert found.why is Reason.STATIONARY
    assert found.feasible
    assert found.iterations <= 5 < cold.iterations
    z = cold.barrier.zl + cold.barrier.zu
    rise, expected = found.outputs.value - cold.outputs.value, ROOM * second.bounds.weights @ z
    assert abs(rise - expected) < 1e-6 * abs(cold.outputs.value)
    np.testing.assert_allclose(found.x, cold.x, atol=1e-6)
    assert excess(second, found.x) <= 0.0


def test_where_the_objective_alone_is_sought_fewer_steps_give_it() -> None:
    fewer = 0
    for seed in range(5):
        first, second = random_problem(seed, 0.01)
        known, cold = solved(first, np.zeros(20)), solved(second, np.zeros(20))
        whole = follow(second, known)
        barrier = dataclasses.replace(known.barrier, bounds=second.bounds)
        loose = dataclasses.replace(OPTIONS, enough=1e-3)
        found = follow_bounded(second, known.x, barrier, loose, most_outside=5e-3)
        assert found.why is Reason.STATIONARY
        assert found.outputs.value == pytest.approx(cold.outputs.value, rel=1e-3)
        assert found.iterations <= whole.iterations
        fewer += whole.iterations - found.iterations
    assert fewer >= 1


def test_the_same_problem_takes_one_step() -> None:
    problem, _ = random_problem(0, 0.0)
    found = follow(problem, solved(problem, np.zeros(20)))
    assert found.why is Reason.STATIONARY
    assert found.iterations <= 2


def test_other_bounds_hold_the_solution_after_a_larger_move() -> None:
    first, second = random_problem(0, 0.01)
    known, cold = solved(first, np.zeros(20)), solved(second, np.zeros(20))
    before, after = (each.barrier.zl + each.barrier.zu > 1e-3 for each in (known, cold))
    assert (before != after).sum() >= 4
    found = follow(second, known)
    assert found.why is Reason.STATIONARY
    np.testing.assert_allclose(found.x, cold.x, atol=1e-6)


def test_a_point_that_is_no_minimum_is_not_found() -> None:
    """1 + x^2 / 2 - y^2 with |y| <= 10 is largest along y at y = 0."""
    program = Program(
        2,
        lambda x: 1 + x[0] ** 2 / 2 - x[1] ** 2,
        lambda x: [x[1]],
        [-10.0],
        [10.0],
    )
    known = minimize_bounded(program, np.array([0.1, 2.0]), Criteria())
    start = dataclasses.replace(known.barrier, s=np.zeros(1), zl=np.zeros(1), zu=np.zeros(1))
    found = follow_bounded(program, np.zeros(2), start, OPTIONS)
    assert found.why is Reason.DIVERGED
    assert found.iterations == 0


def test_steps_that_do_not_converge_end_soon() -> None:
    """An output that bends so much that whole steps leave its bound further and further."""
    program = Program(
        1,
        lambda x: 1 + (x[0] - 3.0) ** 2,
        lambda x: [ca.exp(8.0 * x[0])],
        [-np.inf],
        [1.0],
    )
    known = minimize_bounded(program, np.array([-0.5]), Criteria())
    start = dataclasses.replace(known.barrier, s=np.array([-5.0]), zu=np.zeros(1))
    found = follow_bounded(program, np.array([-2.0]), start, OPTIONS)
    assert found.why is Reason.DIVERGED
    assert found.iterations <= 3


class Refined(Quadratic):
    """A program whose outputs are replaced by looser ones once."""

    refinements = 0

    def refine(self, x: Array, level: float) -> Refinement | None:
        if self.refinements:
            return None
        self.refinements += 1
        bounds = self.bounds
        self.bounds = Bounds(1.02 * bounds.lower, 1.02 * bounds.upper, bounds.weights)
        return Refinement(np.zeros(0, np.intp), np.arange(len(self.A)))


def test_outputs_are_refined_at_the_end() -> None:
    first, second = random_problem(1, 0.003)
    refined = Refined(second.H, second.g, second.A, second.bounds.lower, second.bounds.upper)
    looser = Quadratic(
        second.H, second.g, second.A, 1.02 * second.bounds.lower, 1.02 * second.bounds.upper
    )
    found = follow(refined, solved(first, np.zeros(20)))
    assert refined.refinements == 1
    assert found.why is Reason.STATIONARY
    np.testing.assert_allclose(found.x, solved(looser, np.zeros(20)).x, atol=1e-4)


class Late(Quadratic):
    """A program that runs out of time, or is interrupted, after some evaluations."""

    evaluations = 0
    error: type[BaseException] = OutOfTimeError

    def outputs(self, x: Array) -> Outputs:
        self.evaluations += 1
        if self.evaluations > 2:
            raise self.error
        return super().outputs(x)


@pytest.mark.parametrize(
    ("error", "stop"),
    [
        (OutOfTimeError, Reason.TIME_LIMIT),
        (KeyboardInterrupt, Reason.INTERRUPTED),
        (ArithmeticError, Reason.DIVERGED),
    ],
)
def test_it_ends_with_a_point_where_it_is_stopped(error: type[BaseException], stop: Reason) -> None:
    first, second = random_problem(2, 0.003)
    late = Late(second.H, second.g, second.A, second.bounds.lower, second.bounds.upper)
    late.error = error
    found = follow(late, solved(first, np.zeros(20)))
    assert found.why is stop
    assert found.iterations <= 1
