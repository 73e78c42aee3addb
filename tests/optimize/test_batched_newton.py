"""Newton's method on a batch: convergence and reported failures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.batched_newton import newton

Array = npt.NDArray[np.float64]


def circle(u: Array) -> tuple[Array, Array]:
    """x^2 + y^2 = 2, x = y."""
    x, y = u.T
    F = np.stack([x**2 + y**2 - 2, x - y], axis=1)
    one = np.ones_like(x)
    return F, np.stack([np.stack([2 * x, 2 * y], 1), np.stack([one, -one], 1)], axis=1)


def test_every_system_of_a_batch_converges_to_its_root() -> None:
    u, found = newton(circle, np.array([[3.0, 1.0], [-2.0, -0.5], [1.0, 1.0]]))
    assert found.all()
    np.testing.assert_allclose(u, [[1, 1], [-1, -1], [1, 1]], rtol=0, atol=1e-15)


def test_a_zero_root_and_an_empty_system_converge() -> None:
    u, found = newton(lambda u: (u, np.ones((len(u), 1, 1))), np.array([[1e-3], [0.0]]))
    assert found.all()
    np.testing.assert_array_equal(u, 0.0)
    u, found = newton(lambda u: (u, np.ones((len(u), 0, 0))), np.zeros((2, 0)))
    assert found.all()


def test_a_system_without_a_root_is_reported() -> None:
    def no_root(u: Array) -> tuple[Array, Array]:
        return u**2 + 1, 2 * u[:, :, None]

    assert not newton(no_root, np.array([[0.7]]))[1].any()


def test_a_singular_matrix_is_reported() -> None:
    assert not newton(lambda u: (u + 1, np.zeros((1, 1, 1))), np.zeros((1, 1)))[1].any()
