"""The banded model agrees with the dense one: sums, solves and definiteness."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi._native import band as native
from hovi.optimize.banded_model import PANEL, BandLayout, BandModel
from samples.interval_problems import SIZES, IntervalProblem, random_problem

Array = npt.NDArray[np.float64]

DEFINITE, INDEFINITE = 40.0, 0.0


def build(
    n: int, modes: tuple[int, ...], curvature: float, seed: int = 0, *, equal: bool = False
) -> tuple[IntervalProblem, BandModel]:
    """Unequal steps scale the velocity of a node differently on both sides; equal steps do not."""
    N = len(modes)
    steps = np.ones(N) if equal else np.random.default_rng(N).uniform(0.1, 1.0, N)
    problem = random_problem(n, modes, steps, curvature, seed)
    scales = np.ones((N, 4 + max(modes)))
    scales[:, 1] = scales[:, 3] = steps
    layout = BandLayout.of(problem.unknowns, None if equal else scales)
    metric = layout.assemble(problem.nodal.metric[..., None, None] * np.eye(n))
    return problem, BandModel(problem.nodal, layout, metric)


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_the_band_stores_the_lower_triangle_of_the_dense_matrix(
    n: int, modes: tuple[int, ...]
) -> None:
    problem, model = build(n, modes, INDEFINITE)
    size = model.layout.size
    band = model.layout.assemble(problem.nodal.hessian)
    dense = np.zeros((size, size))
    for j in range(size):
        column = band[j, j % PANEL :][: size - j]
        dense[j : j + len(column), j] = column
    np.testing.assert_allclose(dense, np.tril(problem.hessian), rtol=0, atol=1e-13)
    assert band.shape[1] < (4 + max(modes)) * n + 2 * PANEL


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_scatter_and_gather_are_transposes(n: int, modes: tuple[int, ...]) -> None:
    problem, model = build(n, modes, INDEFINITE)
    random = np.random.default_rng(0)
    s, local = (
        random.normal(size=problem.gradient.shape),
        random.normal(size=problem.nodal.gradient.shape),
    )
    np.testing.assert_allclose(model.gradient, problem.gradient, rtol=0, atol=1e-13)
    np.testing.assert_allclose(model.gather(s), problem.nodal_map @ s, rtol=0, atol=1e-15)
    assert np.vdot(model.scatter(local), s) == pytest.approx(np.vdot(local, model.gather(s)))


@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_the_metric_product_equals_the_dense_one(n: int, modes: tuple[int, ...]) -> None:
    problem, model = build(n, modes, INDEFINITE)
    s = np.random.default_rng(1).normal(size=problem.gradient.shape)
    expected = problem.metric @ s
    np.testing.assert_allclose(
        model.metric_product(s), expected, atol=1e-12 * np.abs(expected).max()
    )


@pytest.mark.parametrize("equal", [True, False], ids=["equal steps", "unequal steps"])
@pytest.mark.parametrize("shift", [0.0, 0.7, 30.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_solves_equal_dense_solves(
    n: int, modes: tuple[int, ...], shift: float, equal: bool
) -> None:
    problem, model = build(n, modes, DEFINITE, equal=equal)
    factor = model.factor(shift)
    assert factor is not None
    expected = problem.newton_step(shift)
    step = factor.solve(-model.gradient)
    np.testing.assert_allclose(step, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    again = model.factor(shift)
    assert again is not None
    np.testing.assert_array_equal(again.solve(-model.gradient), step)


@pytest.mark.parametrize("shift", [0.0, 30.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_steps_come_with_their_slope_and_length(
    n: int, modes: tuple[int, ...], shift: float
) -> None:
    problem, model = build(n, modes, DEFINITE)
    factor = model.factor(shift)
    assert factor is not None
    step, slope, length = model.descend(factor)
    np.testing.assert_array_equal(step, factor.solve(-model.gradient))
    assert slope == pytest.approx(problem.gradient @ step, rel=1e-12)
    assert length == pytest.approx(step @ problem.metric @ step, rel=1e-12)


@pytest.mark.parametrize("n", [5, 6, 7, 16, 30])
def test_every_kernel_solves_every_matrix_size(n: int) -> None:
    problem, model = build(n, (2, 0, 1, 2, 2), DEFINITE + 10.0 * n)
    layout = model.layout
    band = layout.assemble(problem.nodal.hessian)
    expected = problem.newton_step(0.0)
    for portable in (False, True):
        factor, step = np.empty_like(band), np.empty_like(expected)
        assert native.factor(band, band, 0.0, layout.rows, layout.size, factor, portable)
        native.solve(factor, layout.rows, -model.gradient, step, portable)
        np.testing.assert_allclose(step, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


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


def test_end_nodes_and_absent_modes_are_not_unknowns() -> None:
    problem, model = build(2, (1, 0, 2), DEFINITE)
    assert model.layout.size == 2 * (2 * 2) + 2 * (1 + 0 + 2)
    local = model.gather(np.ones(model.layout.size))
    assert not local[0, :2].any()
    assert not local[-1, 2:4].any()
    for k, r in enumerate(problem.modes):
        assert local[k, 4 : 4 + r].all()
        assert not local[k, 4 + r :].any()


def test_a_random_vector_is_reproducible() -> None:
    _, model = build(2, (1, 0, 2), DEFINITE)
    np.testing.assert_array_equal(model.random_vector(3), model.random_vector(3))
    assert model.random_vector(3).shape == model.gradient.shape
    assert (model.random_vector(3) != model.random_vector(4)).any()
