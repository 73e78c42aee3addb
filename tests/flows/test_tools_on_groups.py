"""The theorems' tools on groups: Legendre transforms, regularity, symplecticity, momentum maps."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import hovi
from hovi.errors import InputError
from hovi.flows.charted_interval import symplectic_form
from hovi.flows.charted_lagrangian import ChartedLagrangian
from hovi.flows.legendre_transforms import highest_derivative
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin
from oracles.finite_differences import derivative
from samples.manifold_robots import BASES, configurations, with_arm

Array = npt.NDArray[np.float64]

ROTATIONS = ConfigurationSpace(("SO(3)",))
PLANE = ConfigurationSpace(("SE(2)", "SO(2)"))
SPACES = {
    "a pose": ConfigurationSpace(("SE(3)",)),
    "a plane, a number and an angle": ConfigurationSpace(("SE(2)", 1, "SO(2)")),
    "rotations": ROTATIONS,
    "an angle": ConfigurationSpace(("SO(2)",)),
}
each_space = pytest.mark.parametrize("space", SPACES.values(), ids=list(SPACES))
each_order = pytest.mark.parametrize("k", [1, 2])


@cache
def lagrangian_on(space: ConfigurationSpace, k: int) -> CasadiLagrangian:
    """A Lagrangian with no symmetry, convex in its highest derivative."""
    jet = [ca.SX.sym("q", space.nq), *(ca.SX.sym(f"q{j}", space.nv) for j in range(1, k + 1))]
    weights, n = np.linspace(0.5, 1.5, space.nq), space.nv
    L = ca.sin(ca.dot(weights, jet[0])) + ca.dot(jet[0] ** 3, weights) + ca.sumsqr(jet[1])
    L += ca.sumsqr(jet[k]) * (1.5 + ca.cos(ca.sum1(jet[0]))) + ca.sum1(jet[1] ** 3) / 9
    L += ca.sum1(jet[k]) ** 2 / 4 + 0.2 * jet[1][0] * ca.sum1(jet[k]) * jet[0][n - 1]
    return CasadiLagrangian(jet, L, space)


def points(space: ConfigurationSpace, k: int, h: float, seed: int = 0) -> tuple[Array, Array]:
    """Two near points of T^(k-1)Q, (1, nq + (k - 1) nv) each."""
    random, n = np.random.default_rng(seed), space.nv
    q0 = space.integrate(space.normalized(np.ones(space.nq)), 0.5 * random.normal(size=n))
    v0 = 0.8 * random.normal(size=n)
    x, dx = h * v0 + 0.1 * random.normal(size=n) * h, v0 + 0.3 * random.normal(size=n)
    q1, v1, _ = Chart(space).jet(q0[None], x[None], dx[None], 0 * dx[None])
    if k == 1:
        return q0[None], q1
    return np.append(q0, v0)[None], np.append(q1, v1, axis=1)


def moved(space: ConfigurationSpace, x: Array, d: Array) -> Array:
    """A point (1, nq + ..) moved by d = (eta, dv)."""
    q = space.integrate(x[0, : space.nq], d[: space.nv])
    return np.append(q, x[0, space.nq :] + d[space.nv :])[None]


def difference(space: ConfigurationSpace, x: Array, y: Array) -> Array:
    """d with y = moved(x, d)."""
    dq = space.difference(x[0, : space.nq], y[0, : space.nq])
    return np.append(dq, y[0, space.nq :] - x[0, space.nq :])


def of(space: ConfigurationSpace, k: int, r: int = 2, h: float = 0.4) -> ChartedLagrangian:
    return ChartedLagrangian(lagrangian_on(space, k), space, galerkin(r, k), h)


# L_d and its derivatives


@each_space
@each_order
def test_the_momenta_are_the_derivatives_of_the_discrete_lagrangian(
    space: ConfigurationSpace, k: int
) -> None:
    ld, n = of(space, k), space.nv
    x0, x1 = points(space, k, ld.h)
    interval = ld.joining(x0[None], x1[None], 0.1)
    np.testing.assert_allclose(difference(space, x1, interval.x1[0]), 0.0, atol=1e-12)

    def value(d: Array) -> Array:
        ends = (moved(space, x0, d[: k * n]), moved(space, x1, d[k * n :]))
        return ld.joining(*(x[None] for x in ends), 0.1).values

    slopes = derivative(value, np.zeros(2 * k * n))[0]
    scale = np.abs(slopes).max()
    np.testing.assert_allclose(interval.derivatives.ravel(), slopes, rtol=0, atol=1e-7 * scale)


@each_space
@each_order
def test_the_second_derivatives_are_those_of_the_momenta(space: ConfigurationSpace, k: int) -> None:
    """Between both ends, where no choice of coordinates matters: the matrix W_d."""
    ld, n = of(space, k), space.nv
    x0, x1 = points(space, k, ld.h, 1)

    def starts(d: Array) -> Array:
        return -hovi.legendre_minus(ld, x0, moved(space, x1, d))[1].ravel()

    W = derivative(starts, np.zeros(k * n))
    found = hovi.regularity(ld, x0, x1)
    np.testing.assert_allclose(found.matrix[0], W, rtol=0, atol=1e-7 * np.abs(W).max())
    second = ld.joining(x0[None], x1[None]).second_derivatives
    np.testing.assert_allclose(second, second.transpose(0, 2, 1, 4, 3), rtol=0, atol=1e-9)


@each_order
def test_the_derivative_in_the_step_is_minus_the_energy(k: int) -> None:
    """Of the exact L_d; of any L_d it is the difference quotient."""
    space, h = PLANE, 0.3
    x0, x1 = points(space, k, h)
    by_step = of(space, k, h=h).joining(x0[None], x1[None]).step_derivative

    def value(change: Array) -> Array:
        return of(space, k, h=h + change[0]).value(x0[None], x1[None])

    slope = derivative(value, np.zeros(1))[0]
    np.testing.assert_allclose(by_step, slope, rtol=1e-7)
    L = lagrangian_on(space, k)
    exact = hovi.ExactDiscreteLagrangian(L, h).joining(x0[None], x1[None])
    jet = [x0[:, : space.nq], *([x0[:, space.nq :]] if k == 2 else [])]
    energy = hovi.hamiltonian(L, jet, exact.p0)
    np.testing.assert_allclose(exact.step_derivative, -energy, rtol=1e-9)  # type: ignore[attr-defined]


@each_order
def test_time_runs_from_the_start_of_the_interval(k: int) -> None:
    """Of L with sin(t) at t0 = 0.7, as of L with sin(t + 0.7) at 0."""
    base, t = lagrangian_on(ROTATIONS, k), ca.SX.sym("t")
    late, early = (
        ChartedLagrangian(
            CasadiLagrangian(
                base.jet, base.expression + ca.sin(t + by) * base.jet[0][1], ROTATIONS, time=t
            ),
            ROTATIONS,
            galerkin(1, k),
            0.4,
        )
        for by in (0.0, 0.7)
    )
    x0, x1 = (x[None] for x in points(ROTATIONS, k, 0.4))
    one, other = late.joining(x0, x1, 0.7), early.joining(x0, x1)
    np.testing.assert_allclose(one.values, other.values, rtol=1e-13)
    np.testing.assert_allclose(one.p0, other.p0, rtol=1e-11)
    for at, back in ((late, 0.7), (early, 0.0)):
        np.testing.assert_allclose(at.from_start(x0, one.p0, back).x1, x1, rtol=0, atol=1e-10)
        np.testing.assert_allclose(at.from_end(x1, one.p1, back).x0, x0, rtol=0, atol=1e-10)


@each_order
def test_a_batch_is_its_members(k: int) -> None:
    ld = of(ROTATIONS, k)
    pairs = [points(ROTATIONS, k, ld.h, seed) for seed in range(3)]
    x0, x1 = (np.stack(each) for each in zip(*pairs, strict=True))
    interval = ld.joining(x0, x1)
    assert interval.values.shape == (3,)
    for i, (a, b) in enumerate(pairs):
        one = ld.joining(a[None], b[None])
        np.testing.assert_array_equal(interval.p0[i], one.p0[0])
        np.testing.assert_array_equal(interval.hessian[i], one.hessian[0])
        np.testing.assert_array_equal(hovi.legendre_plus(ld, a, b)[1], interval.p1[i])
    there = ld.from_start(x0, interval.p0)
    np.testing.assert_allclose(there.x1, interval.x1, rtol=0, atol=1e-11)


# Legendre transforms and flows


@each_space
@each_order
def test_the_legendre_transforms_have_inverses(space: ConfigurationSpace, k: int) -> None:
    ld = of(space, k)
    x0, x1 = points(space, k, ld.h)
    _, end = hovi.inverse_legendre_minus(ld, *hovi.legendre_minus(ld, x0, x1))
    np.testing.assert_allclose(difference(space, x1, end), 0.0, rtol=0, atol=1e-10)
    start, _ = hovi.inverse_legendre_plus(ld, *hovi.legendre_plus(ld, x0, x1))
    np.testing.assert_allclose(difference(space, x0, start), 0.0, rtol=0, atol=1e-10)


@each_space
@each_order
def test_the_three_forms_of_the_flow_are_equal(space: ConfigurationSpace, k: int) -> None:
    ld = of(space, k, h=0.15)
    x0, x1 = points(space, k, ld.h)
    x, p = hovi.legendre_minus(ld, x0, x1)
    first, momenta = hovi.discrete_hamiltonian_flow(ld, x, p)
    for form in ("plus", "minus"):
        other, q = hovi.discrete_hamiltonian_flow(ld, x, p, form)
        np.testing.assert_allclose(difference(space, first, other), 0.0, rtol=0, atol=1e-9)
        np.testing.assert_allclose(q, momenta, rtol=0, atol=1e-8 * np.abs(momenta).max())
    middle, last = hovi.discrete_lagrangian_map(ld, x0, x1)
    residual = hovi.euler_lagrange_residual(ld, x0, middle, last)
    np.testing.assert_allclose(residual, 0.0, atol=1e-9 * np.abs(momenta).max())


@each_space
@each_order
def test_the_tangent_of_the_flow_is_its_derivative_and_symplectic(
    space: ConfigurationSpace, k: int
) -> None:
    ld, n = of(space, k, h=0.3), space.nv
    x0, x1 = points(space, k, ld.h)
    p0 = hovi.legendre_minus(ld, x0, x1)[1]
    interval = ld.from_start(x0[None], p0[None])
    end, p1 = interval.x1[0], interval.p1[0]

    def step(d: Array) -> Array:
        start = moved(space, x0, d[: k * n])
        there = ld.from_start(start[None], p0[None] + d[k * n :].reshape(1, k, n))
        return np.append(difference(space, end, there.x1[0]), (there.p1[0] - p1).ravel())

    D = interval.tangent[0]
    numbers = derivative(step, np.zeros(2 * k * n))
    np.testing.assert_allclose(D, numbers, rtol=0, atol=2e-7 * np.abs(D).max())
    form = D.T @ symplectic_form(space, p1) @ D
    bound = 1e-10 * np.abs(D).max() ** 2
    np.testing.assert_allclose(form, symplectic_form(space, p0), rtol=0, atol=bound)


# The exact discrete Lagrangian


@each_order
def test_the_exact_flow_is_that_of_the_differential_equations(k: int) -> None:
    """A free body, by Euler's equations; a cubic, by omega''' = omega'' x omega."""
    moments, h = np.array([1.0, 2.0, 3.5]), 2.0 if k == 1 else 1.0
    g, w, dw = (ca.SX.sym(*name) for name in (("g", 4), ("w", 3), ("dw", 3)))
    energy = ca.dot(moments * w, w) / 2
    L = CasadiLagrangian([g, w], energy, ROTATIONS)
    jet = [np.array([0.0, 0, 0, 1]), np.array([0.3, 0.9, -0.5])]
    if k == 2:
        L = CasadiLagrangian([g, w, dw], ca.sumsqr(dw) / 2, ROTATIONS)
        jet += [np.array([1.0, -0.4, 0.2]), np.array([-0.5, 0.8, 1.0])]

    def rates(t: float, y: Array) -> Array:
        u, s, w = y[:3], y[3], y[4:7]
        turned = 0.5 * np.append(s * w + np.cross(u, w), -u @ w)
        if k == 1:
            return np.append(turned, np.cross(moments * w, w) / moments)
        return np.concatenate([turned, y[7:], np.cross(y[10:], w)])

    y = solve_ivp(rates, (0, h), np.concatenate(jet), "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    x, p = hovi.legendre(L, *jet)
    exact = hovi.ExactDiscreteLagrangian(L, h)
    interval = exact.from_start(x[None], p[None])
    expected = y[:4] if k == 1 else y[:7]
    np.testing.assert_allclose(interval.x1[0, 0], expected, rtol=0, atol=1e-11)
    between = exact.joining(x[None], expected[None, None])
    np.testing.assert_allclose(between.p0[0], p, rtol=0, atol=1e-11)
    back = exact.from_end(interval.x1, interval.p1)
    np.testing.assert_allclose(back.x0, x[None], rtol=0, atol=1e-10)
    np.testing.assert_allclose(exact.value(x[None], interval.x1), interval.values, rtol=1e-10)


def test_the_exact_discrete_lagrangian_ends_at_the_conjugate_point() -> None:
    """A pendulum whose angle is a point of SO(2), with small swings: at half a period."""
    g, w = ca.SX.sym("g", 2), ca.SX.sym("w", 1)
    L = CasadiLagrangian([g, w], ca.sumsqr(w) / 2 + 9.81 * g[0], SPACES["an angle"])
    x, p = np.array([[1.0, 0.0]]), np.array([[1e-4]])
    half = np.pi / np.sqrt(9.81)
    assert hovi.conjugate_time(L, x, p, 1.5) == pytest.approx(half, rel=1e-8)
    exact = hovi.ExactDiscreteLagrangian(L, 0.95 * half).from_start(x[None], p[None])
    angle = 1e-4 * np.sin(0.95 * np.pi) / np.sqrt(9.81)
    np.testing.assert_allclose(exact.x1[0, 0, 1], angle, rtol=1e-7)
    with pytest.raises(InputError, match="conjugate point"):
        hovi.ExactDiscreteLagrangian(L, 1.05 * half).from_start(x[None], p[None])


@pytest.mark.parametrize(("k", "r"), [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1)])
def test_the_variational_order_is_2_r_plus_k(k: int, r: int) -> None:
    L, random = lagrangian_on(PLANE, k), np.random.default_rng(5)
    q = PLANE.integrate(PLANE.normalized(np.ones(PLANE.nq)), random.normal(size=(8, PLANE.nv)))
    jet = [q, *(0.5 * random.normal(size=(2 * k - 1, 8, PLANE.nv)))]
    found = hovi.variational_order(L, galerkin(r, k), [0.06, 0.045, 0.03], *jet)
    assert found.reliable, found
    assert found.order == pytest.approx(2 * (r + k), abs=0.3)


# Symmetries


def spatial(robot: Any, q: Array, p: Array) -> Array:
    """Momenta of the base in the world's frame, (N, 6): force, and moment about the origin."""
    return np.array(
        [
            (robot.model.jointPlacements[1] * pin.XYZQUATToSE3(x[:7])).act(pin.Force(y[:6])).vector
            for x, y in zip(q, p, strict=True)
        ]
    )


def test_a_cubic_on_rotations_conserves_its_spatial_momenta() -> None:
    """J_w = (R p) . w for every axis, since the lift of a left translation leaves w alone."""
    g, w, dw = (ca.SX.sym(*name) for name in (("g", 4), ("w", 3), ("dw", 3)))
    L = CasadiLagrangian([g, w, dw], ca.dot(np.array([1.0, 2, 3]) * dw, dw) / 2, ROTATIONS)
    jet = [np.array([0.1, 0.7, -0.1, 0.7]), [0.3, 0.9, -0.5], [1.0, -0.4, 0.2], [-0.5, 0.8, 1.0]]
    jet[0] = ROTATIONS.normalized(np.array(jet[0]))
    x, p = hovi.legendre(L, *jet)
    ld = ChartedLagrangian(L, ROTATIONS, galerkin(0), 0.2)
    turns = {f"about {axis}": rotation(axis) for axis in np.eye(3).tolist()}
    motion = hovi.flow(ld, x, p, 10, symmetries={str(k): s for k, s in turns.items()})
    for i, (name, J) in enumerate(motion.momentum_maps.items()):
        turned = [pin.Quaternion(q).toRotationMatrix() for q in motion.q]
        world = np.einsum("nij,nj->ni", turned, motion.p[:, 0])
        np.testing.assert_allclose(J, world[:, i], rtol=0, atol=1e-13)
        np.testing.assert_allclose(J, J[0], rtol=0, atol=1e-12)
        defect = turns[name].defect(L, *(np.atleast_2d(each) for each in jet[:3]))
        np.testing.assert_allclose(defect, 0.0, atol=1e-14)


def rotation(axis: list[float]) -> hovi.Symmetry:
    """The generator R^T w of rotations of the world about w, in the body's frame."""

    def generator(q: ca.SX) -> ca.SX:
        u, w = -q[:3], ca.DM(axis)
        t = 2 * ca.cross(u, w)
        return w + q[3] * t + ca.cross(u, t)

    return hovi.Symmetry(generator, 3, ROTATIONS)


@pytest.mark.parametrize(
    "space", [ROTATIONS, SPACES["a plane, a number and an angle"]], ids=["rotations", "mixed"]
)
@each_order
def test_the_momentum_of_a_broken_symmetry_changes_by_the_defect(
    space: ConfigurationSpace, k: int
) -> None:
    """dJ/dt = defect along exact solutions, for a generator that depends on all of q."""
    L, h, n = lagrangian_on(space, k), 1e-3, space.nv
    mixing = np.random.default_rng(1).normal(size=(n, space.nq))
    symmetry = hovi.Symmetry(lambda q: ca.sin(ca.mtimes(ca.DM(mixing), q)), n, space)
    random = np.random.default_rng(0)
    q = space.integrate(space.normalized(np.ones(space.nq)), random.normal(size=n))
    x, p = hovi.legendre(L, q, *random.normal(size=(2 * k - 1, n)))
    motion = hovi.flow(
        ChartedLagrangian(L, space, galerkin(2, k), h), x, p, 4, symmetries={"s": symmetry}
    )
    J = motion.momentum_maps["s"]
    slope = (J[0] - 8 * J[1] + 8 * J[3] - J[4]) / (12 * h)
    middle = [each[2:3] for each in motion.jets]
    top = highest_derivative(L, middle, motion.p[2:3])
    assert symmetry.defect(L, *middle, top)[0] == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("base", ["free-flyer", "planar", "continuous"])
def test_robots_that_gravity_does_not_hold_have_the_symmetries_of_their_base(base: str) -> None:
    model = with_arm(base)
    if base != "free-flyer":  # the base's own axis is along gravity
        model.jointPlacements[1] = pin.SE3(np.eye(3), np.array([0.1, 0.2, 0.3]))
    scene = hovi.Scene(hovi.load_robot(model), [hovi.effects.Gravity()])
    robot, L = scene.robot, hovi.mechanics(scene)
    point = [0.1, 0.2, 0.3] if base == "continuous" else [0.4, -0.1, 0.0]
    symmetries = {"turn": hovi.base_rotation(scene, [0, 0, 1], point)}
    if base != "continuous":
        symmetries["slide"] = hovi.base_translation(scene, [1, 2, 0])
    random = np.random.default_rng(2)
    q, v = configurations(robot, 5, size=0.5), random.normal(size=(5, robot.nv))
    x, p = hovi.legendre(L, q[0], 0.5 * v[0])
    ld = ChartedLagrangian(L, robot.space, galerkin(1, 1), 0.02)
    motion = hovi.flow(ld, x, p, 10, symmetries=symmetries)
    for name, J in motion.momentum_maps.items():
        np.testing.assert_allclose(symmetries[name].defect(L, q, v), 0.0, atol=1e-11)
        np.testing.assert_allclose(J, J[0], rtol=0, atol=1e-11)
    if base == "free-flyer":
        momenta = spatial(robot, motion.q, motion.p[:, 0])
        slide = momenta[:, :3] @ np.array([1, 2, 0]) / np.sqrt(5)
        np.testing.assert_allclose(motion.momentum_maps["slide"], slide, rtol=0, atol=1e-12)
        turn = momenta[:, 5] - np.cross(np.array(point), momenta[:, :3])[:, 2]
        np.testing.assert_allclose(motion.momentum_maps["turn"], turn, rtol=0, atol=1e-12)


@pytest.mark.parametrize("base", BASES)
def test_the_effort_of_an_arm_on_any_base_has_regular_discrete_lagrangians(base: str) -> None:
    robot = hovi.load_robot(with_arm(base))
    L: Lagrangian = hovi.Scene(robot, [hovi.effects.Gravity()]).effort_lagrangian()
    h = 0.05
    x0, x1 = points(robot.space, 2, h)
    grid = hovi.Grid.uniform(1.0, 20, galerkin(1))
    found = hovi.regularity(ChartedLagrangian.of(hovi.DiscreteLagrangian(L, grid)), x0, x1)
    W = L.evaluate(x0[:, : robot.nq], x0[:, robot.nq :], 0 * x0[:, robot.nq :])[2][0, 2, :, 2]
    n = robot.nv
    # leading terms -12/h^3 W, 6/h^2 W, -6/h^2 W, 2/h W
    leading = np.block([[-12 / h**3 * W, 6 / h**2 * W], [-6 / h**2 * W, 2 / h * W]])
    scale = np.repeat([1.0, h], n)
    miss = (found.matrix[0] - leading) * scale[:, None] * scale * h**3
    assert np.abs(miss).max() < 0.3 * np.abs(12 * W).max()
    assert np.isfinite(found.condition).all()
    assert found.determinant[0] != 0


# Refusals


def test_points_of_another_shape_are_refused() -> None:
    ld = of(ROTATIONS, 2)
    with pytest.raises(InputError, match="x must have shape"):
        ld.joining(np.ones((1, 2, 3)), np.ones((1, 2, 3)))
    plain = hovi.DiscreteLagrangian(hovi.spline(2), hovi.Grid.uniform(1.0, 4, galerkin(1)))
    with pytest.raises(InputError, match="on a vector space L_d is"):
        ChartedLagrangian.of(plain)
