"""Newton's method on a batch: convergence and reported failures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.optimize.batched_newton import newton, roots

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


def steep(u: Array) -> tuple[Array, Array]:
    """arctan u = 0: full Newton steps from beyond 1.39 grow without end."""
    return np.arctan(u), (1 / (1 + u**2))[:, :, None]


def test_long_steps_are_shortened_until_the_residual_falls() -> None:
    u, found = newton(steep, np.array([[0.5], [3.0], [-40.0]]))
    assert found.all()
    np.testing.assert_allclose(u, 0.0, rtol=0, atol=1e-15)


def test_the_units_of_the_equations_do_not_matter() -> None:
    start, units = np.array([[30.0, 1.0], [-2.0, -0.5]]), np.array([2.0**40, 2.0**-30])

    def scaled(u: Array) -> tuple[Array, Array]:
        F, J = circle(u)
        return units * F, units[:, None] * J

    np.testing.assert_array_equal(newton(circle, start)[0], newton(scaled, start)[0])


def test_a_lost_system_does_not_take_others_with_it() -> None:
    """A singular matrix, no root, and an ordinary system in one batch."""
    shift = np.array([[1.0], [1.0], [-2.0]])
    slope = np.array([[0.0], [2.0], [2.0]])

    def system(u: Array) -> tuple[Array, Array]:
        return u**2 * (slope > 0) + shift, (slope * u)[:, :, None]

    u, found, residual = roots(system, np.array([[1.0], [0.7], [1.0]]))
    np.testing.assert_array_equal(found, [False, False, True])
    assert u[2, 0] == np.sqrt(2.0)
    assert np.isinf(residual[0])
    assert residual[1] > 0.1
    assert residual[2] < 1e-9


def test_the_slowest_component_decides() -> None:
    """The first component is linear and exact after one step, the second needs several."""

    def system(u: Array) -> tuple[Array, Array]:
        F = np.stack([u[:, 0] - 1.0, np.exp(u[:, 1]) - 2.0], axis=1)
        J = np.zeros((len(u), 2, 2))
        J[:, 0, 0], J[:, 1, 1] = 1.0, np.exp(u[:, 1])
        return F, J

    for swap in (False, True):
        order = [1, 0] if swap else [0, 1]

        def turned(u: Array, order: list[int] = order) -> tuple[Array, Array]:
            F, J = system(u[:, order])
            return F[:, order], J[:, order][:, :, order]

        root, found = newton(turned, np.zeros((1, 2)))
        assert found.all()
        np.testing.assert_allclose(root[:, order], [[1.0, np.log(2.0)]], rtol=0, atol=1e-14)
