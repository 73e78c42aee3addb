"""Legendre transforms and flows, continuous and discrete: the paper's theorems on the arm."""

from __future__ import annotations

from functools import cache
from typing import get_args

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from hovi.errors import InputError
from hovi.flows.euler_lagrange import (
    Form,
    discrete_hamiltonian_flow,
    discrete_lagrangian_map,
    euler_lagrange_residual,
)
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian
from hovi.flows.interval import FlatLagrangian
from hovi.flows.legendre_transforms import (
    hamiltonian,
    inverse_legendre_minus,
    inverse_legendre_plus,
    legendre,
    legendre_minus,
    legendre_plus,
)
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, spline
from hovi.schemes import by_name
from samples import paper_arm

Array = npt.NDArray[np.float64]

H = 0.3
JET = np.array([[0.4, -0.3], [0.6, -0.8], [1.2, 0.5], [-2.0, 1.5]])  # q, v, a, jerk


@pytest.fixture(scope="module")
def arm(arm_scene: Scene) -> EffortLagrangian:
    return arm_scene.effort_lagrangian()


@pytest.fixture(
    scope="module", params=["exact", "taylor-midpoint", "hermite-simpson", "galerkin-2"]
)
def ld(request: pytest.FixtureRequest, arm: EffortLagrangian) -> FlatLagrangian:
    if request.param == "exact":
        return ExactDiscreteLagrangian(arm, 0.1)
    return SchemeLagrangian(arm, by_name(request.param), 0.1)


def relative(value: Array, expected: Array) -> float:
    return float(np.abs(value - expected).max() / np.abs(expected).max())


@cache
def solution(h: float) -> tuple[Array, Array]:
    """(q, v, a, jerk) at 0 and h of the fourth-order Euler-Lagrange equations, by SciPy.

    d2/dt2 dL/da - d/dt dL/dv + dL/dq = 0 is differentiated by CasADi from the arm's energies.
    """
    s = paper_arm.symbols()
    j, snap = ca.SX.sym("j", 2), ca.SX.sym("snap", 2)
    jet = [s.q, s.v, s.a, j, snap]

    def dt(x: ca.SX) -> ca.SX:
        return ca.jtimes(x, ca.vertcat(*jet[:-1]), ca.vertcat(*jet[1:]))

    slopes = [ca.gradient(s.effort, x) for x in (s.q, s.v, s.a)]
    equation = dt(dt(slopes[2])) - dt(slopes[1]) + slopes[0]
    value = ca.substitute(equation, snap, 0 * snap)
    rate = ca.solve(ca.jacobian(equation, snap), -value)
    x = ca.vertcat(*jet[:-1])
    rates = ca.Function("psi", [x], [ca.vertcat(s.v, s.a, j, rate)])
    done = solve_ivp(
        lambda _, y: rates(y).full().ravel(),
        (0, h),
        JET.ravel(),
        "DOP853",
        rtol=2.3e-14,
        atol=1e-14,
    )
    return JET, done.y[:, -1].reshape(4, 2)


@cache
def pontryagin(h: float) -> tuple[Array, Array]:
    """(x, p) at h by Hamilton's equations of the arm, integrated by SciPy from FL of JET."""
    rates, _ = paper_arm._pontryagin()
    p0 = fl(JET)
    y0 = np.concatenate([JET[:2].ravel(), p0.ravel()])
    done = solve_ivp(
        lambda _, y: rates(y).full().ravel()[:8], (0, h), y0, "DOP853", rtol=2.3e-14, atol=1e-14
    )
    x, p = done.y[:, -1].reshape(2, 2, 2)
    return x, p


def fl(jet: Array) -> Array:
    """(dL/dv - d/dt dL/da, dL/da) of the hand-derived arm, shape (2, 2)."""
    s = paper_arm.symbols()
    j = ca.SX.sym("j", 2)
    top = ca.gradient(s.effort, s.a)
    along = ca.jtimes(top, ca.vertcat(s.q, s.v, s.a), ca.vertcat(s.v, s.a, j))
    p = ca.Function("fl", [s.q, s.v, s.a, j], [ca.gradient(s.effort, s.v) - along, top])
    return np.array([np.array(x).ravel() for x in p(*jet)])


def test_the_legendre_transform_of_the_arm_matches_the_derivation_by_hand(
    arm: EffortLagrangian,
) -> None:
    x, p = legendre(arm, *JET)
    np.testing.assert_array_equal(x, JET[:2])
    assert relative(p, fl(JET)) < 1e-13


def test_theorem_1_the_legendre_transforms_agree(arm: EffortLagrangian) -> None:
    start, end = solution(H)
    exact = ExactDiscreteLagrangian(arm, H)
    _, p0 = legendre_minus(exact, start[:2], end[:2])
    _, p1 = legendre_plus(exact, start[:2], end[:2])
    assert relative(p0, fl(start)) < 1e-10
    assert relative(p1, fl(end)) < 1e-10
    assert relative(legendre(arm, *end)[1], p1) < 1e-10


def test_fl_maps_the_euler_lagrange_flow_to_hamiltons() -> None:
    _, end = solution(H)
    x, p = pontryagin(H)
    assert relative(end[:2], x) < 1e-11
    assert relative(fl(end), p) < 1e-11


@pytest.mark.parametrize("form", get_args(Form))
def test_theorem_3_the_exact_discrete_hamiltonian_flow_is_hamiltons(
    arm: EffortLagrangian, form: Form
) -> None:
    exact = ExactDiscreteLagrangian(arm, H)
    x1, p1 = discrete_hamiltonian_flow(exact, JET[:2], fl(JET), form)
    x, p = pontryagin(H)
    assert relative(x1, x) < 1e-10
    assert relative(p1, p) < 1e-10


def motion(ld: FlatLagrangian) -> tuple[Array, Array, Array]:
    """Three nodes of a discrete motion, shape (2, 2) each."""
    x0 = JET[:2]
    p0 = fl(JET)
    _, x1 = inverse_legendre_minus(ld, x0, p0)
    _, x2 = discrete_lagrangian_map(ld, x0, x1)
    return x0, x1, x2


def test_theorem_2_its_diagram_commutes(ld: FlatLagrangian) -> None:
    x0, x1, x2 = motion(ld)
    x0, p0 = legendre_minus(ld, x0, x1)
    _, p1 = legendre_plus(ld, x0, x1)
    _, p2 = legendre_plus(ld, x1, x2)
    # F+ = F- o F_{L_d}, the central triangle
    assert relative(legendre_minus(ld, x1, x2)[1], p1) < 1e-11
    # the outer triangles: the flow of momenta carries p0 to p1 to p2
    for (x, p), (y, r) in (((x0, p0), (x1, p1)), ((x1, p1), (x2, p2))):
        end, momenta = discrete_hamiltonian_flow(ld, x, p)
        assert relative(end, y) < 1e-11
        assert relative(momenta, r) < 1e-11


def test_its_corollary_the_three_forms_of_the_flow_are_equal(ld: FlatLagrangian) -> None:
    x0, p0 = JET[:2], fl(JET)
    flows = [discrete_hamiltonian_flow(ld, x0, p0, form) for form in get_args(Form)]
    for x1, p1 in flows[1:]:
        assert relative(x1, flows[0][0]) < 1e-11
        assert relative(p1, flows[0][1]) < 1e-11


def test_legendre_transforms_and_their_inverses(ld: FlatLagrangian) -> None:
    x0, x1, _ = motion(ld)
    assert relative(inverse_legendre_minus(ld, *legendre_minus(ld, x0, x1))[1], x1) < 1e-12
    assert relative(inverse_legendre_plus(ld, *legendre_plus(ld, x0, x1))[0], x0) < 1e-12


def test_a_motion_solves_the_discrete_euler_lagrange_equations(ld: FlatLagrangian) -> None:
    x0, x1, x2 = motion(ld)
    scale = np.abs(legendre_plus(ld, x0, x1)[1]).max()
    assert np.abs(euler_lagrange_residual(ld, x0, x1, x2)).max() < 1e-11 * scale
    assert np.abs(euler_lagrange_residual(ld, x0, x1, x2 + 0.01)).max() > 1e-3 * scale


def test_batches_equal_single_points(ld: FlatLagrangian) -> None:
    rng = np.random.default_rng(0)
    x0 = JET[:2] + 0.1 * rng.normal(size=(3, 2, 2))
    p0 = fl(JET) + 0.1 * rng.normal(size=(3, 2, 2))
    x1, p1 = discrete_hamiltonian_flow(ld, x0, p0)
    for i in range(3):
        x, p = discrete_hamiltonian_flow(ld, x0[i], p0[i])
        assert relative(x, x1[i]) < 1e-13
        assert relative(p, p1[i]) < 1e-11


# FL and H of other orders


def test_fl_of_mechanics_is_the_mass_matrix(arm_scene: Scene) -> None:
    L = mechanics(arm_scene)
    x, p = legendre(L, JET[0], JET[1])
    zero = np.zeros((1, 2))
    tau = [arm_scene.inverse_dynamics(JET[:1], zero, e[None])[0] for e in np.eye(2)]
    gravity = arm_scene.inverse_dynamics(JET[:1], zero, zero)[0]
    M = np.array(tau).T - gravity[:, None]
    np.testing.assert_allclose(p[0], M @ JET[1], rtol=1e-13)
    energy = hamiltonian(L, x[None], p[None])
    value = L.value(*JET[:2, None])
    assert energy[0] == pytest.approx(JET[1] @ M @ JET[1] - value[0], rel=1e-13)


def test_fl_of_order_three_satisfies_its_recursion() -> None:
    n = 2
    jet = [ca.SX.sym(f"q{j}", n) for j in range(4)]
    q, v, a, j = jet
    L = CasadiLagrangian(jet, ca.sumsqr(j) / 2 * (1 + ca.sumsqr(q)) + ca.dot(a, v) * q[0])
    rng = np.random.default_rng(1)
    derivatives = rng.normal(size=(6, n))

    def momenta(t: float) -> Array:
        """p along the curve whose Taylor coefficients the derivatives are."""
        powers = [
            sum(derivatives[m + i] * t**i / float(np.prod(range(1, i + 1))) for i in range(6 - m))
            for m in range(6)
        ]
        return legendre(L, *powers)[1]

    p, e = momenta(0.0), 1e-3
    rates = (momenta(-2 * e) - 8 * momenta(-e) + 8 * momenta(e) - momenta(2 * e)) / (12 * e)
    gradient = L.gradient(*derivatives[:4, None])[0]
    np.testing.assert_allclose(p[2], gradient[3], rtol=1e-13)
    np.testing.assert_allclose(p[1], gradient[2] - rates[2], rtol=1e-8)
    np.testing.assert_allclose(p[0], gradient[1] - rates[1], rtol=1e-8)
    _, p = legendre(spline(n, 3), *derivatives)
    np.testing.assert_allclose(p, [derivatives[5], -derivatives[4], derivatives[3]], rtol=1e-15)


def test_d_h_of_the_exact_discrete_lagrangian_is_minus_the_energy(arm: EffortLagrangian) -> None:
    x0, p0 = JET[None, :2], fl(JET)[None]
    interval = ExactDiscreteLagrangian(arm, H).from_start(x0, p0)
    energy = hamiltonian(arm, x0, p0)
    np.testing.assert_allclose(interval.step_derivative, -energy, rtol=1e-9)


def test_d_h_is_the_derivative_in_h(arm: EffortLagrangian) -> None:
    for name in ("taylor-midpoint", "galerkin-2"):
        ld, e = SchemeLagrangian(arm, by_name(name), 0.1), 1e-5
        x0, x1, _ = (x[None] for x in motion(ld))
        values = [SchemeLagrangian(arm, ld.scheme, 0.1 + s * e).value(x0, x1) for s in (-1, 1)]
        slope = (values[1] - values[0]) / (2 * e)
        np.testing.assert_allclose(ld.joining(x0, x1).step_derivative, slope, rtol=1e-6)


def test_a_wrong_number_of_derivatives_is_refused(arm: EffortLagrangian) -> None:
    with pytest.raises(InputError, match=r"order 2 needs 4 arrays .* got 3"):
        legendre(arm, *JET[:3])
    with pytest.raises(InputError, match="shape"):
        legendre_minus(SchemeLagrangian(arm, by_name("galerkin-0"), 0.1), JET[0], JET[1])
