"""Chord steps reach rounding errors with gradients alone, and give up where they do not help."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.chord_steps import polish
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import Options, Outcome, Stop, Trial, minimize
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


def valley(kind: type[Smooth] = WithGradients) -> Smooth:
    """A chain of Rosenbrock's function, plus one, whose minimum is MINIMUM."""
    x = ca.SX.sym("x", 3)
    terms = (10 * (x[i + 1] - x[i] ** 2) ** 2 + (1 - x[i]) ** 2 for i in range(2))
    return kind(x, 1 + sum(terms))


def newton_step(objective: Smooth, x: Array) -> tuple[Outcome[Array], QuadraticModel, Trial]:
    """The outcome after a Newton step from x, with its model and its trial."""
    model = objective.model(x, None, None)
    factor = model.factor(0.0)
    step, slope, length = model.descend(factor)
    trial = Trial(step, -slope / 2, 0.0, length**0.5, factor=factor)
    return Outcome(x + step, objective.value(x + step), Stop.ITERATION_LIMIT, 1), model, trial


def test_gradients_alone_reach_rounding_errors() -> None:
    objective = valley()
    outcome, model, trial = newton_step(objective, NEARBY)
    assert np.abs(outcome.x - MINIMUM).max() > 1e-9
    assert polish(objective, outcome, model, trial)
    np.testing.assert_allclose(outcome.x, MINIMUM, rtol=0, atol=1e-13)
    assert outcome.value == objective.value(outcome.x)
    assert objective.models == 1
    assert objective.gradients <= 3


@pytest.mark.parametrize("factor", [-1.0, 1e4, np.nan])
def test_nothing_changes_where_gradients_do_not_decrease(factor: float) -> None:
    objective = valley()
    outcome, model, trial = newton_step(objective, NEARBY)
    x, value = outcome.x, outcome.value
    objective.factor = factor
    assert not polish(objective, outcome, model, trial)
    assert outcome.x is x
    assert outcome.value == value


def test_an_objective_without_gradients_is_left_alone() -> None:
    objective = valley(Smooth)
    outcome, model, trial = newton_step(objective, MINIMUM + 1e-4)
    assert not polish(objective, outcome, model, trial)


def test_a_minimum_takes_fewer_models_with_gradients() -> None:
    options = Options(decrease=1e-6, exact=True)
    with_gradients = valley()
    polished = minimize(with_gradients, NEARBY, options)
    plain = minimize(valley(Smooth), NEARBY, options)
    for outcome in (polished, plain):
        assert outcome.stop is Stop.STATIONARY
        assert outcome.convex
        np.testing.assert_allclose(outcome.x, MINIMUM, rtol=0, atol=1e-12)
    assert polished.iterations == plain.iterations - 1
    assert with_gradients.gradients <= 2
