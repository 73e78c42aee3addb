"""The interior-point method on small problems with known solutions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.linalg import cho_solve
from scipy.optimize import linprog, minimize

from hovi.optimize.barrier import Bounds
from hovi.optimize.bounded_objective import BoundedObjective, BoundedOutcome, Outputs, Refinement
from hovi.optimize.bounded_steps import LARGER_DENSITY
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.quadratic_model import Factor, IntervalSum, QuadraticModel
from hovi.system.deadline import OutOfTimeError

Array = npt.NDArray[np.float64]


class DenseFactor:
    def __init__(self, lower: Array) -> None:
        self.lower = lower

    def solve(self, rhs: Array) -> Array:
        return np.asarray(cho_solve((self.lower, True), rhs))


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
            return DenseFactor(np.linalg.cholesky(matrix))
        except np.linalg.LinAlgError:
            return None


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
        self.bounds = Bounds(np.array(lower, float), np.array(upper, float), np.ones(K))

    def outputs(self, x: Array) -> Outputs:
        value, y = self._outputs(x)
        return Outputs(float(value), y.full().ravel())

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        g, J = (part.full() for part in self._first(x))
        self._g, self._J = g.ravel(), J
        H = self._second(x, multipliers).full() + J.T @ (sigma[:, None] * J)
        return DenseModel(self._g + J.T @ rho, H)

    def push(self, step: Array, model: QuadraticModel) -> Array:
        return np.asarray(self._J @ step)

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        return np.asarray(self._J.T @ forces)

    def accept(self, step: Array, model: QuadraticModel) -> None:
        """There are no lifted variables."""

    def retract(self, x: Array, step: Array, model: QuadraticModel) -> Array:
        return x + step


class Disc(Program):
    """From behind a disc to the other side, with a model without the disc's curvature at hand."""

    @property
    def may_be_concave(self) -> bool:
        return True

    def __init__(self) -> None:
        def f(x: ca.SX) -> ca.SX:
            return (x[0] - 2.0) ** 2 + x[1] ** 2

        super().__init__(2, f, lambda x: [x[0] ** 2 + x[1] ** 2], [1.0], [np.inf])
        self.inexact_models = 0

    def model_without_concavity(self, x: Array) -> QuadraticModel:
        self.inexact_models += 1
        sigma, rho = self._last
        return super().model(x, sigma, rho, np.zeros(1))

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        self._last = sigma, rho
        return super().model(x, sigma, rho, multipliers)


class Quadratic(BoundedObjective[Array]):
    """min x H x / 2 + g x with lower <= A x <= upper, R points of one output in a unit of time."""

    def __init__(self, H: Array, g: Array, A: Array, lower: Array, upper: Array) -> None:
        self.H, self.g, self.A = H, g, A
        self.bounds = Bounds(lower, upper, np.full(len(A), 1.0 / len(A)))

    def value(self, x: Array) -> float:
        return float(x @ self.H @ x / 2 + self.g @ x)

    def outputs(self, x: Array) -> Outputs:
        return Outputs(self.value(x), self.A @ x)

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        w = self.bounds.weights
        H = self.H + self.A.T @ ((w * sigma)[:, None] * self.A)
        return DenseModel(self.H @ x + self.g + self.A.T @ (w * rho), H)

    def push(self, step: Array, model: QuadraticModel) -> Array:
        return np.asarray(self.A @ step)

    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        return np.asarray(self.A.T @ (self.bounds.weights * forces))

    def accept(self, step: Array, model: QuadraticModel) -> None:
        """There are no lifted variables."""

    def retract(self, x: Array, step: Array, model: QuadraticModel) -> Array:
        return x + step

    def outside(self, x: Array) -> float:
        """The largest violation of a bound."""
        y = self.A @ x
        return float(np.maximum(y - self.bounds.upper, self.bounds.lower - y).max())

    def optimality(self, outcome: BoundedOutcome[Array]) -> float:
        """The largest entry of the Lagrange function's gradient, over that of the objective."""
        force = self.A.T @ (self.bounds.weights * outcome.barrier.multipliers)
        gradient = self.H @ outcome.x + self.g
        return float(np.abs(gradient + force).max() / max(1.0, np.abs(gradient).max()))


class Majorant(Quadratic):
    """min (x0^2 + x1^2)/2 with x0 + x1 s >= s (2 - s) for all s in [0, 1], by control points.

    On [a, b] those of the difference are its values at both ends and, in the middle,
    x0 + (x1 - 2) (a + b)/2 + a b. With the tangent at s = u, x1 = 2 - 2 u and x0 = u^2, and
    u^3 + 2 u = 2 at the minimum.
    """

    def __init__(self, parts: int = 1) -> None:
        ends = np.linspace(0.0, 1.0, parts + 1)
        self.pairs = np.concatenate([np.stack([ends] * 2, 1), np.stack([ends[:-1], ends[1:]], 1)])
        super().__init__(np.eye(2), np.zeros(2), *self.rows())
        self.levels: list[float] = []

    def rows(self) -> tuple[Array, Array, Array]:
        middle, product = self.pairs.mean(axis=1), self.pairs.prod(axis=1)
        A = np.stack([np.ones(len(middle)), middle], axis=1)
        return A, 2 * middle - product, np.full(len(middle), INF)

    def refine(self, x: Array, level: float) -> Refinement | None:
        """Halve the parts in which the middle is the least, if its distance matters."""
        self.levels.append(level)
        before = self.pairs
        while (coarse := self.coarse(x, level)).any():
            (a, b), c = self.pairs[coarse].T, self.pairs[coarse].mean(axis=1)
            new = np.concatenate([np.stack(pair, 1) for pair in ((c, c), (a, c), (c, b))])
            self.pairs = np.concatenate([self.pairs[~coarse], new])
            self.A, lower, upper = self.rows()
            self.bounds = Bounds(lower, upper, np.full(len(lower), 0.1))
        if self.pairs is before:
            return None
        rest = {tuple(pair) for pair in self.pairs}
        kept = np.array([i for i, pair in enumerate(before) if tuple(pair) in rest])
        return Refinement(kept, np.full(len(self.pairs) - len(kept), -1))

    def coarse(self, x: Array, level: float) -> npt.NDArray[np.bool_]:
        width = np.diff(self.pairs)[:, 0]
        slack = np.maximum(self.A @ x - self.bounds.lower, 1e-12)
        return np.asarray((width**2 / 4 > level) & (level / slack * width**2 > 1e-7))


def random_quadratic(seed: int, n: int, R: int) -> tuple[Quadratic, Array, Callable[[], Array]]:
    """A convex program with R bounded outputs, which a point meets strictly, and a far start."""
    random = np.random.default_rng(seed)
    root, A = random.normal(size=(n, n)), random.normal(size=(R, n)) / np.sqrt(n)
    H = root @ root.T / n + 0.01 * np.eye(n)
    inside = A @ random.normal(size=n)
    lower = inside - random.uniform(0.01, 0.6, R)
    upper = inside + random.uniform(0.01, 0.6, R)
    lower[::5], upper[1::5] = -INF, INF
    program = Quadratic(H, 4.0 * random.normal(size=n), A, lower, upper)
    return program, 2.0 * random.normal(size=n), lambda: by_scipy(program)


def by_scipy(program: Quadratic) -> Array:
    """The minimum by sequential least squares."""
    low, high = (np.isfinite(b) for b in (program.bounds.lower, program.bounds.upper))
    rows = np.concatenate([program.A[low], -program.A[high]])
    level = np.concatenate([program.bounds.lower[low], -program.bounds.upper[high]])
    found = minimize(
        program.value,
        np.zeros(len(program.g)),
        jac=lambda x: program.H @ x + program.g,
        constraints={"type": "ineq", "fun": lambda x: rows @ x - level, "jac": lambda x: rows},
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return np.asarray(found.x)


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
        Program(n, f, y, lower, upper), np.array(start, dtype=float), Criteria()
    )
    assert outcome.why is Reason.STATIONARY
    assert outcome.feasible
    np.testing.assert_allclose(outcome.x, minimum, atol=2e-4)


@pytest.mark.parametrize("name", PROGRAMS)
def test_gradient_and_multipliers_balance_to_rounding(name: str) -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS[name]
    program = Program(n, f, y, lower, upper)
    outcome = minimize_bounded(program, np.array(start, dtype=float), Criteria())
    gradient, jacobian = (part.full() for part in program._first(outcome.x))
    forces = jacobian.T * outcome.barrier.multipliers
    residual = np.abs(gradient.ravel() + forces.sum(axis=1)).max()
    assert residual <= 1e-12 * max(1.0, np.abs(forces).max())


@pytest.mark.parametrize("name", sorted(PROGRAMS.keys() - CURVED_VALLEYS))
def test_convex_programs_take_few_steps(name: str) -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS[name]
    program = Program(n, f, y, lower, upper)
    outcome = minimize_bounded(program, np.array(start, dtype=float), Criteria())
    assert outcome.iterations <= 25


@pytest.mark.parametrize("far", [1.0, 10.0, 500.0])
def test_the_last_barrier_is_relative_to_the_objective_at_the_end(far: float) -> None:
    """However much more the objective is at the guess."""
    program = Program(1, lambda x: x[0] ** 2, lambda x: [x[0]], [1.0], [1e9])
    found = minimize_bounded(program, np.array([1.0 + far]), Criteria(barrier=1e-6))
    assert found.why is Reason.STATIONARY
    assert found.outputs.value - 1.0 <= 4e-6 * LARGER_DENSITY
    assert found.barrier.mu <= 1.1e-6 * LARGER_DENSITY


def test_multipliers_satisfy_the_optimality_conditions() -> None:
    """min (x - 3)^2 with x <= 1: 2 (x - 3) + z = 0, so z = 4."""
    program = Program(1, lambda x: (x[0] - 3) ** 2, lambda x: [x[0]], [0], [1])
    outcome = minimize_bounded(program, np.array([0.5]), Criteria())
    assert outcome.barrier.multipliers[0] == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize("turn", [0.02, 0.025])
def test_curvature_that_turns_negative_in_the_last_step_is_no_end(turn: float) -> None:
    """On y = 0 the curvature in y is negative where 1 - x < turn, and x creeps towards 1."""

    def f(x: ca.SX) -> ca.SX:
        return 1 + (1 - x[0]) ** 4 + (1 - x[0] - turn) * x[1] ** 2 + x[1] ** 4

    program = Program(2, f, lambda x: [x[0]], [-1e3], [1e3])
    options = Criteria(decrease=1e-6, barrier=1e-9)
    outcome = minimize_bounded(program, np.array([0.0, 0.0]), options)
    assert outcome.why is Reason.STATIONARY
    assert outcome.model is not None
    assert outcome.model.factor(0.0) is not None
    left = dataclasses.replace(options, escape_saddles=False)
    stopped = minimize_bounded(program, np.array([0.0, 0.0]), left)
    assert stopped.why is Reason.STATIONARY
    assert stopped.model is not None
    assert stopped.model.factor(0.0) is None
    assert outcome.outputs.value < stopped.outputs.value - 1e-5
    left = dataclasses.replace(options, max_iterations=stopped.iterations)
    ended = minimize_bounded(program, np.array([0.0, 0.0]), left)  # at the saddle
    assert ended.why is Reason.STATIONARY
    assert ended.model is not None
    assert ended.model.factor(0.0) is None


@pytest.mark.parametrize("start", [[-3.0, 0.0], [-3.0, 0.1]])
def test_a_stationary_point_of_a_model_without_all_of_its_curvature_is_no_end(
    start: list[float],
) -> None:
    disc = Disc()
    outcome = minimize_bounded(disc, np.array(start), Criteria())
    assert disc.inexact_models > 2
    assert outcome.why is Reason.STATIONARY
    assert np.allclose(outcome.x, [2.0, 0.0], atol=1e-5)  # not the saddle (-1, 0)
    assert isinstance(outcome.model, DenseModel)
    exact = disc.model(outcome.x, *outcome.barrier.condensed(outcome.outputs.y))
    np.testing.assert_array_equal(outcome.model.H, exact.H)
    on_the_way = [x for product, x in outcome.marks if product < 1e-2]
    assert on_the_way
    assert all(np.linalg.norm(x - [-1.0, 0.0]) > 0.1 for x in on_the_way)


class Ending(Quadratic):
    """Whose exact model is not convex in the last one of so many calls."""

    calls, last = 0, -1

    @property
    def may_be_concave(self) -> bool:
        return True

    def model(self, x: Array, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        self.calls += 1
        self._found = super().model(x, sigma, rho, multipliers)
        assert isinstance(self._found, DenseModel)
        concave = 1e20 * np.eye(len(x)) * (self.calls == self.last)
        return DenseModel(self._found.gradient, self._found.H - concave)

    def model_without_concavity(self, x: Array) -> QuadraticModel:
        return self._found


def test_the_model_at_the_end_is_exact_although_it_is_not_convex() -> None:
    one = np.eye(1)
    convex, ending = (Ending(one, -one[0], one, -9 * one[0], 9 * one[0]) for _ in range(2))
    minimize_bounded(convex, np.zeros(1), Criteria())
    ending.last = convex.calls
    outcome = minimize_bounded(ending, np.zeros(1), Criteria())
    assert ending.calls == convex.calls
    assert outcome.why is Reason.STATIONARY
    assert outcome.model is not None
    assert outcome.model.factor(0.0) is None


def test_the_violation_follows_outputs_and_slacks() -> None:
    program = Program(2, lambda x: x[0] + x[1], lambda x: [x[0], x[1]], [0, 0], [1, 1])
    outcome = minimize_bounded(program, np.array([0.5, 0.5]), Criteria())
    assert outcome.violation <= 1e-9
    outcome.outputs = program.outputs(outcome.x + np.array([0.25, -0.5]))
    assert outcome.violation == pytest.approx(0.5)
    outcome.barrier = dataclasses.replace(outcome.barrier, s=outcome.outputs.y + 0.125)
    assert outcome.violation == pytest.approx(0.125)


def test_limits_and_interrupts_return_the_current_point() -> None:
    n, f, y, lower, upper, start, _ = PROGRAMS["hock-schittkowski 43, from outside"]
    x = np.array(start, dtype=float)
    few = minimize_bounded(Program(n, f, y, lower, upper), x, Criteria(max_iterations=2))
    assert few.why is Reason.ITERATION_LIMIT
    assert few.iterations == 2

    def interrupt(iteration: int, value: float) -> None:
        if iteration == 3:
            raise KeyboardInterrupt

    stopped = minimize_bounded(Program(n, f, y, lower, upper), x, Criteria(), interrupt)
    assert stopped.why is Reason.INTERRUPTED
    assert stopped.iterations == 3


def test_an_infeasible_program_is_not_reported_as_solved() -> None:
    program = Program(1, lambda x: x[0] ** 2, lambda x: [x[0], x[0]], [2, -INF], [INF, 1])
    outcome = minimize_bounded(program, np.array([0.0]), Criteria(max_iterations=200))
    assert not (outcome.why is Reason.STATIONARY and outcome.feasible)


# Convex programs with linear outputs


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("n", "R"), [(30, 200), (60, 400), (100, 600)])
def test_quadratic_programs_with_hundreds_of_bounds_converge_from_far_outside(
    n: int, R: int, seed: int
) -> None:
    program, start, _ = random_quadratic(seed, n, R)
    outcome = minimize_bounded(program, start, Criteria())
    assert outcome.why is Reason.STATIONARY
    assert outcome.feasible
    assert program.outside(outcome.x) <= 1e-8
    assert program.optimality(outcome) <= 1e-9
    assert outcome.barrier.complementarity() <= 1e-6
    assert outcome.iterations <= 80


@pytest.mark.parametrize("seed", range(12))
def test_minima_of_quadratic_programs_are_those_of_scipy(seed: int) -> None:
    program, start, independent = random_quadratic(seed, 8, 30)
    outcome = minimize_bounded(program, start, Criteria())
    expected = independent()
    assert outcome.why is Reason.STATIONARY
    assert program.outside(expected) <= 1e-9
    assert outcome.outputs.value == pytest.approx(program.value(expected), rel=1e-7)
    np.testing.assert_allclose(outcome.x, expected, atol=1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_minima_of_linear_programs_are_those_of_scipy(seed: int) -> None:
    """Nothing but the bounds is curved; those of a box keep the program bounded."""
    random = np.random.default_rng(seed)
    n, R = 10, 25
    A = np.concatenate([np.eye(n), random.normal(size=(R, n))])
    lower = np.concatenate([-np.ones(n), np.full(R, -INF)])
    upper = np.concatenate([np.ones(n), random.uniform(0.2, 1.0, R)])
    program = Quadratic(np.zeros((n, n)), random.normal(size=n), A, lower, upper)
    outcome = minimize_bounded(program, 0.1 * random.normal(size=n), Criteria())
    expected = linprog(program.g, A_ub=A[n:], b_ub=upper[n:], bounds=(-1, 1))
    assert expected.success
    assert outcome.why is Reason.STATIONARY
    assert outcome.outputs.value == pytest.approx(expected.fun, rel=1e-6)
    assert program.outside(outcome.x) <= 1e-8


@pytest.mark.parametrize("seed", range(4))
def test_redundant_bounds_change_nothing(seed: int) -> None:
    """Every bound five times: multipliers are not unique, the minimum is."""
    program, start, independent = random_quadratic(seed, 6, 20)
    b = program.bounds
    many = Quadratic(
        program.H, program.g, np.tile(program.A, (5, 1)), np.tile(b.lower, 5), np.tile(b.upper, 5)
    )
    outcome = minimize_bounded(many, start, Criteria())
    assert outcome.why is Reason.STATIONARY
    assert outcome.iterations <= 25
    np.testing.assert_allclose(outcome.x, independent(), atol=1e-5)


def test_degenerate_corners_are_reached() -> None:
    """Three bounds meet in a plane's corner, of which one is weakly active: no multiplier."""
    A = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    program = Quadratic(
        np.eye(2), -np.array([2.0, 1.0]), A, np.full(3, -INF), np.array([1.0, 1.0, 2.0])
    )
    outcome = minimize_bounded(program, np.array([-3.0, 0.5]), Criteria())
    assert outcome.why is Reason.STATIONARY
    np.testing.assert_allclose(outcome.x, [1.0, 1.0], atol=1e-4)
    assert outcome.outputs.value == pytest.approx(-2.0, abs=1e-7)
    assert outcome.iterations <= 25


def test_bounds_that_leave_a_narrow_gap_converge() -> None:
    A, width = np.array([[1.0, 1.0]]), 1e-6
    program = Quadratic(np.eye(2), np.zeros(2), A, np.array([2.0]), np.array([2.0 + width]))
    outcome = minimize_bounded(program, np.array([5.0, -7.0]), Criteria())
    assert outcome.why is Reason.STATIONARY
    np.testing.assert_allclose(outcome.x, [1.0, 1.0], atol=2 * width)


@pytest.mark.parametrize("seed", range(6))
def test_bounds_that_contradict_each_other_are_told(seed: int) -> None:
    """The outputs y0 <= 0 and y0 >= gap, among others that can be met."""
    program, start, _ = random_quadratic(seed, 6, 20)
    A = np.concatenate([program.A, program.A[:1], program.A[:1]])
    gap = 10.0 ** -(seed % 3)
    lower = np.append(program.bounds.lower, [-INF, gap])
    upper = np.append(program.bounds.upper, [0.0, INF])
    outcome = minimize_bounded(
        Quadratic(program.H, program.g, A, lower, upper), start, Criteria(max_iterations=300)
    )
    assert not (outcome.why is Reason.STATIONARY and outcome.feasible)
    assert not outcome.feasible


# Bounds that are replaced on the way


def test_a_semi_infinite_program_ends_at_its_minimum() -> None:
    program = Majorant()
    root = np.sqrt(35 / 27)
    u = np.cbrt(1 + root) + np.cbrt(1 - root)
    outcome = minimize_bounded(program, np.array([3.0, 3.0]), Criteria())
    assert outcome.why is Reason.STATIONARY
    assert outcome.feasible
    s = np.linspace(0.0, 1.0, 100_001)
    assert (outcome.x[0] + outcome.x[1] * s - s * (2 - s)).min() >= 0
    np.testing.assert_allclose(outcome.x, [u**2, 2 - 2 * u], atol=1e-4)
    assert outcome.outputs.value == pytest.approx((u**4 + (2 - 2 * u) ** 2) / 2, abs=1e-7)
    assert len(outcome.barrier.s) == len(program.A) > 10
    assert program.levels[-1] < 1e-9


def test_few_further_steps_are_taken_for_bounds_that_are_replaced() -> None:
    """Against those of the program with all rows from the start."""
    found = minimize_bounded(Majorant(), np.array([3.0, 3.0]), Criteria())
    fine = Majorant(2048)
    fixed = Quadratic(fine.H, fine.g, fine.A, fine.bounds.lower, fine.bounds.upper)
    whole = minimize_bounded(fixed, np.array([3.0, 3.0]), Criteria())
    assert whole.why is Reason.STATIONARY
    assert found.outputs.value == pytest.approx(whole.outputs.value, abs=1e-6)
    assert found.iterations <= 2 * whole.iterations


# The points on the way, warm starts, and time limits


@pytest.mark.parametrize("seed", range(4))
def test_marks_are_the_points_before_the_product_halves(seed: int) -> None:
    """They descend, the last is the solution, and each is near the minimum with its barrier."""
    program, start, _ = random_quadratic(seed, 20, 60)
    outcome = minimize_bounded(program, start, Criteria(barrier=1e-8))
    levels = np.array([level for level, _ in outcome.marks])
    assert len(levels) > 4
    assert (levels[1:] <= levels[:-1]).all()
    assert (levels[2:] < 0.5 * levels[:-2]).all()  # two in one halving: its end, and the next
    np.testing.assert_array_equal(outcome.marks[-1][1], outcome.x)
    for level, x in outcome.marks[2:]:
        there = minimize_bounded(program, x, Criteria(barrier=level / density(program, start)))
        assert np.abs(there.x - x).max() <= 0.3 * np.abs(outcome.x - start).max()


def density(program: Quadratic, x: Array) -> float:
    """The mean density of the objective at a point, to which barrier parameters are relative."""
    return abs(program.outputs(x).value) / program.bounds.measure


def after_a_change(seed: int, enough: float = 0.0) -> tuple[BoundedOutcome[Array], ...]:
    """Of a quadratic program whose cost has changed a little: solved warm, and cold."""
    program, start, _ = random_quadratic(seed, 20, 200)
    first = minimize_bounded(program, start, Criteria(barrier=1e-8))
    program.g = program.g + 1e-4 * np.random.default_rng(seed).normal(size=20)
    near = first.barrier.warm(program.bounds, first.outputs.y, first.barrier.mu, 1e-6)
    options = Criteria(barrier=1e-8, enough=enough)
    warm = minimize_bounded(program, first.x, options, start=near)
    return warm, minimize_bounded(program, start, Criteria(barrier=1e-8))


@pytest.mark.parametrize("seed", range(4))
def test_a_solve_from_a_solution_and_its_multipliers_takes_few_steps(seed: int) -> None:
    warm, cold = after_a_change(seed)
    assert warm.why is cold.why is Reason.STATIONARY
    assert warm.feasible
    np.testing.assert_allclose(warm.x, cold.x, atol=1e-5)
    assert warm.iterations <= 0.7 * cold.iterations


@pytest.mark.parametrize("seed", range(4))
def test_enough_ends_a_solve_where_a_step_would_gain_less(seed: int) -> None:
    (exact, _), (rough, _) = after_a_change(seed), after_a_change(seed, 1e-4)
    assert rough.why is Reason.STATIONARY
    assert rough.feasible
    assert rough.iterations < exact.iterations
    assert abs(rough.outputs.value - exact.outputs.value) <= 1e-4 * abs(exact.outputs.value)


@pytest.mark.parametrize("steps", range(1, 8))
def test_out_of_time_the_best_point_within_the_bounds_is_kept(steps: int) -> None:
    """Not the last one: exp(x) exceeds its bound after the first step, which takes it as linear."""
    program = Program(1, lambda x: (x[0] - 3) ** 2, lambda x: [ca.exp(x[0])], [0], [2])

    def late(iteration: int, value: float) -> None:
        if iteration == steps:
            raise OutOfTimeError

    stopped = minimize_bounded(program, np.zeros(1), Criteria(), late)
    assert stopped.why is Reason.TIME_LIMIT
    assert np.exp(stopped.x[0]) <= 2.0 * (1 + 1e-6)
    np.testing.assert_array_equal(program.outputs(stopped.x).y, stopped.outputs.y)
    if steps > 5:
        assert stopped.outputs.value < 9.0


@pytest.mark.parametrize("steps", range(1, 14))
def test_out_of_time_the_kept_point_has_the_outputs_of_the_last_bounds(steps: int) -> None:
    """Also if they were refined after it."""
    program = Majorant()

    def late(iteration: int, value: float) -> None:
        if iteration == steps:
            raise OutOfTimeError

    stopped = minimize_bounded(program, np.array([3.0, 3.0]), Criteria(), late)
    np.testing.assert_allclose(stopped.outputs.y, program.outputs(stopped.x).y)
    assert stopped.barrier.s.shape == stopped.outputs.y.shape == program.bounds.lower.shape


@pytest.mark.parametrize("calls", range(3, 30))
def test_out_of_time_within_the_outputs_the_outcome_is_of_one_set_of_bounds(calls: int) -> None:
    """Outputs that take long run out of time themselves, also while they are refined."""

    class Slow(Majorant):
        called = 0

        def outputs(self, x: Array) -> Outputs:
            self.called += 1
            if self.called == calls:
                raise OutOfTimeError
            return super().outputs(x)

    stopped = minimize_bounded(Slow(), np.array([3.0, 3.0]), Criteria())
    assert stopped.why in (Reason.TIME_LIMIT, Reason.STATIONARY)
    assert stopped.barrier.s.shape == stopped.barrier.zl.shape == stopped.outputs.y.shape


def test_the_kept_point_is_the_best_one_within_the_bounds() -> None:
    bounds = Bounds(np.zeros(1), np.ones(1), np.ones(1))
    outcome = BoundedOutcome(0, Outputs(0.0, np.zeros(1)), None, Reason.TIME_LIMIT)  # type: ignore[arg-type]
    points = [(5.0, 0.5), (1.0, 1.1), (3.0, 1.0), (4.0, 0.2), (2.0, -1e-5)]
    for number, (value, y) in enumerate(points):
        outcome.x, outcome.outputs = number, Outputs(value, np.array([y]))
        outcome.keep_best(bounds)
    assert outcome.kept is not None
    assert outcome.kept[0] == 2
