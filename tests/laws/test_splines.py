"""Splines against closed forms: basis, gamma, L_d, recursions, long flows."""

from __future__ import annotations

from fractions import Fraction
from math import factorial

import numpy as np
import numpy.typing as npt
import pytest

from hovi.errors import SchemeError
from hovi.flows.euler_lagrange import discrete_lagrangian_map, euler_lagrange_residual
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import flow
from hovi.scene.standard_lagrangians import spline
from hovi.schemes import by_name, end_basis, galerkin, gamma, inverse_gamma
from hovi.schemes.interval_curve import end_weights, jet_rows
from hovi.schemes.polynomials import interval_rows

Array = npt.NDArray[np.float64]


def assert_close(value: Array, expected: Array, tolerance: float = 1e-13) -> None:
    """Equality up to rounding of the largest entry."""
    scale = np.abs(expected).max()
    np.testing.assert_allclose(value / scale, expected / scale, rtol=0, atol=tolerance)


def ends(k: int, n: int = 3) -> tuple[Array, Array]:
    """Random points of T^(k-1)Q, five at a time."""
    return tuple(np.random.default_rng(k).normal(size=(2, 5, k, n)))


# The paper's basis and matrix gamma, for every k


def test_gamma_for_k_2_matches_the_paper() -> None:
    expected = np.array([[1 / (2 * np.sqrt(3)), 1 / 2], [0, 1]])
    np.testing.assert_allclose(gamma(2), expected, rtol=0, atol=1e-16)
    w = inverse_gamma(2) @ np.array([0.3, 0.8])  # w0 = 2 sqrt(3) (z0 - z1/2), w1 = z1
    np.testing.assert_allclose(w, [2 * np.sqrt(3) * (0.3 - 0.4), 0.8], rtol=1e-15)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_the_basis_is_orthonormal_and_gamma_expands_the_end_weights_in_it(k: int) -> None:
    x, weights = np.polynomial.legendre.leggauss(k + 2)
    s, weights = (x + 1) / 2, weights / 2
    b, a = end_basis(s, k), end_weights(s, k)
    np.testing.assert_allclose((b * weights) @ b.T, np.eye(k), rtol=0, atol=1e-14)
    np.testing.assert_allclose((a * weights) @ b.T, gamma(k), rtol=0, atol=1e-15)
    np.testing.assert_allclose(gamma(k) @ b, a, rtol=0, atol=1e-14)


def test_rows_of_any_order_match_those_of_order_two() -> None:
    s = np.linspace(0, 1, 9)
    for r in (0, 1, 5, 20, 40):
        np.testing.assert_allclose(jet_rows(s, 2, r), interval_rows(s, r), rtol=0, atol=3e-15)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
@pytest.mark.parametrize("r", [0, 1, 4])
def test_the_curve_meets_the_end_data_for_any_inner_modes(k: int, r: int) -> None:
    rng = np.random.default_rng(10 * k + r)
    x0, z, c = rng.normal(size=k), rng.normal(size=k), rng.normal(size=r)
    start, end = jet_rows(np.array([0.0, 1.0]), k, r) @ np.concatenate([x0[1:], z, c])
    taylor = [sum(x0[j + i] / factorial(i) for i in range(k - j)) + z[j] for j in range(k)]
    np.testing.assert_allclose(start[1:k], x0[1:], rtol=0, atol=1e-14)
    np.testing.assert_allclose(end[:k] + np.eye(k)[0] * x0[0], taylor, rtol=0, atol=2e-13)


@pytest.mark.parametrize("k", [1, 3, 4])
@pytest.mark.parametrize("r", [0, 2])
def test_a_row_is_the_derivative_of_the_one_above(k: int, r: int) -> None:
    degree = 2 * k + r
    s = (1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2
    rows = jet_rows(s, k, r)
    for column in range(rows.shape[2]):
        for j in range(k):
            curve = np.polynomial.Polynomial.fit(s, rows[:, j, column], degree)
            assert_close(curve.deriv()(s) + 1, rows[:, j + 1, column] + 1, 1e-10)


@pytest.mark.parametrize("k", [0, 5, 1.5])
def test_orders_out_of_range_are_refused(k: int) -> None:
    with pytest.raises(SchemeError, match="order 1 to 4"):
        galerkin(1, k)


def test_a_scheme_for_another_order_is_refused() -> None:
    with pytest.raises(SchemeError, match="of order 2, this one is of order 3"):
        SchemeLagrangian(spline(1, 3), galerkin(1), 0.1)


# L_d in closed form


def paper_value(h: float, x0: Array, x1: Array) -> Array:
    """6/h^3 (q0-q1)^2 + 6/h^2 (q0-q1)(v0+v1) + 2/h (v0^2 + v0 v1 + v1^2), k = 2."""
    (q0, v0), (q1, v1) = np.moveaxis(x0, 1, 0), np.moveaxis(x1, 1, 0)
    d = q0 - q1
    terms = 6 / h**3 * d**2 + 6 / h**2 * d * (v0 + v1) + 2 / h * (v0**2 + v0 * v1 + v1**2)
    return np.asarray(terms.sum(axis=1))


def jerk_matrix(h: float) -> Array:
    """Matrix of 2 L_d^e over (q0, v0, a0, q1, v1, a1) for k = 3: quintic polynomials."""
    A = np.array(
        [
            [720, 360, 60, -720, 360, -60],
            [360, 192, 36, -360, 168, -24],
            [60, 36, 9, -60, 24, -3],
            [-720, -360, -60, 720, -360, 60],
            [360, 168, 24, -360, 192, -36],
            [-60, -24, -3, 60, -36, 9],
        ]
    )
    scale = h ** np.array([0.0, 1, 2, 0, 1, 2])
    return scale[:, None] * A * scale / h**5


@pytest.mark.parametrize("h", [0.03, 0.5, 2.0])
@pytest.mark.parametrize("r", [0, 1, 3])
def test_the_exact_discrete_lagrangian_of_the_cubic_spline(h: float, r: int) -> None:
    x0, x1 = ends(2)
    ld = SchemeLagrangian(spline(3), galerkin(r), h)
    assert_close(ld.value(x0, x1), paper_value(h, x0, x1))
    exact = ExactDiscreteLagrangian(spline(3), h)
    assert_close(exact.value(x0, x1), paper_value(h, x0, x1))


@pytest.mark.parametrize("h", [0.3, 2.0])
@pytest.mark.parametrize("r", [0, 2])
def test_the_exact_discrete_lagrangian_of_minimum_jerk(h: float, r: int) -> None:
    x0, x1 = ends(3)
    ld = SchemeLagrangian(spline(3, 3), galerkin(r, 3), h)
    data = np.concatenate([x0, x1], axis=1)  # (B, 6, n)
    A = jerk_matrix(h)
    assert_close(ld.value(x0, x1), np.einsum("bin,ij,bjn->b", data, A, data) / 2)
    segment = ld.joining(x0, x1)
    assert_close(segment.derivatives, A @ data)
    assert_close(segment.second_derivatives[0, :, :, 0, 0], A)
    assert_close(segment.second_derivatives[0, :, :, 0, 1] + 1, np.ones((6, 6)))


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_the_action_is_half_of_h_w_squared(k: int) -> None:
    # Parseval: <Q^(k), Q^(k)> = |w|^2 in the orthonormal basis, for every order
    x0, w = ends(k)
    segment = SchemeLagrangian(spline(3, k), galerkin(1, k), 0.7).between(x0, w)
    assert_close(segment.values, 0.35 * np.sum(w**2, axis=(1, 2)))
    np.testing.assert_allclose(segment.inner, 0.0, atol=1e-14)


def test_the_matrix_of_the_quintic_matches_exact_arithmetic() -> None:
    # q''' of the quintic through unit end data at h = 1, integrated without rounding
    powers = [
        [factorial(m) // factorial(m - j) if m >= j else 0 for m in range(6)] for j in (0, 1, 2)
    ]
    V = [[Fraction(int(m == j) * factorial(j)) for m in range(6)] for j in range(3)]
    V += [[Fraction(x) for x in row] for row in powers]
    inverse = np.array(_inverse(V), dtype=object)
    third = [Fraction(m * (m - 1) * (m - 2)) for m in range(6)]
    gram = [
        [third[i] * third[j] / (i + j - 5) if min(i, j) > 2 else Fraction(0) for j in range(6)]
        for i in range(6)
    ]
    exact = inverse.T @ np.array(gram, dtype=object) @ inverse
    np.testing.assert_array_equal(exact.astype(float), jerk_matrix(1.0))


def _inverse(matrix: list[list[Fraction]]) -> list[list[Fraction]]:
    n = len(matrix)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(n))] for i, row in enumerate(matrix)]
    for i in range(n):
        pivot = next(j for j in range(i, n) if rows[j][i] != 0)
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(n):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i], strict=True)]
    return [row[n:] for row in rows]


# The paper's recursions


def taylor_recursion(h: float) -> Array:
    """(q0, v0, q1, v1) -> (q2, v2): q2 = q0 + 2 h v1, v2 = v0 + 4 (v1 - (q1 - q0)/h)."""
    return np.array([[1, 0, 0, 2 * h], [4 / h, 1, -4 / h, 4]])


def exact_recursion(h: float) -> Array:
    """q2 = 5 q0 - 4 q1 + 2 h (v0 + 2 v1), v2 = v0 + 2/h (q0 - 2 q1 + q2)."""
    q2 = np.array([5, 2 * h, -4, 4 * h])
    return np.array([q2, 2 / h * q2 + np.array([2 / h, 1, -4 / h, 0])])


RECURSIONS = [("taylor-trapezoid", taylor_recursion), ("galerkin-0", exact_recursion)]


@pytest.mark.parametrize(("name", "recursion"), RECURSIONS)
@pytest.mark.parametrize("h", [0.25, 1.0])
def test_the_discrete_lagrangian_map_has_the_printed_coefficients(name, recursion, h) -> None:
    ld = SchemeLagrangian(spline(1), by_name(name), h)
    unit = np.eye(4).reshape(4, 2, 2, 1)
    _, x2 = discrete_lagrangian_map(ld, unit[:, 0], unit[:, 1])
    scale = np.array([[1.0], [h]])
    assert_close(x2[:, :, 0].T * scale, recursion(h) * scale)


@pytest.mark.parametrize(("name", "recursion"), RECURSIONS)
def test_ten_steps_of_the_printed_recursion_are_the_flow(name, recursion) -> None:
    h = 0.5
    ld = SchemeLagrangian(spline(3), by_name(name), h)
    x0, x1 = (x[0] for x in ends(2))
    printed = [x0, x1]
    for _ in range(10):
        printed.append(np.einsum("jm,mn->jn", recursion(h), np.concatenate(printed[-2:])))
    carried = flow(ld, x0, ld.joining(x0[None], x1[None]).p0[0], 11).x
    assert_close(carried, np.array(printed))
    for a, b, c in zip(printed[:-2], printed[1:-1], printed[2:], strict=True):
        assert_close(euler_lagrange_residual(ld, a, b, c) + 1e3, np.full((2, 3), 1e3), 2e-13)
    phi = np.diff(carried[:, 0], axis=0) / h - (carried[1:, 1] + carried[:-1, 1]) / 2
    assert_close(phi, np.broadcast_to(phi[0], phi.shape), 1e-12)


# The long flow, in momentum form


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_flow_of_every_spline_is_its_polynomial(k: int) -> None:
    # p_{k-1} = q^(k) and p_j' = -p_{j-1}: Taylor's series is finite
    rng = np.random.default_rng(3)
    x0, p0 = rng.normal(size=(2, k, 2))
    jet = [*x0, *((-1.0) ** j * p0[k - 1 - j] for j in range(k))]
    motion = flow(SchemeLagrangian(spline(2, k), galerkin(1, k), 0.01), x0, p0, 200)
    t = motion.t[-1]
    expected = [sum(jet[j + i] * t**i / factorial(i) for i in range(2 * k - j)) for j in range(k)]
    assert_close(motion.x[-1], np.array(expected), 1e-12)
