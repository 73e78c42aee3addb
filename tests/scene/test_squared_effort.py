"""Squares of residuals, their gradients and linear predictions equal the explicit sums."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi.scene.squared_effort import expand_squares, predict, weighted_square

Array = npt.NDArray[np.float64]

SHAPES = [(1, 1, 1), (3, 2, 6), (64, 7, 21), (65, 6, 18), (1000, 3, 9)]
"""Points P, residuals n, variables k."""


def random_residuals(P: int, n: int, k: int) -> tuple[Array, Array, Array]:
    """Residuals, a metric and Jacobians."""
    random = np.random.default_rng(P + 10 * n + 100 * k)
    shape = (P, n)
    return random.normal(size=shape), random.uniform(size=n), random.normal(size=(*shape, k))


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_a_weighted_square_is_the_sum_over_points(shape: tuple[int, int, int]) -> None:
    r, R, _ = random_residuals(*shape)
    weights = np.random.default_rng(0).uniform(size=len(r))
    expected = 0.5 * np.einsum("p,i,pi,pi", weights, R, r, r)
    assert weighted_square(r, R, weights) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("pulled", [False, True])
def test_gradients_of_squares_match_the_explicit_product(
    shape: tuple[int, int, int], pulled: bool
) -> None:
    r, R, J = random_residuals(*shape)
    force = np.random.default_rng(1).normal(size=r.shape) if pulled else np.zeros_like(r)
    values, gradient = expand_squares(r, R, J, force if pulled else None)
    np.testing.assert_allclose(values, 0.5 * np.einsum("i,pi,pi->p", R, r, r), rtol=1e-14)
    np.testing.assert_allclose(
        gradient, np.einsum("pi,pik->pk", R * r + force, J), rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_predictions_are_linear(shape: tuple[int, int, int]) -> None:
    r, R, J = random_residuals(*shape)
    change = np.random.default_rng(2).normal(size=(shape[0], shape[2]))
    expected = R * (r + np.einsum("pik,pk->pi", J, change))
    np.testing.assert_allclose(predict(r, R, J, change), expected, rtol=0, atol=1e-13)
