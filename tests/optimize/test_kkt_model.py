"""The KKT matrix in a band, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from hovi._native import band as native
from hovi.optimize.banded_model import BandLayout
from hovi.optimize.bordered_model import Border, BorderedModel
from hovi.optimize.equation_model import NORMAL, EquationFactor, EquationModel, PenaltyModel
from hovi.optimize.kkt_model import ConstraintRows, KktLayout, KktModel
from hovi.optimize.quadratic_model import IntervalSum
from hovi.optimize.trust_region import solve_subproblem

Array = np.ndarray
N, M, DOF = 6, 5, 2


def layout(unequal: bool, periodic: bool) -> BandLayout:
    """Nodes with two columns and one inner mode; end nodes fixed, or one node."""
    nodes = np.full((N + 1, 2, DOF), -1)
    inner = np.zeros((N, 1, DOF), dtype=np.intp)
    count = 0
    for k in range(N + 1):
        if 0 < k < N or (periodic and k == 0):
            nodes[k] = count + np.arange(2 * DOF).reshape(2, DOF)
            count += 2 * DOF
        if k < N:
            inner[k] = count + np.arange(DOF)
            count += DOF
    if periodic:
        nodes[N] = nodes[0]
    unknowns = np.concatenate([nodes[:-1], nodes[1:], inner], axis=1)
    scales = np.ones((N, M))
    scales[:, [1, 3]] = np.linspace(0.5, 2.0, N)[:, None]
    return BandLayout.of(unknowns, scales if unequal else None)


def model(
    unequal: bool = True,
    periodic: bool = False,
    curvature: float = 0.0,
    repeated: bool = False,
    seed: int = 3,
) -> KktModel:
    """A random model; one equation per interval, a second one in two of them."""
    rng = np.random.default_rng(seed)
    roots = rng.standard_normal((N, M * DOF, M * DOF))
    hessian = np.matmul(roots, roots.transpose(0, 2, 1)) + curvature * np.eye(M * DOF)
    blocks = hessian.reshape(N, M, DOF, M, DOF).transpose(0, 1, 3, 2, 4).copy()
    metric = np.broadcast_to(np.eye(M), (N, M, M)).copy()
    plan = layout(unequal, periodic)
    metric_band = plan.assemble(metric[..., None, None] * np.eye(DOF))
    rows = [
        ConstraintRows(slice(None), rng.standard_normal((N, 1, M, DOF))),
        ConstraintRows(np.array([1, 4]), rng.standard_normal((2, 1, 4, DOF))),
    ]
    rows += rows[1:] if repeated else []
    intervals = IntervalSum(rng.standard_normal((N, M, DOF)), blocks, metric)
    wide = KktLayout.of(plan, rows)
    return KktModel(intervals, rows, wide, metric_band, wide.extended(metric_band))


def dense(of: KktModel) -> tuple[Array, Array, Array]:
    """H, A and D, column by column of the intervals."""
    units = np.eye(len(of.gradient))
    A = np.stack([of.jacobian_product(e) for e in units], axis=1)
    D = np.stack([of.plain.metric_product(e) for e in units], axis=1)
    columns = np.stack([of.plain.gather(e) for e in units])
    H = np.einsum("xkai,kabij,ykbj->xy", columns, of.plain.intervals.hessian, columns)
    return H, A, D


CASES = pytest.mark.parametrize(
    ("unequal", "periodic"), [(False, False), (True, False), (True, True)]
)


@CASES
def test_products_with_the_jacobian_are_transposed(unequal: bool, periodic: bool) -> None:
    of = model(unequal, periodic)
    _, A, _ = dense(of)
    y = np.random.default_rng(0).standard_normal(len(A))
    pulled = of.plain.scatter(of.pulled_columns(y))
    np.testing.assert_allclose(pulled, A.T @ y, rtol=1e-12, atol=1e-12)


@CASES
@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize("delta", [None, 0.3])
def test_a_step_solves_the_kkt_equations(
    unequal: bool, periodic: bool, shift: float, delta: float | None
) -> None:
    of = model(unequal, periodic)
    H, A, D = dense(of)
    rng = np.random.default_rng(2)
    force, target = rng.standard_normal(len(H)), rng.standard_normal(len(A))
    factor = of.factor(shift, delta)
    assert factor is not None
    s, z = factor.solve(force, target)
    kkt = np.block([[H + shift * D, A.T], [A, -(delta or 0.0) * np.eye(len(A))]])
    expected = np.linalg.solve(kkt, np.concatenate([force, target]))
    np.testing.assert_allclose(np.concatenate([s, z]), expected, rtol=0, atol=1e-9)
    assert of.curvature(s) == pytest.approx(s @ H @ s, rel=1e-10)


@pytest.mark.parametrize("unequal", [False, True])
def test_equations_may_be_stated_twice(unequal: bool) -> None:
    """The step is the same; the multipliers are not unique."""
    of = model(unequal, repeated=True)
    H, A, _ = dense(of)
    c = A @ np.random.default_rng(2).standard_normal(len(H))
    factor = of.factor(0.0)
    assert factor is not None
    s, z = factor.solve(-of.gradient, -c)
    np.testing.assert_allclose(A @ s, -c, rtol=0, atol=1e-9)
    np.testing.assert_allclose(H @ s + A.T @ z, -of.gradient, rtol=0, atol=1e-8)
    kkt = np.block([[H, A.T], [A, np.zeros((len(A), len(A)))]])
    expected = np.linalg.lstsq(kkt, np.concatenate([-of.gradient, -c]), rcond=None)[0]
    np.testing.assert_allclose(s, expected[: len(H)], rtol=0, atol=1e-8)


@pytest.mark.parametrize("repeated", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_a_hessian_that_is_singular_off_the_tangent_space_has_a_factor(
    seed: int, repeated: bool
) -> None:
    """Equations alone determine every second unknown."""
    of = model(repeated=repeated, seed=seed)
    rng = np.random.default_rng(seed)
    rows = [ConstraintRows(slice(None), rng.standard_normal((N, 3, M, DOF)))]
    rows *= 2 if repeated else 1
    bases = rng.standard_normal((N, M, M, DOF))
    bases[..., 1] = 0.0
    intervals = of.plain.intervals
    hessian = np.einsum("kria,krjb->kijab", bases, bases)
    plain = IntervalSum(intervals.gradient, hessian, intervals.metric)
    wide = KktLayout.of(of.layout.plain, rows)
    band = of.layout.plain.assemble(intervals.metric[..., None, None] * np.eye(DOF))
    of = KktModel(plain, rows, wide, band, wide.extended(band))
    H, A, _ = dense(of)
    assert np.linalg.matrix_rank(H) < len(H)
    assert of.negative_eigenvalues() == 0
    c = A @ rng.standard_normal(len(H))
    factor = of.factor(0.0)
    assert factor is not None
    s, z = factor.solve(-of.gradient, -c)
    np.testing.assert_allclose(A @ s, -c, rtol=0, atol=1e-9 * np.abs(c).max())
    left = H @ s + A.T @ z + of.gradient
    np.testing.assert_allclose(left, 0.0, atol=1e-8 * np.abs(of.gradient).max())


@CASES
@pytest.mark.parametrize("repeated", [False, True])
def test_signs_count_the_negative_eigenvalues_of_the_tangent_space(
    unequal: bool, periodic: bool, repeated: bool
) -> None:
    found = set()
    for curvature in (0.0, -3.0, -6.0, -8.0, -12.0):
        of = model(unequal, periodic, curvature, repeated, seed=5)
        H, A, _ = dense(of)
        Z = scipy.linalg.null_space(A)
        tangent = int(np.sum(np.linalg.eigvalsh(Z.T @ H @ Z) < 0))
        assert of.negative_eigenvalues() == tangent
        assert (of.factor(0.0) is not None) == (tangent == 0)
        found.add(tangent)
    assert len(found) > 3


def test_least_squares_multipliers_make_the_gradient_small() -> None:
    of = model()
    _, A, D = dense(of)
    z = of.least_squares_multipliers()
    root = scipy.linalg.sqrtm(np.linalg.inv(D)).real
    expected = np.linalg.lstsq(root @ A.T, -root @ of.gradient, rcond=None)[0]
    np.testing.assert_allclose(z, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("portable", [False, True])
def test_a_matrix_without_a_pivot_has_no_factor(portable: bool) -> None:
    rows, out = np.array([4]), np.zeros((4, 4))
    for matrix in (np.zeros((4, 4)), np.full((4, 4), np.nan)):
        signs = np.zeros(4)
        none = np.zeros((4, 4))
        assert native.factor_signed(matrix, none, 0.0, rows, 4, signs, out, portable) == -1


def under_equations(
    repeated: bool = False, curvature: float = 0.0
) -> tuple[EquationModel, Array, Array]:
    """A model whose Newton steps satisfy equations, its dense Hessian, and A."""
    of = model(repeated=repeated, curvature=curvature)
    H, A, _ = dense(of)
    c = A @ np.random.default_rng(2).standard_normal(len(H))
    return EquationModel(of.plain, of, c), H, A


def test_newton_steps_under_equations_solve_the_kkt_system() -> None:
    steps, H, A = under_equations()
    kkt = np.block([[H, A.T], [A, np.zeros((len(A), len(A)))]])
    s, z = np.split(
        np.linalg.solve(kkt, -np.append(steps.gradient, steps.residual)), [len(steps.gradient)]
    )
    factor = steps.factor(0.0)
    assert factor is not None
    step, slope, length = steps.descend(factor)
    np.testing.assert_allclose(step, s, atol=1e-9 * np.abs(s).max())
    assert length == pytest.approx(step @ steps.metric_product(step), rel=1e-10)
    change, As = steps.reaction(steps.gradient, step, factor)
    np.testing.assert_allclose(change, z, rtol=1e-7)
    np.testing.assert_allclose(As, -steps.residual, atol=1e-9)
    # the decrease of the model is minus half the slope, as without equations
    decrease = -steps.gradient @ step - 0.5 * step @ H @ step
    assert -0.5 * slope == pytest.approx(decrease, rel=1e-9)
    rhs = np.random.default_rng(3).normal(size=len(step))
    solved = np.linalg.solve(kkt, np.append(rhs, np.zeros(len(A))))[: len(step)]
    np.testing.assert_allclose(factor.solve(rhs), solved, atol=1e-9 * np.abs(solved).max())


def test_equations_that_repeat_each_other_are_satisfied() -> None:
    steps, _, A = under_equations(repeated=True)
    factor = steps.factor(0.0)
    assert isinstance(factor, EquationFactor)
    step, _, _ = steps.descend(factor)
    np.testing.assert_allclose(A @ step, -steps.residual, rtol=0, atol=1e-9)


@pytest.mark.parametrize("radius", [np.inf, 0.3])
def test_a_shift_keeps_what_takes_the_residual_away_within_the_radius(radius: float) -> None:
    steps, H, A = under_equations()
    D, shift, c = dense(steps.kkt)[2], 0.5, steps.residual
    kkt = np.block([[H + shift * D, A.T], [A, np.zeros((len(A), len(A)))]])
    size = len(steps.gradient)
    normal = np.linalg.solve(kkt, np.append(np.zeros(size), -c))[:size]
    fraction = min(1.0, NORMAL * radius / np.sqrt(normal @ D @ normal))
    assert (fraction < 1.0) == np.isfinite(radius)
    factor = steps.factor(shift)
    assert factor is not None
    step, slope, _ = steps.descend(factor, radius)
    s, z = np.split(np.linalg.solve(kkt, -np.append(steps.gradient, fraction * c)), [size])
    np.testing.assert_allclose(step, s, atol=1e-9 * np.abs(s).max())
    assert slope == pytest.approx(steps.gradient @ s + fraction * z @ c, rel=1e-8)


@pytest.mark.parametrize("radius", [0.5, 5.0, 50.0])
@pytest.mark.parametrize("size", [1.0, 100.0])
def test_steps_under_equations_stay_within_the_radius(radius: float, size: float) -> None:
    """Also where the whole Newton step is far longer than steps for small shifts."""
    for seed, other in ((0, 0), (20, 3), (24, 5), (29, 2), (30, 1), (38, 1)):
        of = model(seed=seed)
        _, A, _ = dense(of)
        c = size * (A @ np.random.default_rng(other).standard_normal(len(of.gradient)))
        steps = EquationModel(of.plain, of, c)
        for guess in (0.0, 1e-3, 1.0):
            trial = solve_subproblem(steps, radius, guess)
            assert trial.norm <= 1.25 * radius
            assert trial.newton or trial.norm > 0.5 * radius


def test_multipliers_of_a_shifted_step_are_those_of_least_squares() -> None:
    """As the shift grows; those of the step itself would grow with it."""
    steps, _, A = under_equations()
    D = dense(steps.kkt)[2]
    factor = steps.factor(1e6)
    assert factor is not None
    step, _, _ = steps.descend(factor, 1e-3)
    z, As = steps.reaction(steps.gradient, step, factor)
    normal = A @ np.linalg.solve(D, A.T)
    least = np.linalg.solve(normal, -A @ np.linalg.solve(D, steps.gradient))
    np.testing.assert_allclose(z, least, rtol=1e-3)
    np.testing.assert_allclose(As, A @ step, atol=1e-12 * np.abs(As).max())
    np.testing.assert_allclose(As, -factor.fraction * steps.residual, rtol=1e-3)


@pytest.mark.parametrize("shift", [0.0, 0.5])
def test_a_penalty_adds_its_normal_matrix(shift: float) -> None:
    of = model()
    H, A, D = dense(of)
    weight = 30.0
    penalized = PenaltyModel(of.plain, of, weight)
    gradient = of.plain.gradient
    factor = penalized.factor(shift)
    assert factor is not None
    whole = H + weight * A.T @ A + shift * D
    step, slope, length = penalized.descend(factor)
    np.testing.assert_allclose(step, np.linalg.solve(whole, -gradient), rtol=1e-7)
    assert slope == pytest.approx(gradient @ step, rel=1e-9)
    assert length == pytest.approx(step @ D @ step, rel=1e-9)
    assert not penalized.equations
    negative = PenaltyModel(model(curvature=-12.0).plain, model(curvature=-12.0), 1e-3)
    assert negative.factor(0.0) is None


def test_a_correction_takes_away_what_is_left_beyond_the_linearised_residual() -> None:
    steps, _, A = under_equations()
    left = np.random.default_rng(5).standard_normal(len(A))
    for shift, taken in ((0.0, 1.0), (0.5, 0.4)):
        factor = steps.factor(shift)
        assert factor is not None
        steps.descend(factor, 0.3)
        wanted = (1.0 - taken * factor.fraction) * steps.residual
        more = steps.correction(factor, left - wanted)
        np.testing.assert_allclose(left + A @ more, wanted, atol=1e-9)


def test_curvature_across_equations_alone_needs_to_be_positive() -> None:
    """What is negative along their normals does not matter."""
    for curvature in (-3.0, -6.0, -8.0, -12.0):
        steps, H, A = under_equations(curvature=curvature)
        Z = scipy.linalg.null_space(A)
        tangent = int(np.sum(np.linalg.eigvalsh(Z.T @ H @ Z) < 0))
        assert steps.negative_eigenvalues() == tangent
        assert (steps.factor(0.0) is not None) == (tangent == 0)


def bordered(
    corner: float, room: tuple[float, float], curvature: float = 0.0
) -> tuple[BorderedModel, Array, Array]:
    """A model under equations with one more unknown, its dense Hessian with that, and A."""
    inner, H, A = under_equations(curvature=curvature)
    column = np.random.default_rng(4).standard_normal(len(H))
    whole = np.block([[H, column[:, None]], [column, corner]])
    low, high = (np.array([bound]) for bound in room)
    border = Border(np.array([-1.5]), column[:, None], np.array([[corner]]), 3.0, (low, high))
    model = BorderedModel(inner, border)
    return model, whole, np.pad(A, ((0, 0), (0, 1)))


@pytest.mark.parametrize("room", [(-9.0, 9.0), (-1e-3, 1e-3)])
def test_newton_steps_with_one_more_unknown_solve_its_kkt_system(room: tuple[float, float]) -> None:
    model, H, A = bordered(50.0, room)
    assert isinstance(model.inner, EquationModel)
    residual = model.inner.residual
    factor = model.factor(0.0)
    step, slope, _ = model.descend(factor)
    assert room[0] <= step[-1] <= room[1]
    free = np.ones(len(H), dtype=bool)
    free[-1] = abs(step[-1]) < room[1]
    expected, held = step.copy(), step[~free]
    none = np.zeros((len(A), len(A)))
    kkt = np.block([[H[np.ix_(free, free)], A[:, free].T], [A[:, free], none]])
    force = model.gradient[free] + H[np.ix_(free, ~free)] @ held
    solved = np.linalg.solve(kkt, -np.append(force, residual + A[:, ~free] @ held))
    expected[free] = solved[: free.sum()]
    outward = (H[-1] @ expected + A[:, -1] @ solved[free.sum() :] + model.gradient[-1]) * step[-1]
    assert free[-1] == (room[1] > 1)
    assert free[-1] or outward < 0
    np.testing.assert_allclose(step, expected, atol=1e-7 * np.abs(expected).max())
    z, As = model.reaction(model.gradient, step, factor)
    decrease = -model.gradient @ step - 0.5 * step @ H @ step
    assert -0.5 * slope == pytest.approx(decrease, rel=1e-4)
    assert model.curvature(step) == pytest.approx(step @ H @ step, rel=1e-9)
    more = model.correction(factor, residual)
    assert more[-1] == 0.0
    np.testing.assert_allclose(A @ more, -residual, atol=1e-9)
    left = H[:-1] @ step + A[:, :-1].T @ z + model.gradient[:-1]
    np.testing.assert_allclose(left, 0.0, atol=1e-8 * np.abs(model.gradient).max())
    np.testing.assert_allclose(As, -residual, atol=1e-9)


def test_the_inertia_with_one_more_unknown_is_that_of_the_tangent_space() -> None:
    counts = set()
    for curvature in (0.0, -3.0, -6.0, -12.0):
        for corner in (-5.0, 0.02, 50.0):
            model, H, A = bordered(corner, (-9.0, 9.0), curvature)
            Z = scipy.linalg.null_space(A)
            negative = int(np.sum(np.linalg.eigvalsh(Z.T @ H @ Z) < 0))
            assert model.negative_eigenvalues() == negative
            assert (model.factor(0.0) is None) == (negative > 0)
            counts.add(negative)
    assert len(counts) > 3
