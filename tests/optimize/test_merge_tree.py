"""Merging in pairs gives the dense solution and the inertia, and is accurate at small h."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.optimize.banded_model import BandLayout, BandModel
from hovi.optimize.merge_tree import MergeTree, MergeTreeModel, merge_levels
from hovi.optimize.quadratic_model import IntervalSum
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.schemes import galerkin
from samples.interval_problems import SIZES, IntervalProblem, random_problem

Array = npt.NDArray[np.float64]

DEFINITE, INDEFINITE = 40.0, 0.0


def build(
    n: int, modes: tuple[int, ...], curvature: float, seed: int = 0
) -> tuple[IntervalProblem, MergeTreeModel]:
    N = len(modes)
    steps = np.random.default_rng(N).uniform(0.1, 1.0, N)
    problem = random_problem(n, modes, steps, curvature, seed)
    tree = MergeTree(merge_levels(steps), N, problem.inner_modes, n, problem.present)
    return problem, MergeTreeModel(problem.regular, tree)


def coordinates(problem: IntervalProblem, model: MergeTreeModel) -> Array:
    """The tree's coordinates of every dense unknown: shape (size of the tree, size)."""
    size = len(model.gradient)
    columns = np.stack([model.gather(e) for e in np.eye(size)], axis=-1)
    flat = columns.reshape(-1, size)
    return np.linalg.lstsq(flat, problem.regular_map.reshape(len(flat), -1))[0]


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_the_coordinates_of_the_tree_span_exactly_the_discrete_paths(
    n: int, modes: tuple[int, ...]
) -> None:
    problem, model = build(n, modes, INDEFINITE)
    C = coordinates(problem, model)
    columns = np.stack([model.gather(c) for c in C.T], axis=-1)
    np.testing.assert_allclose(columns, problem.regular_map, rtol=0, atol=1e-12)
    assert np.linalg.matrix_rank(C) == problem.gradient.size
    slots = sum(np.prod(shape) for shape in model.tree.shapes)
    assert slots == problem.gradient.size + n * int((~problem.present).sum())


@pytest.mark.parametrize("share", [0.5, 0.2, 0.9])
def test_parts_of_an_interval_without_own_coordinates_are_one_cubic(share: float) -> None:
    cubic = np.polynomial.Polynomial(np.random.default_rng(2).normal(size=4))

    def parts(ends: list[float]) -> Array:
        q, h = cubic(np.array(ends)), np.diff(ends)
        hv = [h * cubic.deriv()(np.array(ends[i : i + len(h)])) for i in (0, 1)]
        return np.stack([q[:-1], hv[0], np.diff(q) - hv[0], hv[1] - hv[0]], axis=1)

    (level,) = merge_levels(np.array([share, 1.0 - share]))
    whole = np.concatenate([parts([0.0, 1.0]), np.zeros((1, 2))], axis=1)
    found = level.split(whole[..., None])[..., 0]
    np.testing.assert_allclose(found, parts([0.0, share, 1.0]), rtol=0, atol=1e-14)


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_scatter_and_gather_are_transposes(n: int, modes: tuple[int, ...]) -> None:
    problem, model = build(n, modes, INDEFINITE)
    random = np.random.default_rng(0)
    s = random.normal(size=model.gradient.shape)
    local = random.normal(size=problem.nodal.gradient.shape)
    assert np.vdot(model.scatter(local), s) == pytest.approx(np.vdot(local, model.gather(s)))
    C = coordinates(problem, model)
    np.testing.assert_allclose(C.T @ model.gradient, problem.gradient, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_the_metric_product_equals_the_dense_one(n: int, modes: tuple[int, ...]) -> None:
    problem, model = build(n, modes, INDEFINITE)
    C = coordinates(problem, model)
    s = np.random.default_rng(1).normal(size=problem.gradient.shape)
    expected = problem.metric @ s
    found = C.T @ model.metric_product(C @ s)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("shift", [0.0, 0.7, 30.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_solves_equal_dense_solves(n: int, modes: tuple[int, ...], shift: float) -> None:
    problem, model = build(n, modes, DEFINITE)
    factor = model.factor(shift)
    assert factor is not None
    expected = problem.regular_map @ problem.newton_step(shift)
    step = model.gather(factor.solve(-model.gradient))
    np.testing.assert_allclose(step, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("curvature", [DEFINITE, INDEFINITE])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_factorization_fails_exactly_where_the_matrix_is_not_positive_definite(
    n: int, modes: tuple[int, ...], curvature: float
) -> None:
    for seed in range(5):
        problem, model = build(n, modes, curvature, seed)
        edge = -problem.eigenvalues()[0]
        for shift in (0.0, edge - 1e-6 * abs(edge), edge + 1e-6 * abs(edge), edge + 1.0):
            if shift >= 0:
                assert (model.factor(shift) is not None) == (shift > edge)


@pytest.mark.parametrize("curvature", [DEFINITE, 8.0, INDEFINITE, -8.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_the_count_of_negative_eigenvalues_equals_the_dense_one(
    n: int, modes: tuple[int, ...], curvature: float
) -> None:
    for seed in range(5):
        problem, model = build(n, modes, curvature, seed)
        expected = int((np.linalg.eigvalsh(problem.hessian) < 0).sum())
        assert model.negative_eigenvalues() == expected


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_band_and_tree_take_the_same_newton_step(n: int, modes: tuple[int, ...]) -> None:
    steps = np.random.default_rng(n).uniform(0.1, 1.0, len(modes))
    problem = random_problem(n, modes, steps, DEFINITE)
    levels = merge_levels(problem.steps)
    tree = MergeTreeModel(
        problem.regular, MergeTree(levels, len(modes), problem.inner_modes, n, problem.present)
    )
    scales = np.ones((len(modes), 4 + max(modes)))
    scales[:, 1] = scales[:, 3] = steps
    layout = BandLayout.of(problem.unknowns, scales)
    metric = layout.assemble(problem.nodal.metric[..., None, None] * np.eye(n))
    band = BandModel(problem.nodal, layout, metric)
    for shift in (0.0, 3.0):
        by_tree, by_band = tree.factor(shift), band.factor(shift)
        assert by_tree is not None
        assert by_band is not None
        regular = tree.gather(by_tree.solve(-tree.gradient))
        nodal = band.gather(by_band.solve(-band.gradient))
        q0, hv0, q1, hv1 = (nodal[:, i] for i in range(4))
        expected = np.stack([q0, hv0, q1 - q0 - hv0, hv1 - hv0], axis=1)
        scale = np.abs(nodal).max()
        np.testing.assert_allclose(regular[:, :4], expected, rtol=0, atol=1e-11 * scale)
        np.testing.assert_allclose(regular[:, 4:], nodal[:, 4:], rtol=0, atol=1e-11 * scale)


# Small steps


def merged(grid: Grid, L: CasadiLagrangian, path: DiscretePath) -> tuple[MergeTreeModel, Array]:
    """The model of the action at a path in regularized columns, and those columns, (N, m, n)."""
    expansion = DiscreteLagrangian(L, grid).expand(path, "regular")
    rows = grid.schemes[0].regular_table[:, 2]
    metric = (rows.T * grid.schemes[0].weights) @ rows * (1 / grid.steps[:, None, None]) ** 3
    present = np.ones((grid.intervals, grid.inner_modes), dtype=bool)
    tree = MergeTree(merge_levels(grid.steps), grid.intervals, grid.inner_modes, L.nv, present)
    h = grid.steps[:, None, None]
    ends = [path.q[:-1, None], h * path.v[:-1, None], h**2 * path.z, h**2 * path.inner]
    model = MergeTreeModel(IntervalSum(expansion.gradient, expansion.hessian, metric), tree)
    return model, np.concatenate(ends, axis=1)


def without_modes(grid: Grid, q: Array, v: Array, z: Array) -> DiscretePath:
    return DiscretePath(q, v, z, np.zeros((grid.intervals, grid.inner_modes, q.shape[1])))


def quadratic(potential: float) -> CasadiLagrangian:
    """L = 1/2 a^2 + potential/2 v^2, on one joint."""
    q, v, a = (ca.SX.sym(name) for name in "qva")
    return CasadiLagrangian([q, v, a], a**2 / 2 + potential * v**2 / 2)


@pytest.mark.parametrize("step", [1e-3, 1e-5])
def test_the_spline_is_exact_at_any_step_size(step: float) -> None:
    # from the cubic plus a wave with zero ends, one Newton step leads to the cubic
    N = 10_000
    grid = Grid.uniform(N * step, N, galerkin(0))
    T, h, t = grid.duration, grid.steps[0], grid.t[:, None]
    s = t / T
    c = np.array([0.3, -1.0, 2.0, 1.5])  # of the cubic in s
    w = 2 * np.pi
    wave = 0.1 * (1 - np.cos(w * s)), 0.1 * w * np.sin(w * s) / T
    q = c[0] + s * (c[1] + s * (c[2] + s * c[3])) + wave[0]
    v = (c[1] + s * (2 * c[2] + 3 * c[3] * s)) / T + wave[1]
    # z without cancellation: by the identities of cos and sin for the wave
    a, jerk = (2 * c[2] + 6 * c[3] * s[:-1]) / T**2, 6 * c[3] / T**3
    cubic_z = np.stack([a / 2 + jerk * h / 6, a + jerk * h / 2], axis=1)
    d = w * h / T  # cos x - cos(x + d) - d sin x  =  2 sin^2(d/2) cos x + (sin d - d) sin x
    x = w * s[:-1]
    sine = -(d**3) / 6 + d**5 / 120 - d**7 / 5040  # sin d - d
    z0 = 0.1 * (2 * np.sin(d / 2) ** 2 * np.cos(x) + sine * np.sin(x)) / h**2
    z1 = 0.1 * w / T * 2 * np.cos(x + d / 2) * np.sin(d / 2) / h
    z = cubic_z + np.stack([z0, z1], axis=1)
    model, columns = merged(grid, quadratic(0.0), without_modes(grid, q, v, z))
    factor = model.factor(0.0)
    assert factor is not None
    found = columns + model.gather(factor.solve(-model.gradient))
    size = np.abs(cubic_z).max()
    np.testing.assert_allclose(found[:, 2:] / h**2, cubic_z, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(found[:, 0], (q - wave[0])[:-1], rtol=0, atol=1e-13)
    np.testing.assert_allclose(found[:, 1] / h, (v - wave[1])[:-1], rtol=0, atol=1e-12 / T)


def test_ten_thousand_intervals_reproduce_the_analytic_motion() -> None:
    # L = a^2/2 + v^2/2: q'''' = q'', and q = e^t + e^-t + t - 1 among others
    N, T = 10_000, 2.0
    grid = Grid.uniform(T, N, galerkin(1))
    t = grid.t[:, None]
    q, v = np.exp(t) + np.exp(-t) + t - 1, np.exp(t) - np.exp(-t) + 1
    (q0, q1), (v0, v1) = q[[0, -1], 0], v[[0, -1], 0]
    Z0, Z1 = q1 - q0 - T * v0, T * (v1 - v0)
    start = galerkin(0).rows(t[:, 0] / T) @ np.array([T * v0, Z0, Z1])  # the cubic, (N + 1, 3)
    a = start[:, 2] / T**2
    jerk = np.diff(a) / grid.steps
    z = np.stack([a[:-1] / 2 + jerk * grid.steps / 6, a[:-1] + jerk * grid.steps / 2], axis=1)
    guess = q0 + start[:, :1], start[:, 1:2] / T
    model, columns = merged(grid, quadratic(1.0), without_modes(grid, *guess, z[..., None]))
    factor = model.factor(0.0)
    assert factor is not None
    found = columns + model.gather(factor.solve(-model.gradient))
    np.testing.assert_allclose(found[:, 0], q[:-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[:, 1] / grid.steps[0], v[:-1], rtol=0, atol=1e-12)
    z1 = np.diff(np.exp(t) - np.exp(-t), axis=0) / grid.steps[0]
    np.testing.assert_allclose(found[:, 3] / grid.steps[0] ** 2, z1, rtol=0, atol=1e-10)
    assert model.negative_eigenvalues() == 0


@pytest.mark.parametrize(
    ("T", "passed"), [(6.0, 0), (6.5, 1), (8.9, 1), (9.1, 2), (12.4, 2), (12.7, 3), (16.0, 4)]
)
@pytest.mark.parametrize("n", [1, 2])
def test_negative_eigenvalues_count_the_conjugate_points(T: float, passed: int, n: int) -> None:
    # L = a^2/2 - v^2/2: T sin T + 2 cos T = 2 at 2 pi, 8.987, 4 pi, 15.45, ... per joint
    grid = Grid.uniform(T, 40, galerkin(1))
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    L = CasadiLagrangian([q, v, a], ca.sumsqr(a) / 2 - ca.sumsqr(v) / 2)
    zero = np.zeros((41, n))
    model, _ = merged(grid, L, without_modes(grid, zero, zero, np.zeros((40, 2, n))))
    assert model.negative_eigenvalues() == n * passed
    assert (model.factor(0.0) is None) == (passed > 0)
