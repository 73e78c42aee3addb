"""Contracted derivatives equal the explicit sums over the points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi._native import intervals as native
from hovi.discrete.contraction import contract

Array = npt.NDArray[np.float64]

Shape = tuple[int, int, int, int, int]
SHAPES: list[Shape] = [
    *[(1, 1, 3, 4, 1), (3, 4, 3, 6, 6), (2, 2, 3, 4, 7), (5, 3, 3, 5, 2), (2, 5, 3, 8, 13)],
    *[(1, 4, 3, 6, 31), (2, 3, 2, 4, 6), (3, 5, 4, 8, 7), (2, 6, 5, 10, 3), (1, 2, 4, 6, 31)],
]
"""Intervals B, points Q, rows R, columns m, components n."""


def random_batch(
    B: int, Q: int, R: int, m: int, n: int
) -> tuple[Array, Array, Array, Array, Array]:
    """A table, weights, unequal steps, and gradients and symmetric Hessians at the points."""
    random = np.random.default_rng(B + 10 * Q + 100 * m + 1000 * n)
    H = random.normal(size=(B * Q, R * n, R * n))
    table, weights = random.normal(size=(Q, R, m)), random.uniform(size=Q)
    steps = random.uniform(0.1, 2.0, B)
    return table, weights, steps, random.normal(size=(B * Q, R * n)), H + H.transpose(0, 2, 1)


def written_out(
    table: Array, weights: Array, steps: Array, gradient: Array, hessian: Array
) -> tuple[Array, Array]:
    """The sums of h w A^T g and h w A^T H A."""
    B, Q, R = len(steps), len(weights), table.shape[1]
    n = gradient.shape[1] // R
    A = table / steps[:, None, None, None] ** np.arange(R)[:, None]
    g, H = gradient.reshape(B, Q, R, n), hessian.reshape(B, Q, R, n, R, n)
    hw = steps[:, None] * weights
    return (
        np.einsum("bq,bqri,bqrx->bix", hw, A, g),
        np.einsum("bq,bqri,bqsj,bqrxsy->bijxy", hw, A, A, H, optimize=True),
    )


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_contracted_derivatives_equal_the_sums_over_points(shape: Shape) -> None:
    batch = random_batch(*shape)
    for found, expected in zip(contract(*batch), written_out(*batch), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_hessians_are_bitwise_symmetric(shape: Shape) -> None:
    _, hessian = contract(*random_batch(*shape))
    m = hessian.shape[1]
    for i in range(m):
        for j in range(i):
            np.testing.assert_array_equal(hessian[:, j, i], hessian[:, i, j].transpose(0, 2, 1))


def test_an_interval_has_the_same_bytes_in_every_batch() -> None:
    table, weights, steps, gradient, hessian = random_batch(3, 4, 3, 6, 6)
    together = contract(table, weights, steps, gradient, hessian)
    for k in range(3):
        points = slice(4 * k, 4 * k + 4)
        alone = contract(table, weights, steps[k : k + 1], gradient[points], hessian[points])
        for one, other in zip(together, alone, strict=True):
            np.testing.assert_array_equal(one[k], other[0])


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_all_kernels_agree(shape: Shape) -> None:
    batch = random_batch(*shape)
    fast = contract(*batch)
    slow = tuple(np.empty_like(array) for array in fast)
    native.contract(*batch, *slow, portable=True)
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14 * np.abs(other).max())


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_intervals_with_tables_of_their_own_are_contracted_one_by_one(shape: Shape) -> None:
    """Steps are equal, so that a table that is kept from the interval before would be noticed."""
    B, Q, R, m, _ = shape
    _, _, _, gradient, hessian = random_batch(*shape)
    random = np.random.default_rng(sum(shape))
    table, weights = random.normal(size=(B * Q, R, m)), random.uniform(size=B * Q)
    steps = np.full(B, 0.7)
    together = contract(table, weights, steps, gradient, hessian)
    for k in range(B):
        at = slice(k * Q, k * Q + Q)
        alone = table[at], weights[at], steps[k : k + 1], gradient[at], hessian[at]
        for found, expected in zip(together, written_out(*alone), strict=True):
            atol = 1e-13 * np.abs(expected).max()
            np.testing.assert_allclose(found[k], expected[0], rtol=0, atol=atol)
