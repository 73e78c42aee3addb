"""Quasi-Newton steps never increase the value and correct a factorisation of a nearby Hessian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from hovi.optimize.quasi_newton import Smooth, descend

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Dense:
    """The factorisation of a dense matrix."""

    matrix: Array

    def solve(self, rhs: Array) -> Array:
        return np.linalg.solve(self.matrix, rhs)


class Bowl(Smooth[Array]):
    """1 + 1/2 x.H x + |x|^4 / 4, undefined outside a ball; counts its gradients."""

    def __init__(self, H: Array, quartic: float = 1.0, radius: float = np.inf) -> None:
        self.H, self.quartic, self.radius = H, quartic, radius
        self.gradients = 0

    def value(self, x: Array) -> float:
        if np.linalg.norm(x) > self.radius:
            return np.nan
        return float(1.0 + 0.5 * x @ self.H @ x + self.quartic * (x @ x) ** 2 / 4)

    def gradient(self, x: Array) -> Array:
        self.gradients += 1
        return self.H @ x + self.quartic * (x @ x) * x

    def retract(self, x: Array, step: Array) -> Array:
        return x + step


def bowl(size: int, seed: int, quartic: float = 1.0, radius: float = np.inf) -> Bowl:
    A = np.random.default_rng(seed).normal(size=(size, size))
    return Bowl(A @ A.T + np.eye(size), quartic, radius)


def test_a_quadratic_with_its_own_factorisation_takes_one_step() -> None:
    objective = bowl(6, 0, quartic=0.0)
    x = descend(objective, np.arange(6.0), Dense(objective.H), 1, 0.0)
    np.testing.assert_allclose(x, 0.0, rtol=0, atol=1e-12)


def test_a_rank_one_error_of_the_hessian_is_corrected_in_a_few_steps() -> None:
    objective = bowl(8, 1, quartic=0.0)
    u = np.random.default_rng(2).normal(size=8)
    for extra in (5.0, 50.0):
        stiffer = Bowl(objective.H + extra * np.outer(u, u), 0.0)
        x = descend(stiffer, np.ones(8), Dense(objective.H), 6, 1e-14)
        plain = np.ones(8)
        for _ in range(6):
            plain = plain - np.linalg.solve(objective.H, stiffer.gradient(plain))
        assert stiffer.value(x) - 1.0 < 1e-6
        assert stiffer.value(plain) > 1e3  # the same factorisation without updates


@pytest.mark.parametrize("seed", range(5))
def test_no_step_increases_the_value_even_at_the_edge_of_the_domain(seed: int) -> None:
    objective = bowl(5, seed, quartic=3.0, radius=2.5)
    x = np.random.default_rng(seed).normal(size=5)
    x *= 2.4 / np.linalg.norm(x)
    soft = Dense(2.0 * np.eye(5))  # its steps are too long
    values = [objective.value(descend(objective, x, soft, most, 0.0)) for most in range(8)]
    assert (np.diff(values) <= 0).all()
    assert values[-1] < values[0]


def test_steps_with_a_negligible_predicted_decrease_are_not_taken() -> None:
    objective = bowl(4, 3)
    x = 1e-3 * np.ones(4)
    assert descend(objective, x, Dense(objective.H), 5, 1.0) is x
    assert objective.gradients == 1
