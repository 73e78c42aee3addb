"""The banded model under linearised equations, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from hovi.optimize.banded_model import BandLayout
from hovi.optimize.constrained_model import ConstrainedModel, ConstraintRows
from hovi.optimize.quadratic_model import IntervalSum

N, M, DOF, OWN = 6, 5, 2, 2


def layout(unequal: bool) -> BandLayout:
    """Nodes with two columns and one inner mode, the first and last node fixed."""
    nodes = np.full((N + 1, 2, DOF), -1)
    inner = np.zeros((N, 1, DOF), dtype=np.intp)
    count = 0
    for k in range(N + 1):
        if 0 < k < N:
            nodes[k] = count + np.arange(2 * DOF).reshape(2, DOF)
            count += 2 * DOF
        if k < N:
            inner[k] = count + np.arange(DOF)
            count += DOF
    unknowns = np.concatenate([nodes[:-1], nodes[1:], inner], axis=1)
    scales = np.ones((N, M))
    scales[:, [1, 3]] = np.linspace(0.5, 2.0, N)[:, None]
    return BandLayout.of(unknowns, scales if unequal else None)


def model(unequal: bool, indefinite: bool = False, repeated: bool = False) -> ConstrainedModel:
    """A random model; one equation per interval, a second one in two of them."""
    rng = np.random.default_rng(3)
    roots = rng.standard_normal((N, M * DOF, M * DOF))
    hessian = np.matmul(roots, roots.transpose(0, 2, 1))
    if indefinite:
        hessian -= 8.0 * np.eye(M * DOF)
    blocks = hessian.reshape(N, M, DOF, M, DOF).transpose(0, 1, 3, 2, 4).copy()
    metric = np.broadcast_to(np.eye(M), (N, M, M)).copy()
    plan = layout(unequal)
    metric_band = plan.assemble(metric[..., None, None] * np.eye(DOF))
    rows = [
        ConstraintRows(slice(None), rng.standard_normal((N, 1, M, DOF))),
        ConstraintRows(np.array([1, 4]), rng.standard_normal((2, 1, 4, DOF))),
    ]
    rows += rows[1:] if repeated else []
    intervals = IntervalSum(rng.standard_normal((N, M, DOF)), blocks, metric)
    y = rng.standard_normal(sum(each.size for each in rows))
    return ConstrainedModel(intervals, rows, y, plan, metric_band)


def dense(of: ConstrainedModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """H, A and D, column by column."""
    units = np.eye(len(of.gradient))
    H = np.stack([of.hessian_product(e) for e in units], axis=1)
    A = np.stack([of.jacobian_product(e) for e in units], axis=1)
    D = np.stack([of.plain.metric_product(e) for e in units], axis=1)
    return H, A, D


@pytest.mark.parametrize("unequal", [False, True])
def test_products_with_the_jacobian_are_transposed_and_squared_in_the_band(unequal: bool) -> None:
    of = model(unequal)
    H, A, D = dense(of)
    y = np.random.default_rng(0).standard_normal(len(A))
    np.testing.assert_allclose(of.transposed_product(y), A.T @ y, rtol=1e-12, atol=1e-12)
    b = np.random.default_rng(1).standard_normal(len(H))
    factor = of.factor(30.0, 0.5)
    assert factor is not None
    expected = np.linalg.solve(H + 30.0 * A.T @ A + 0.5 * D, b)
    np.testing.assert_allclose(factor.solve(b), expected, rtol=1e-9, atol=1e-9)
    normal = of.normal_factor(0.1)
    assert normal is not None
    expected = np.linalg.solve(A.T @ A + 0.1 * D, b)
    np.testing.assert_allclose(normal.solve(b), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("unequal", [False, True])
@pytest.mark.parametrize("repeated", [False, True])
def test_a_step_solves_the_kkt_equations(unequal: bool, repeated: bool) -> None:
    """Also where an equation is stated twice, and its multipliers are not unique."""
    of = model(unequal, repeated=repeated)
    H, A, _ = dense(of)
    c = A @ np.random.default_rng(2).standard_normal(len(H))
    factor = of.factor(1e3, 0.0)
    assert factor is not None
    s, z = of.solve(factor, 1e3, c, 1e-12)
    np.testing.assert_allclose(A @ s, -c, rtol=0, atol=1e-10)
    np.testing.assert_allclose(H @ s + A.T @ z, -of.gradient, rtol=0, atol=1e-8)
    kkt = np.block([[H, A.T], [A, np.zeros((len(A), len(A)))]])
    expected = np.linalg.lstsq(kkt, np.concatenate([-of.gradient, -c]), rcond=None)[0]
    np.testing.assert_allclose(s, expected[: len(H)], rtol=0, atol=1e-8)


def test_multipliers_fit_a_step_that_meets_the_equations_roughly() -> None:
    of = model(unequal=True)
    H, A, _ = dense(of)
    c = A @ np.ones(len(H))
    factor = of.factor(1e-2, 0.0)
    assert factor is not None
    s, z = of.solve(factor, 1e-2, c, 0.5)
    assert np.linalg.norm(A @ s + c) > 1e-3 * np.linalg.norm(c)
    np.testing.assert_allclose(H @ s + A.T @ z, -of.gradient, rtol=0, atol=1e-9)


def test_a_large_penalty_counts_the_negative_eigenvalues_of_the_tangent_space() -> None:
    of = model(unequal=True, indefinite=True)
    H, A, _ = dense(of)
    Z = scipy.linalg.null_space(A)
    tangent = int(np.sum(np.linalg.eigvalsh(Z.T @ H @ Z) < 0))
    everywhere = int(np.sum(np.linalg.eigvalsh(H) < 0))
    assert 0 < tangent < everywhere
    assert of.negative_eigenvalues(0.0) == everywhere
    assert of.negative_eigenvalues(1e6) == tangent
    assert of.factor(1e6, 0.0) is None


def test_least_squares_multipliers_make_the_gradient_small() -> None:
    of = model(unequal=True)
    _, A, D = dense(of)
    z = of.least_squares_multipliers()
    root = scipy.linalg.sqrtm(np.linalg.inv(D)).real
    expected = np.linalg.lstsq(root @ A.T, -root @ of.gradient, rcond=None)[0]
    np.testing.assert_allclose(z, expected, rtol=0, atol=1e-3 * np.abs(expected).max())
