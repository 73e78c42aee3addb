"""Minima under equations in the plane and in space, against SciPy and known solutions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import minimize

from hovi.optimize.banded_model import BandLayout
from hovi.optimize.constrained_model import ConstrainedModel, ConstraintRows, EqualityObjective
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Iteration, Reason
from hovi.optimize.lagrange_newton import ConstrainedOutcome, minimize_under_equations
from hovi.optimize.quadratic_model import IntervalSum
from hovi.optimize.restoration import restore

Formula = Callable[[ca.SX], ca.SX]


class Formulas(EqualityObjective[np.ndarray]):
    """f and c as CasADi formulas of n numbers, which are the columns of one interval."""

    def __init__(self, n: int, f: Formula, c: Sequence[Formula]) -> None:
        x = ca.SX.sym("x", n)
        cost, equations = f(x), ca.vertcat(*(each(x) for each in c))
        y = ca.SX.sym("y", len(c))
        H = ca.hessian(cost + ca.dot(y, equations), x)[0]
        A = ca.jacobian(equations, x)
        self.values = ca.Function("values", [x], [cost, equations])
        self.slopes = ca.Function("slopes", [x, y], [ca.gradient(cost, x), A, H])
        self.layout = BandLayout.of(np.arange(n)[None, None])
        self.metric = self.layout.assemble(np.eye(n)[None, None, None])
        self.models = 0

    def evaluate(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        f, c = self.values(x)
        return float(f), np.asarray(c).ravel()

    def feasible(self, x: np.ndarray) -> bool:
        return bool(np.max(np.abs(self.evaluate(x)[1])) <= 1e-10)

    def model(self, x: np.ndarray, multipliers: np.ndarray, exact: bool = True) -> ConstrainedModel:
        self.models += 1
        g, A, H = (np.asarray(each) for each in self.slopes(x, multipliers))
        n = len(x)
        sums = IntervalSum(g.reshape(1, 1, n), H[None, None, None].copy(), np.ones((1, 1, 1)))
        rows = [ConstraintRows(slice(None), A.reshape(1, -1, 1, n).copy())]
        return ConstrainedModel(sums, rows, multipliers, self.layout, self.metric)

    def retract(self, x: np.ndarray, step: np.ndarray, model: ConstrainedModel) -> np.ndarray:
        return np.asarray(x + step)


def solve(
    objective: Formulas, x: Sequence[float], penalty: float = 10.0, **options: float
) -> ConstrainedOutcome[np.ndarray]:
    return minimize_under_equations(objective, np.array(x), penalty, Criteria(**options))


def kkt_error(objective: Formulas, found: ConstrainedOutcome[np.ndarray]) -> float:
    """The largest component of grad f + A^T y, and of c."""
    g, A, _ = (np.asarray(each) for each in objective.slopes(found.x, found.multipliers))
    stationary = g.ravel() + A.T @ found.multipliers
    return float(max(np.abs(stationary).max(), np.abs(objective.evaluate(found.x)[1]).max()))


def hs6() -> Formulas:
    return Formulas(2, lambda x: (1 - x[0]) ** 2, [lambda x: 10 * (x[1] - x[0] ** 2)])


def hs7() -> Formulas:
    circle = [lambda x: (1 + x[0] ** 2) ** 2 + x[1] ** 2 - 4]
    return Formulas(2, lambda x: ca.log(1 + x[0] ** 2) - x[1], circle)


def hs40() -> Formulas:
    rows = [
        lambda x: x[0] ** 3 + x[1] ** 2 - 1,
        lambda x: x[0] ** 2 * x[3] - x[2],
        lambda x: x[3] ** 2 - x[1],
    ]
    return Formulas(4, lambda x: -x[0] * x[1] * x[2] * x[3], rows)


def hs77() -> Formulas:
    def f(x: ca.SX) -> ca.SX:
        squares = (x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + (x[2] - 1) ** 2
        return squares + (x[3] - 1) ** 4 + (x[4] - 1) ** 6

    rows = [
        lambda x: x[0] ** 2 * x[3] + ca.sin(x[3] - x[4]) - 2 * np.sqrt(2),
        lambda x: x[1] + x[2] ** 4 * x[3] ** 2 - 8 - np.sqrt(2),
    ]
    return Formulas(5, f, rows)


CASES = {
    "HS6": (hs6, [-1.2, 1.0], 0.0),
    "HS7": (hs7, [2.0, 2.0], -np.sqrt(3)),
    "HS40": (hs40, [0.8, 0.8, 0.8, 0.8], -0.25),
    "HS77": (hs77, [2.0, 2.0, 2.0, 2.0, 2.0], 0.24150513),
}
"""Problems of Hock and Schittkowski, with their starts and minima."""


@pytest.mark.parametrize("name", CASES)
def test_the_known_minimum_is_found_where_scipy_finds_it(name: str) -> None:
    make, start, least = CASES[name]
    objective = make()
    found = solve(objective, start)
    assert found.why is Reason.STATIONARY
    assert found.convex
    assert found.value == pytest.approx(least, abs=1e-7)
    assert kkt_error(objective, found) < 1e-7
    equations = {"type": "eq", "fun": lambda x: objective.evaluate(x)[1]}
    near = found.x + 1e-2
    scipy_found = minimize(
        lambda x: objective.evaluate(x)[0], near, constraints=equations, method="SLSQP", tol=1e-12
    )
    np.testing.assert_allclose(found.x, scipy_found.x, rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", ["HS7", "HS40"])
def test_the_last_steps_converge_quadratically(name: str) -> None:
    """Every decrease, and every residual, is of the order of the last one's square."""
    make, start, _ = CASES[name]
    history = solve(make(), start).history[-4:]
    assert all(isinstance(each, Iteration) for each in history)
    for before, after in pairwise(history):
        assert after.ratio == 1.0
        assert after.decrease <= max(100.0 * before.decrease**2, 1e-15)
        assert after.residual <= max(100.0 * before.radius**2, 1e-14)


def test_one_model_is_evaluated_in_every_step() -> None:
    objective = hs7()
    found = solve(objective, [2.0, 2.0])
    assert found.iterations == len(found.history) == objective.models


def test_a_second_order_correction_saves_whole_steps_along_a_circle() -> None:
    """Maratos: near the minimum (1, 0) a whole step increases both f and |c|."""
    maratos = Formulas(
        2,
        lambda x: 2 * (x[0] ** 2 + x[1] ** 2 - 1) - x[0],
        [lambda x: x[0] ** 2 + x[1] ** 2 - 1],
    )
    found = solve(maratos, [np.cos(0.4), np.sin(0.4)])
    np.testing.assert_allclose(found.x, [1.0, 0.0], atol=1e-8)
    assert found.iterations <= 7
    assert all(step.ratio == 1.0 for step in found.history)


def saddle() -> Formulas:
    """On the cylinder x^2 + y^2 = 1 the point (1, 0, 0) is a saddle: it falls to both sides in z.

    Its minima are (1, 0, +-1/2) with f = -1/16 - 1.
    """
    f = lambda x: x[2] ** 4 - x[2] ** 2 / 2 - x[0]  # noqa: E731
    return Formulas(3, f, [lambda x: x[0] ** 2 + x[1] ** 2 - 1])


def test_a_saddle_is_left_along_negative_curvature() -> None:
    found = solve(saddle(), [1.0, 0.0, 0.0])
    assert found.convex
    assert found.saddles_left == pytest.approx([-1.0])
    np.testing.assert_allclose(np.abs(found.x), [1.0, 0.0, 0.5], atol=1e-7)
    assert found.value == pytest.approx(-1.0625)


def test_a_saddle_where_one_is_to_stop_is_not_called_convex() -> None:
    objective = saddle()
    found = minimize_under_equations(
        objective, np.array([1.0, 0.0, 0.0]), 10.0, Criteria(escape_saddles=False)
    )
    assert found.why is Reason.STATIONARY
    assert not found.convex
    np.testing.assert_allclose(found.x, [1.0, 0.0, 0.0])
    model = objective.model(found.x, found.multipliers)
    assert model.negative_eigenvalues(1e6) == 1


def test_negative_curvature_across_the_equations_is_no_saddle() -> None:
    """f falls away from the line x0 = 0 on both sides, on which (0, 1) is a minimum."""
    line = Formulas(2, lambda x: -30 * x[0] ** 2 + (x[1] - 1) ** 2, [lambda x: x[0]])
    found = solve(line, [0.5, 0.0], penalty=1.0)
    assert found.convex
    np.testing.assert_allclose(found.x, [0.0, 1.0], atol=1e-9)
    assert found.penalty > 30.0


def test_an_equation_stated_twice_changes_nothing() -> None:
    rows = [lambda x: 10 * (x[1] - x[0] ** 2)]
    twice = Formulas(2, lambda x: (1 - x[0]) ** 2, rows * 2)
    found = solve(twice, [-1.2, 1.0])
    assert found.convex
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-8)


@pytest.mark.parametrize(
    ("rows", "residual"),
    [
        ([lambda x: x[0], lambda x: x[0] - 1], np.sqrt(0.5)),
        ([lambda x: ca.sumsqr(x) - 1, lambda x: ca.sumsqr(x) - 4], 1.5 * np.sqrt(2)),
    ],
    ids=["parallel lines", "concentric circles"],
)
def test_what_cannot_be_met_is_stuck_at_a_minimum_of_the_residual(
    rows: list[Formula], residual: float
) -> None:
    objective = Formulas(2, lambda x: x[0] ** 2 + x[1] ** 2, rows)
    found = solve(objective, [0.7, 0.3])
    assert found.why is Reason.DIVERGED
    assert found.stuck
    size = np.linalg.norm(objective.evaluate(found.x)[1])
    assert size == pytest.approx(residual, abs=1e-5)
    least = minimize(lambda x: np.sum(objective.evaluate(x)[1] ** 2), found.x, tol=1e-12)
    assert size == pytest.approx(np.sqrt(least.fun), rel=1e-9)


@pytest.mark.parametrize("row", [lambda x: x[0] ** 2 + 1, lambda x: ca.exp(x[0]) + 1])
def test_an_equation_without_a_root_ends_without_a_minimum(row: Formula) -> None:
    found = solve(Formulas(2, lambda x: x[0] ** 2 + x[1] ** 2, [row]), [0.7, 0.3])
    assert found.why is Reason.DIVERGED
    assert not found.convex


def test_a_residual_that_can_be_made_smaller_to_both_sides_is_not_stuck() -> None:
    """1 - x0^2 is stationary at x0 = 0, and largest."""
    hill = Formulas(2, lambda x: x[1] ** 2, [lambda x: 1 - x[0] ** 2])
    found = solve(hill, [0.0, 0.3])
    assert not found.stuck


def test_known_multipliers_of_the_minimum_save_steps() -> None:
    make, start, _ = CASES["HS40"]
    cold = solve(make(), start)
    near = cold.x + 1e-5
    warm = minimize_under_equations(make(), near, 10.0, Criteria(), cold.multipliers)
    assert warm.iterations <= 3
    assert warm.iterations < len(solve(make(), list(near)).history)


def test_a_start_that_is_not_finite_diverges() -> None:
    root = Formulas(2, lambda x: ca.sqrt(x[0]) + x[1] ** 2, [lambda x: x[0] - 1])
    assert solve(root, [-1.0, 0.0]).why is Reason.DIVERGED


def test_limits_on_steps_and_time_end_the_search() -> None:
    make, start, _ = CASES["HS77"]
    few = solve(make(), start, max_iterations=2)
    assert few.why is Reason.ITERATION_LIMIT
    assert few.iterations == 2
    assert solve(make(), start, time_limit=0.0).why is Reason.TIME_LIMIT


def test_an_interrupt_ends_the_search_with_the_last_point() -> None:
    class Interrupted(Formulas):
        def model(
            self, x: np.ndarray, multipliers: np.ndarray, exact: bool = True
        ) -> ConstrainedModel:
            if self.models == 3:
                raise KeyboardInterrupt
            return super().model(x, multipliers, exact)

    rows = [lambda x: (1 + x[0] ** 2) ** 2 + x[1] ** 2 - 4]
    found = solve(Interrupted(2, lambda x: ca.log(1 + x[0] ** 2) - x[1], rows), [2.0, 2.0])
    assert found.why is Reason.INTERRUPTED
    assert found.iterations == 3


@pytest.mark.parametrize(("residual", "stuck"), [(2.0, True), (0.0, False)])
def test_without_unknowns_equations_that_do_not_hold_are_stuck(
    residual: float, stuck: bool
) -> None:
    fixed = Formulas(1, lambda x: x[0] ** 2, [lambda x: x[0] - 1 + residual])
    fixed.layout = BandLayout.of(np.full((1, 1, 1), -1))
    fixed.metric = fixed.layout.assemble(np.ones((1, 1, 1, 1, 1)))
    found = restore(fixed, np.ones(1), 10)
    assert found.stuck is stuck
    assert found.x == 1.0
