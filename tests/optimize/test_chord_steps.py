"""Chord steps reach rounding errors with gradients alone, and give up where they do not help."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.chord_steps import MAX_CHORD_STEPS, polish
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.quadratic_model import Factor, QuadraticModel
from hovi.optimize.trust_region import minimize
from optimize.test_trust_region import Smooth

Array = npt.NDArray[np.float64]

MINIMUM = np.array([1.0, 1.0, 1.0])
NEARBY = MINIMUM + np.array([1e-5, -1e-5, 2e-5])


class WithGradients(Smooth):
    """Also evaluates gradients alone; counts them and the models."""

    gradients = models = 0
    factor = 1.0

    def gradient(self, x: Array, model: QuadraticModel) -> Array:
        self.gradients += 1
        return self.factor * self.second(x)[0].full().ravel()

    def model(
        self, x: Array, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        self.models += 1
        return super().model(x, previous, step)


class WithoutGradients(WithGradients):
    """Counts models alone."""

    def gradient(self, x: Array, model: QuadraticModel) -> None:
        return None


class Soft:
    """A factorisation whose steps are a fifth too short."""

    def __init__(self, inner: Factor) -> None:
        self.inner = inner

    def solve(self, rhs: Array) -> Array:
        return 0.8 * self.inner.solve(rhs)


def valley(kind: type[Smooth] = WithGradients) -> Smooth:
    """A chain of Rosenbrock's function, plus one, whose minimum is MINIMUM."""
    x = ca.SX.sym("x", 3)
    terms = (10 * (x[i + 1] - x[i] ** 2) ** 2 + (1 - x[i]) ** 2 for i in range(2))
    return kind(x, 1 + sum(terms))


def newton_step(objective: Smooth, x: Array) -> tuple[Array, float, QuadraticModel, Factor, float]:
    """The arguments of `polish` after a Newton step from x."""
    model = objective.model(x, None, None)
    factor = model.factor(0.0)
    assert factor is not None
    step, slope, _ = model.descend(factor)
    return x + step, objective.value(x + step), model, factor, -slope / 2


def test_gradients_alone_reach_rounding_errors() -> None:
    objective = valley()
    after = newton_step(objective, NEARBY)
    assert np.abs(after[0] - MINIMUM).max() > 1e-9
    polished = polish(objective, *after)
    assert polished is not None
    np.testing.assert_allclose(polished[0], MINIMUM, rtol=0, atol=1e-13)
    assert polished[1] == objective.value(polished[0])
    assert objective.models == 1
    assert objective.gradients <= 3


@pytest.mark.parametrize("factor", [-1.0, 1e4, np.nan])
def test_steps_that_do_not_converge_are_given_up(factor: float) -> None:
    objective = valley()
    after = newton_step(objective, NEARBY)
    objective.factor = factor
    assert polish(objective, *after) is None


def test_steps_that_converge_slowly_are_given_up_after_a_few() -> None:
    objective = valley()
    x, value, model, factor, decrease = newton_step(objective, MINIMUM + 1e-3)
    assert polish(objective, x, value, model, Soft(factor), decrease) is None
    assert objective.gradients == MAX_CHORD_STEPS


def test_a_value_that_increases_by_more_than_rounding_is_refused() -> None:
    objective = valley()
    x, value, *rest = newton_step(objective, NEARBY)
    assert polish(objective, x, value - 1e-9, *rest) is None
    assert polish(objective, x, value, *rest) is not None


def test_an_objective_without_gradients_is_left_alone() -> None:
    objective = valley(Smooth)
    assert polish(objective, *newton_step(objective, NEARBY)) is None


def test_a_minimum_takes_fewer_models_with_gradients() -> None:
    options = Criteria(decrease=1e-6, exact=True)
    with_gradients, without = valley(), valley(WithoutGradients)
    polished = minimize(with_gradients, NEARBY, options)
    plain = minimize(without, NEARBY, options)
    for outcome in (polished, plain):
        assert outcome.why is Reason.STATIONARY
        assert outcome.convex
        np.testing.assert_allclose(outcome.x, MINIMUM, rtol=0, atol=1e-12)
    assert with_gradients.models == without.models - 1
    assert with_gradients.gradients <= 2
