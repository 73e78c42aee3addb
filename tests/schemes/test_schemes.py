"""The tables: exact integration, formulas of the paper, regularity."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from fractions import Fraction
from math import factorial
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from hovi.errors import InputError, SchemeError
from hovi.schemes import (
    CLASSIC,
    FAMILIES,
    Scheme,
    by_name,
    galerkin,
    is_regular,
    regularity_matrix,
    require_regular,
)
from hovi.schemes.interval_curve import (
    MAX_POSITION,
    end_basis,
    end_weights,
    gamma,
    inverse_gamma,
    jet_rows,
)
from hovi.schemes.polynomials import interval_rows
from samples.paper_arm import effort

Array = npt.NDArray[np.float64]
Effort = Callable[[Array, Array, Array], float]
Polynomial = list[Fraction]  # coefficients of 1, s, s^2, ...

ALL = [
    *CLASSIC,
    *(f"galerkin-{each}" for each in ("0", "0x3", "1", "2", "2x8", "5", "20")),
]
POINTS = np.linspace(0.0, 1.0, 33)  # exact in binary


# The rows of an interval's curve, against exact rational arithmetic


def integral(p: Polynomial) -> Polynomial:
    return [Fraction(0), *(c / (k + 1) for k, c in enumerate(p))]


def values(p: Polynomial) -> Array:
    exact = [sum(c * Fraction(s) ** k for k, c in enumerate(p)) for s in POINTS]
    return np.array([float(x) for x in exact])


def shifted_legendre(degree: int) -> Polynomial:
    """P_j(2 s - 1) by its recursion, without rounding."""
    previous, p = [Fraction(0)], [Fraction(1)]
    for j in range(degree):
        x_p = [2 * b - a for a, b in zip([*p, Fraction(0)], [Fraction(0), *p], strict=True)]
        older = previous + [Fraction(0)] * (len(x_p) - len(previous))
        previous, p = (
            p,
            [(Fraction(2 * j + 1) * a - j * b) / (j + 1) for a, b in zip(x_p, older, strict=True)],
        )
    return p


def exact_jet(acceleration: Polynomial) -> Array:
    """(q, h v, h^2 a) of a curve that starts at zero with velocity zero, (M, 3)."""
    velocity = integral(acceleration)
    return np.stack([values(p) for p in (integral(velocity), velocity, acceleration)], axis=1)


@pytest.mark.parametrize("j", [2, 3, 4, 7, 10, 20, 40])
def test_inner_modes_are_exact_double_integrals_of_legendre_polynomials(j: int) -> None:
    mode = galerkin(j - 1).rows(POINTS)[:, :, j + 1]
    exact = np.sqrt(2 * j + 1) * exact_jet(shifted_legendre(j))
    np.testing.assert_allclose(mode, exact, rtol=0, atol=2e-14)


def test_the_first_three_columns_are_the_cubic_of_the_end_data() -> None:
    one, slope = [Fraction(1)], [Fraction(6), Fraction(-12)]  # 6 (1 - 2 s)
    Z1 = exact_jet([Fraction(1) - slope[0] / 2, -slope[1] / 2])
    expected = [np.stack([values(integral(one)), values(one), 0 * POINTS], axis=1)]
    expected += [exact_jet(slope), Z1]
    for r in (0, 3):
        rows = galerkin(r).rows(POINTS)[:, :, :3]
        np.testing.assert_allclose(rows, np.stack(expected, axis=2), rtol=0, atol=1e-14)


@pytest.mark.parametrize("r", [1, 2, 9, 19, 40])
def test_inner_modes_do_not_change_the_ends(r: int) -> None:
    ends = galerkin(r).rows(np.array([0.0, 1.0]))[:, :2, 3:]
    np.testing.assert_allclose(ends, 0.0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", ALL)
def test_the_curve_meets_the_end_data(name: str) -> None:
    scheme = by_name(name)
    hv0, Z0, Z1, *c = np.random.default_rng(1).normal(size=3 + scheme.inner_modes)
    start, end = (scheme.rows(np.array([0.0, 1.0])) @ np.array([hv0, Z0, Z1, *c]))[:, :2]
    np.testing.assert_allclose(start, [0.0, hv0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(end, [Z0 + hv0, Z1 + hv0], rtol=0, atol=1e-13)


@pytest.mark.parametrize("r", [0, 1, 2, 3, 8, 20])
def test_gauss_points_integrate_the_square_of_the_acceleration_exactly(r: int) -> None:
    scheme = galerkin(r)
    modes = scheme.table[:, 2, 3:]
    np.testing.assert_allclose((modes.T * scheme.weights) @ modes, np.eye(r), rtol=0, atol=1e-13)
    degrees = np.arange(2 * r + 4)
    quadrature = scheme.weights @ scheme.points[:, None] ** degrees
    np.testing.assert_allclose(quadrature, 1 / (degrees + 1), rtol=1e-13)


@pytest.mark.parametrize("r", [0, 1, 2, 5])
def test_a_galerkin_table_holds_the_rows_at_its_points(r: int) -> None:
    scheme = galerkin(r)
    np.testing.assert_array_equal(scheme.table, scheme.rows(scheme.points))
    assert (len(scheme.points), scheme.inner_modes, scheme.order) == (r + 2, r, 2 * (r + 2))


@pytest.mark.parametrize(("r", "k", "Q"), [(0, 2, 3), (2, 2, 8), (1, 1, 2), (1, 1, 6), (2, 3, 7)])
def test_points_are_chosen_independently_of_modes(r: int, k: int, Q: int) -> None:
    scheme = galerkin(r, k, points=Q)
    assert (len(scheme.points), scheme.inner_modes, scheme.order) == (Q, r, 2 * (r + k))
    np.testing.assert_array_equal(scheme.table, scheme.rows(scheme.points))
    degrees = np.arange(2 * Q)
    quadrature = scheme.weights @ scheme.points[:, None] ** degrees
    np.testing.assert_allclose(quadrature, 1 / (degrees + 1), rtol=1e-13)


@pytest.mark.parametrize(
    ("name", "r", "k", "Q"),
    [
        ("galerkin-2", 2, 2, 4),
        ("galerkin-2x8", 2, 2, 8),
        ("galerkin-1-k3", 1, 3, 4),
        ("galerkin-1x6-k1", 1, 1, 6),
    ],
)
def test_names_say_modes_points_and_order(name: str, r: int, k: int, Q: int) -> None:
    scheme = by_name(name)
    assert scheme.name == name
    assert scheme.key == galerkin(r, k, points=Q).key


@pytest.mark.parametrize(
    ("name", "count"),
    [("galerkin-0x3", 2), ("galerkin-2x6", 4), ("galerkin-4x10", 6), ("galerkin-2x7-k3", 5)],
)
def test_moments_have_one_orthonormal_test_function_per_coefficient(name: str, count: int) -> None:
    scheme = by_name(name)
    assert scheme.moments is not None
    products = (scheme.moments * scheme.weights) @ scheme.moments.T
    np.testing.assert_allclose(products, np.eye(count), rtol=0, atol=1e-13)
    powers = scheme.points ** np.arange(count)[:, None]
    rest = np.linalg.lstsq(scheme.moments.T, powers.T, rcond=None)[1]
    np.testing.assert_allclose(rest, 0.0, rtol=0, atol=1e-25)


def test_simpsons_rule_has_two_moments() -> None:
    moments = by_name("hermite-simpson").moments
    np.testing.assert_allclose(moments, [[1, 1, 1], [-np.sqrt(3), 0, np.sqrt(3)]], atol=1e-14)


@pytest.mark.parametrize("name", ["galerkin-0", "galerkin-2", "galerkin-1-k3", "mean-difference"])
def test_there_are_no_moments_where_there_are_no_more_points_than_coefficients(name: str) -> None:
    assert by_name(name).moments is None


def test_points_that_are_not_on_the_curve_have_no_moments() -> None:
    midpoint = by_name("taylor-midpoint")
    twice = (np.concatenate([x, x]) for x in (midpoint.points, midpoint.weights / 2))
    table = np.concatenate([midpoint.table, midpoint.table])
    assert Scheme("four midpoints", 2, *twice, table).moments is None


def test_r_plus_k_points_are_the_default() -> None:
    assert galerkin(2, points=4) is galerkin(2)


@pytest.mark.parametrize("Q", [3, 101, 4.0])
def test_too_few_or_too_many_points_are_refused(Q: int) -> None:
    with pytest.raises(SchemeError, match=f"4 to 100 quadrature points, got {Q}"):
        galerkin(2, points=Q)


# Lagrangians of other orders


def test_gamma_2_is_as_printed_in_the_paper() -> None:
    expected = [[1 / (2 * np.sqrt(3)), 0.5], [0.0, 1.0]]
    np.testing.assert_allclose(gamma(2), expected, rtol=1e-15)
    expected = [[2 * np.sqrt(3), -np.sqrt(3)], [0.0, 1.0]]  # w0 = 2 sqrt(3) (z0 - z1 / 2)
    np.testing.assert_allclose(inverse_gamma(2), expected, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("k", [1, 2, 3, 4, 7])
def test_gamma_maps_the_orthonormal_basis_to_the_end_weights(k: int) -> None:
    x, w = np.polynomial.legendre.leggauss(k + 1)
    s, w = (x + 1) / 2, w / 2
    a, b = end_weights(s, k), end_basis(s, k)
    np.testing.assert_allclose((b * w) @ b.T, np.eye(k), rtol=0, atol=1e-14)
    np.testing.assert_allclose(gamma(k), (a * w) @ b.T, rtol=0, atol=1e-14)
    np.testing.assert_allclose(gamma(k) @ b, a, rtol=0, atol=1e-13)


@pytest.mark.parametrize("r", [0, 1, 5])
def test_jets_of_order_two_equal_interval_rows(r: int) -> None:
    np.testing.assert_allclose(jet_rows(POINTS, 2, r), interval_rows(POINTS, r), rtol=0, atol=5e-15)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
@pytest.mark.parametrize("r", [0, 1, 4])
def test_jets_of_any_order_meet_the_end_data_and_are_exact_on_polynomials(k: int, r: int) -> None:
    scheme = galerkin(r, k)
    assert (scheme.derivatives, scheme.inner_modes, scheme.order) == (k, r, 2 * (r + k))
    random = np.random.default_rng(10 * k + r)
    p = np.polynomial.Polynomial(random.normal(size=2 * k))  # as many numbers as end data
    jets = np.stack([p.deriv(j)(POINTS) if j else p(POINTS) for j in range(k + 1)], axis=1)
    jets[:, 0] -= p(0)
    start, end = ([p.deriv(j)(s) if j else p(s) for j in range(k)] for s in (0.0, 1.0))
    # Z_j: what Taylor's polynomial of the start misses of the end, one derivative after another
    taylor = [sum(start[i] / factorial(i - j) for i in range(j, k)) for j in range(k)]
    Z = np.array(end) - taylor
    columns = np.concatenate([start[1:], Z, np.zeros(r)])
    scale = np.abs(jets).max()
    np.testing.assert_allclose(scheme.rows(POINTS) @ columns, jets, rtol=0, atol=1e-14 * scale)
    modes = scheme.rows(np.array([0.0, 1.0]))[:, :k, 2 * k - 1 :]
    np.testing.assert_allclose(modes, 0.0, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(scheme.table, scheme.rows(scheme.points))


@pytest.mark.parametrize("k", [1, 3, 4])
def test_galerkin_tables_of_any_order_are_regular(k: int) -> None:
    """W_d of the spline is the matrix of the exact one: -1 for k = 1."""
    require_regular(galerkin(2, k))
    W = regularity_matrix(galerkin(0, k))
    np.testing.assert_allclose(W, regularity_matrix(galerkin(5, k)), rtol=1e-9)
    assert k > 1 or W[0, 0] == pytest.approx(-1.0)


@pytest.mark.parametrize("k", [0, 5, -1, 2.0])
def test_orders_out_of_range_are_refused(k: int) -> None:
    with pytest.raises(SchemeError, match=f"Lagrangians of order 1 to 4, got {k}"):
        galerkin(1, derivatives=k)


# Laws of all tables


@pytest.mark.parametrize("name", ALL)
def test_weights_sum_to_one_and_points_are_inside_the_interval(name: str) -> None:
    scheme = by_name(name)
    assert scheme.name == name
    assert scheme.weights.sum() == pytest.approx(1.0, rel=1e-15)
    assert (scheme.weights > 0).all()
    assert ((scheme.points >= 0) & (scheme.points <= 1)).all()


@pytest.mark.parametrize("name", ALL)
def test_nodal_and_regular_tables_are_equivalent(name: str) -> None:
    scheme = by_name(name)
    q0, hv0, q1, hv1, *c = np.random.default_rng(2).normal(size=4 + scheme.inner_modes)
    Z = [q1 - q0 - hv0, hv1 - hv0]
    nodal = scheme.nodal_table @ np.array([q0, hv0, q1, hv1, *c])
    regular = scheme.regular_table @ np.array([q0, hv0, *Z, *c])
    own = scheme.table @ np.array([hv0, *Z, *c])
    own[:, 0] += q0
    np.testing.assert_allclose(nodal, regular, rtol=0, atol=1e-13)
    np.testing.assert_allclose(regular, own, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ["hermite-simpson", "galerkin-0", "galerkin-2", "galerkin-5"])
def test_tables_of_curves_are_exact_on_cubics(name: str) -> None:
    scheme = by_name(name)
    c0, c1, c2, c3 = np.random.default_rng(3).normal(size=4)
    s = scheme.points
    jet = [c0 + c1 * s + c2 * s**2 + c3 * s**3, c1 + 2 * c2 * s + 3 * c3 * s**2]
    jet += [2 * c2 + 6 * c3 * s]
    nodal = np.zeros(4 + scheme.inner_modes)
    nodal[:4] = c0, c1, c0 + c1 + c2 + c3, c1 + 2 * c2 + 3 * c3
    points = scheme.nodal_table @ nodal
    np.testing.assert_allclose(points, np.stack(jet, axis=1), rtol=0, atol=1e-13)


def test_a_pickled_scheme_is_the_same_table() -> None:
    scheme = galerkin(3)
    copy = pickle.loads(pickle.dumps(scheme))
    assert (copy.name, copy.order) == (scheme.name, scheme.order)
    for name in ("points", "weights", "table"):
        np.testing.assert_array_equal(getattr(copy, name), getattr(scheme, name))


# Each classic table is the formula that bears its name


def paper_midpoint(L: Effort, h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> float:
    q, v = (q0 + q1) / 2, (v0 + v1) / 2
    first = L(q, v, 2 / h**2 * (q1 - q0 - h * v0))
    return h / 2 * (first + L(q, v, 2 / h**2 * (q0 - q1 + h * v1)))


def paper_trapezoid(L: Effort, h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> float:
    a0, a1 = 2 / h**2 * (q1 - q0 - h * v0), 2 / h**2 * (q0 - q1 + h * v1)
    return h / 2 * (L(q0, v0, a0) + L(q1, v1, a1))


def paper_mean(L: Effort, h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> float:
    return h * L((q0 + q1) / 2, (q1 - q0) / h, (v1 - v0) / h)


def paper_difference(L: Effort, h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> float:
    a = (v1 - v0) / h
    return h / 2 * (L(q0, v0, a) + L(q1, v1, a))


def simpson(L: Effort, h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> float:
    d = q1 - q0
    a0 = 6 * d / h**2 - (4 * v0 + 2 * v1) / h
    a1 = -6 * d / h**2 + (2 * v0 + 4 * v1) / h
    middle = (q0 + q1) / 2 + h / 8 * (v0 - v1), 1.5 * d / h - (v0 + v1) / 4, (v1 - v0) / h
    return h / 6 * (L(q0, v0, a0) + 4 * L(*middle) + L(q1, v1, a1))


FORMULAS = {
    "taylor-midpoint": paper_midpoint,
    "taylor-trapezoid": paper_trapezoid,
    "mean-difference": paper_mean,
    "trapezoid-difference": paper_difference,
    "hermite-simpson": simpson,
}


@pytest.mark.parametrize("name", CLASSIC)
@pytest.mark.parametrize("h", [1e-3, 0.1, 2.0])
def test_a_classic_table_matches_its_formula_on_the_arm(name: str, h: float) -> None:
    scheme = by_name(name)
    for ends in np.random.default_rng(4).normal(size=(5, 4, 2)):
        q0, v0, q1, v1 = ends * np.array([1, 1, h, 1])[:, None]  # a motion of about unit speed
        q1 = q0 + q1
        nodal = np.stack([q0, h * v0, q1, h * v1])
        points = scheme.nodal_table @ nodal  # (Q, 3, 2)
        powers = h ** -np.arange(3.0)[:, None]
        action = h * sum(
            w * effort(*(x * powers)) for w, x in zip(scheme.weights, points, strict=True)
        )
        assert action == pytest.approx(FORMULAS[name](effort, h, q0, v0, q1, v1), rel=1e-12)


# The spline example: L = 1/2 a^2


def spline_gradient(scheme: Scheme, h: float, ends: Array) -> Array:
    """D1 .. D4 of L_d for L = 1/2 |a|^2 at (q0, v0, q1, v1) of shape (4, n), inner modes zero."""
    scale = np.array([1, h, 1, h])
    acceleration = scheme.nodal_table[:, 2, :4] * scale / h**2  # (Q, 4)
    return h * (acceleration.T * scheme.weights) @ (acceleration @ ends)


def printed_taylor(h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> tuple[Array, Array]:
    return q0 + 2 * h * v1, v0 + 4 * (v1 - (q1 - q0) / h)


def printed_exact(h: float, q0: Array, v0: Array, q1: Array, v1: Array) -> tuple[Array, Array]:
    q2 = 5 * q0 - 4 * q1 + 2 * h * (v0 + 2 * v1)
    return q2, v0 + 2 / h * (q0 - 2 * q1 + q2)


@pytest.mark.parametrize(
    ("name", "recursion"),
    [
        ("taylor-trapezoid", printed_taylor),
        ("galerkin-0", printed_exact),
        ("galerkin-3", printed_exact),
        ("hermite-simpson", printed_exact),
    ],
)
@pytest.mark.parametrize("h", [0.01, 1.0])
def test_the_printed_recursion_solves_the_discrete_euler_lagrange_equations(
    name: str, recursion: Callable[..., tuple[Array, Array]], h: float
) -> None:
    scheme = by_name(name)
    q0, v0, q1, v1 = np.random.default_rng(5).normal(size=(4, 3))
    q1 = q0 + h * q1
    q2, v2 = recursion(h, q0, v0, q1, v1)
    first = spline_gradient(scheme, h, np.stack([q0, v0, q1, v1]))
    second = spline_gradient(scheme, h, np.stack([q1, v1, q2, v2]))
    scale = np.abs(first[2:]).max(axis=1, keepdims=True)
    np.testing.assert_allclose((first[2:] + second[:2]) / scale, 0.0, rtol=0, atol=1e-12)
    phi = [(q1 - q0) / h - (v0 + v1) / 2, (q2 - q1) / h - (v1 + v2) / 2]
    np.testing.assert_allclose(phi[0], phi[1], rtol=1e-11)


# Regularity


@pytest.mark.parametrize(
    ("name", "determinant"),
    [
        ("taylor-midpoint", 4.0),
        ("taylor-trapezoid", 4.0),
        ("mean-difference", 0.0),
        ("trapezoid-difference", 0.0),
        ("hermite-simpson", 12.0),
        *((f"galerkin-{r}", 12.0) for r in (0, 1, 2, 3, 10, 40)),
    ],
)
def test_det_w_d_of_the_spline(name: str, determinant: float) -> None:
    scheme = by_name(name)
    assert np.linalg.det(regularity_matrix(scheme)) == pytest.approx(determinant, abs=1e-10)
    assert is_regular(scheme) == (determinant != 0)


@pytest.mark.parametrize(
    ("points", "weights", "determinant"),
    [([0.5], [1.0], 0.0), ([0.0, 1.0], [0.5, 0.5], 36.0)],
    ids=["one Gauss point", "trapezoid"],
)
def test_det_w_d_of_the_cubic_with_other_quadratures(
    points: list[float], weights: list[float], determinant: float
) -> None:
    table = interval_rows(np.array(points), 0)
    scheme = Scheme("cubic", 2, np.array(points), np.array(weights), table)
    assert np.linalg.det(regularity_matrix(scheme)) == pytest.approx(determinant, abs=1e-12)
    assert is_regular(scheme) == (determinant != 0)


@pytest.mark.parametrize("name", ["hermite-simpson", "galerkin-0", "galerkin-2"])
def test_w_d_equals_that_of_the_exact_spline(name: str) -> None:
    # L_d^e = 6 (q0 - q1)^2 + 6 (q0 - q1)(v0 + v1) + 2 (v0^2 + v0 v1 + v1^2) at h = 1
    exact = [[-12.0, 6.0], [-6.0, 2.0]]
    np.testing.assert_allclose(regularity_matrix(by_name(name)), exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["mean-difference", "trapezoid-difference"])
def test_degenerate_schemes_are_refused_with_the_reason(name: str) -> None:
    with pytest.raises(SchemeError, match="rank 1 instead of 2, so positions and velocities are"):
        require_regular(by_name(name))


@pytest.mark.parametrize("name", [name for name in ALL if "difference" not in name])
def test_the_other_schemes_are_accepted(name: str) -> None:
    require_regular(by_name(name))


# Names


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("taylor-midpont", "did you mean 'taylor-midpoint'"),
        ("Hermite-Simpson", "did you mean 'hermite-simpson'"),
        ("galerkin", "did you mean 'galerkin-"),
        ("galerkin--1", "did you mean 'galerkin-"),
        ("galerkin-2 ", "did you mean 'galerkin-2'"),
        ("rk4", "valid names are 'galerkin-0'"),
        ("", "valid names are"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest(name: str, hint: str) -> None:
    with pytest.raises(SchemeError, match="there is no scheme") as raised:
        by_name(name)
    assert hint in str(raised.value)


@pytest.mark.parametrize("r", [-1, 41, 9999, 2.5, "2"])
def test_inner_modes_out_of_range_are_refused(r: Any) -> None:
    with pytest.raises(SchemeError, match=f"0 to 40 inner modes, got {r!r}"):
        galerkin(r)


def test_numpy_integers_are_accepted() -> None:
    assert galerkin(np.int64(3)).name == "galerkin-3"  # type: ignore[arg-type]


def test_a_name_with_too_many_inner_modes_is_refused() -> None:
    with pytest.raises(SchemeError, match="0 to 40 inner modes"):
        by_name("galerkin-41")


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("r", [0, 1, 3])
def test_a_member_of_a_family_has_its_name(family: str, r: int) -> None:
    scheme = by_name(f"{family}-{r}")
    assert (scheme.name, scheme.inner_modes) == (f"{family}-{r}", r)
    np.testing.assert_array_equal(scheme.table, FAMILIES[family](r).table)


@pytest.mark.parametrize("s", [1e300, -1e308, -1e9, float("nan")])
def test_positions_far_from_the_interval_are_refused(s: float) -> None:
    """Powers of 20 and more would overflow; up to MAX_POSITION none does."""
    calls: list[Callable[[Array], Array]] = [by_name(name).rows for name in ALL]
    calls += [lambda s: end_basis(s, 20), galerkin(3, 4).rows]
    for call in calls:
        with pytest.raises(InputError, match=re.escape(f"up to 1000, got {s:g}: give the time")):
            call(np.array([0.5, s]))
        assert np.isfinite(call(np.array([0.0, -MAX_POSITION, MAX_POSITION]))).all()
