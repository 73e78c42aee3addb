"""The interior-point method on small problems with known solutions."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.interior_point import BoundedObjective, Outputs, minimize_bounded
from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel
from hovi.optimize.trust_region import Options, Stop

Array = npt.NDArray[np.float64]


class DenseFactor:
    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix

    def solve(self, rhs: Array) -> Array:
        return np.linalg.solve(self.matrix, rhs)


class DenseModel(QuadraticModel):
    """A model of one interval with n unknowns and the unit metric."""

    def __init__(self, gradient: Array, hessian: Array) -> None:
        n = len(gradient)
        blocks = hessian.reshape(1, n, n, 1, 1)
        super().__init__(IntervalSum(gradient.reshape(1, n, 1), blocks, np.eye(n)[None]))
        self.H = hessian

    def scatter(self, local: Array) -> Array:
        return local.ravel()

    def gather(self, s: Array) -> Array:
        return s.reshape(1, -1, 1)

    def factor(self, shift: float) -> Factor | None:
        matrix = self.H + shift * np.eye(len(self.H))
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            return None
        return DenseFactor(matrix)


class Program(BoundedObjective[Array]):
    """min f(x) with lower <= y(x) <= upper, one point of weight one."""

    def __init__(
        self,
        n: int,
        f: Callable[[ca.SX], ca.SX],
        y: Callable[[ca.SX], list[ca.SX]],
        lower: list[float],
        upper: list[float],
    ) -> None:
        x = ca.SX.sym("x", n)
        value, outputs = f(x), ca.vertcat(*y(x))
        K = outputs.shape[0]
        z = ca.SX.sym("z", K)
        H = ca.hessian(value + ca.dot(z, outputs), x)[0]
        self._outputs = ca.Function("outputs", [x], [value, outputs])
        self._first = ca.Function("first", [x], [ca.gradient(value, x), ca.jacobian(outputs, x)])
        self._second = ca.Function("second", [x, z], [H])
        self.bounds = Bounds(np.array([lower], float), np.array([upper], float), np.ones((1, 1)))

    def outputs(self, x: Array) -> Outputs:
        value, y = self._outputs(x)
        return Outputs(float(value), y.full().reshape(1, -1))

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        g, J = (part.full() for part in self._first(x))
        self._g, self._J = g.ravel(), J
        H = self._second(x, multipliers.ravel()).full() + J.T @ (sigma.ravel()[:, None] * J)
        return DenseModel(self._g + J.T @ rho.ravel(), H)

    def linear_outputs(self, step: Array, model: QuadraticModel) -> tuple[float, Array]:
        return float(self._g @ step), (self._J @ step).reshape(1, -1)

    def apply_fraction(self, fraction: float) -> None:
        """There are no lifted variables."""

    def retract(self, x: Array, step: Array, model: QuadraticModel) -> Array:
        return x + step


INF = np.inf

# name: (n, f, y, lower, upper, start, minimum)
PROGRAMS = {
    "a corner of a box": (
        2,
        lambda x: (x[0] - 3) ** 2 + (x[1] + 2) ** 2,
        lambda x: [x[0], x[1]],
        [0, 0],
        [1, 1],
        [0.5, 0.5],
        [1, 0],
    ),
    "hock-schittkowski 1": (
        2,
        lambda x: 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2,
        lambda x: [x[1]],
        [-1.5],
        [INF],
        [-2, 1],
        [1, 1],
    ),
    "hock-schittkowski 3": (
        2,
        lambda x: x[1] + 1e-5 * (x[1] - x[0]) ** 2,
        lambda x: [x[1]],
        [0],
        [INF],
        [10, 1],
        [0, 0],
    ),
    "hock-schittkowski 12": (
        2,
        lambda x: 0.5 * x[0] ** 2 + x[1] ** 2 - x[0] * x[1] - 7 * x[0] - 7 * x[1],
        lambda x: [4 * x[0] ** 2 + x[1] ** 2],
        [-INF],
        [25],
        [0, 0],
        [2, 3],
    ),
    "hock-schittkowski 43, from outside": (
        4,
        lambda x: ca.sumsqr(x) + x[2] ** 2 - 5 * x[0] - 5 * x[1] - 21 * x[2] + 7 * x[3],
        lambda x: [
            ca.sumsqr(x) + x[0] - x[1] + x[2] - x[3],
            x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2 + 2 * x[3] ** 2 - x[0] - x[3],
            2 * x[0] ** 2 + x[1] ** 2 + x[2] ** 2 + 2 * x[0] - x[1] - x[3],
        ],
        [-INF] * 3,
        [8, 10, 5],
        [3, 3, 3, 3],
        [0, 1, 2, -1],
    ),
    "inactive bounds": (
        2,
        lambda x: (x[0] - 1) ** 2 + 3 * (x[1] - 2) ** 2 + 1,
        lambda x: [x[0], x[1]],
        [-10, -10],
        [10, 10],
        [-4, 7],
        [1, 2],
    ),
}
CURVED_VALLEYS = {"hock-schittkowski 1"}


@pytest.mark.parametrize("name", PROGRAMS)
def test_the_known_minimum_is_found(name: str) -> None:
    n, f, y, lower, upper, start, minimum = PROGRAMS[name]
    outcome = minimize_bounded(
        Program(n, f, y, lower, upper), np.array(start, dtype=float), Options()
    )
    assert outcome.stop is Stop.STATIONARY
    assert outcome.feasible
    np.testing.assert_allclose(outcome.x, minimum, atol=2e-4)


@pytest.mark.parametrize("name", PROGRAMS)
def test_gradient_and_multipliers_balance_to_rounding(name: str) -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS[name]
    program = Program(n, f, y, lower, upper)
    outcome = minimize_bounded(program, np.array(start, dtype=float), Options())
    gradient, jacobian = (part.full() for part in program._first(outcome.x))
    forces = jacobian.T * outcome.barrier.multipliers.ravel()
    residual = np.abs(gradient.ravel() + forces.sum(axis=1)).max()
    assert residual <= 1e-12 * max(1.0, np.abs(forces).max())


@pytest.mark.parametrize("name", sorted(PROGRAMS.keys() - CURVED_VALLEYS))
def test_convex_programs_take_few_steps(name: str) -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS[name]
    program = Program(n, f, y, lower, upper)
    outcome = minimize_bounded(program, np.array(start, dtype=float), Options())
    assert outcome.iterations <= 25


def test_multipliers_satisfy_the_optimality_conditions() -> None:
    """min (x - 3)^2 with x <= 1: 2 (x - 3) + z = 0, so z = 4."""
    program = Program(1, lambda x: (x[0] - 3) ** 2, lambda x: [x[0]], [0], [1])
    outcome = minimize_bounded(program, np.array([0.5]), Options())
    assert outcome.barrier.multipliers[0, 0] == pytest.approx(4.0, rel=1e-6)


def test_limits_and_interrupts_return_the_current_point() -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS["hock-schittkowski 43, from outside"]
    x = np.array(start, dtype=float)
    few = minimize_bounded(Program(n, f, y, lower, upper), x, Options(max_iterations=2))
    assert few.stop is Stop.ITERATION_LIMIT
    assert few.iterations == 2

    def interrupt(iteration: int, value: float) -> None:
        if iteration == 3:
            raise KeyboardInterrupt

    stopped = minimize_bounded(Program(n, f, y, lower, upper), x, Options(), interrupt)
    assert stopped.stop is Stop.INTERRUPTED
    assert stopped.iterations == 3


def test_an_infeasible_program_is_not_reported_as_solved() -> None:
    program = Program(1, lambda x: x[0] ** 2, lambda x: [x[0], x[0]], [2, -INF], [INF, 1])
    outcome = minimize_bounded(program, np.array([0.0]), Options(max_iterations=200))
    assert not (outcome.stop is Stop.STATIONARY and outcome.feasible)


def test_the_barrier_keeps_slacks_inside_and_matches_its_gradient() -> None:
    bounds = Bounds(np.array([[0.0, -INF, 0.0]]), np.array([[1.0, 2.0, INF]]), np.ones((1, 1)))
    barrier = Barrier.central(bounds, np.array([[5.0, 1.0, 3.0]]), mu=0.1)
    assert ((barrier.s > bounds.lower) & (barrier.s < bounds.upper)).all()
    np.testing.assert_allclose(barrier.s[0, 1:], [1.0, 3.0])
    value = -0.1 * (np.log(0.99) + np.log(0.01) + np.log(2.0 - 1.0) + np.log(3.0))
    assert barrier.value(np.ones((1, 1))) == pytest.approx(value)
    e = 1e-6
    change = np.array([[e, e, e]])
    up, down = (barrier.value(np.ones((1, 1)), barrier.s + sign * change) for sign in (1, -1))
    slope = (up - down) / (2 * e)
    assert slope == pytest.approx(float(barrier.gradient.sum()), rel=1e-5)
    assert barrier.max_share(np.array([[1.0, -1e9, 1e9]])) < 0.0101
    assert barrier.zu[0, 2] == barrier.zl[0, 1] == 0.0
