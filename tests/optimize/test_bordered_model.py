"""A model with one more unknown agrees with the dense one: steps, definiteness and inertia."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import minimize

from hovi.optimize.banded_model import BandLayout, BandModel
from hovi.optimize.bordered_model import Border, BorderedModel
from hovi.optimize.trust_region import solve_subproblem
from samples.interval_problems import SIZES, random_problem

Array = npt.NDArray[np.float64]


def build(
    n: int, modes: tuple[int, ...], curvature: float, corner: float, count: int = 1, seed: int = 0
) -> tuple[BorderedModel, Array, Array]:
    """The model with a random border of some unknowns, and its dense Hessian and metric."""
    N = len(modes)
    problem = random_problem(n, modes, np.ones(N), curvature, seed)
    layout = BandLayout.of(problem.unknowns)
    band = layout.assemble(problem.nodal.metric[..., None, None] * np.eye(n))
    columns = np.random.default_rng(seed + 7).normal(size=(layout.size, count))
    corners = corner * np.eye(count) + 0.3 * (np.ones((count, count)) - np.eye(count))
    slope, room = np.linspace(-1.5, 2.0, count), np.full(count, np.inf)
    border = Border(slope, columns, corners, 3.0, (-room, room))
    hessian = np.block([[problem.hessian, columns], [columns.T, corners]])
    metric = 3.0 * np.eye(len(hessian))
    metric[: layout.size, : layout.size] = problem.metric
    return BorderedModel(BandModel(problem.nodal, layout, band), border), hessian, metric


def kept_within(model: BorderedModel, low: float, high: float) -> BorderedModel:
    ones = np.ones_like(model.border.slope)
    room = low * ones, high * ones
    return BorderedModel(model.inner, dataclasses.replace(model.border, room=room))


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("shift", [0.0, 0.7, 30.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_steps_equal_dense_solves(n: int, modes: tuple[int, ...], shift: float, count: int) -> None:
    model, hessian, metric = build(n, modes, 40.0, 50.0, count)
    factor = model.factor(shift)
    assert factor is not None
    expected = np.linalg.solve(hessian + shift * metric, -model.gradient)
    step, slope, length = model.descend(factor)
    np.testing.assert_allclose(step, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    assert slope == pytest.approx(model.gradient @ expected, rel=1e-11)
    assert length == pytest.approx(expected @ metric @ expected, rel=1e-11)
    rhs = np.random.default_rng(3).normal(size=len(expected))
    solved = np.linalg.solve(hessian + shift * metric, rhs)
    np.testing.assert_allclose(factor.solve(rhs), solved, rtol=0, atol=1e-11)


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("corner", [-5.0, 0.5, 50.0])
@pytest.mark.parametrize("curvature", [0.0, 4.0, 40.0])
@pytest.mark.parametrize(("n", "modes"), SIZES)
def test_definiteness_and_inertia_are_those_of_the_dense_matrix(
    n: int, modes: tuple[int, ...], curvature: float, corner: float, count: int
) -> None:
    model, hessian, metric = build(n, modes, curvature, corner, count)
    negative = int(np.sum(np.linalg.eigvalsh(hessian) < 0))
    assert model.negative_eigenvalues() == negative
    assert (model.factor(0.0) is None) == (negative > 0)
    inverse = np.linalg.inv(np.linalg.cholesky(metric))
    lowest = np.linalg.eigvalsh(inverse @ hessian @ inverse.T)[0]
    assert model.factor(1e-6 - lowest) is not None or lowest > 1e-6
    if lowest < 0:
        assert model.factor(-0.999 * lowest) is None


@pytest.mark.parametrize("room", [(-1e-3, 1e-3), (0.0, 1.0), (-1.0, 0.0), (-0.5, 0.01)])
@pytest.mark.parametrize("shift", [0.0, 5.0])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_within_its_room_the_step_is_the_least_value_of_the_model(
    room: tuple[float, float], shift: float, count: int
) -> None:
    whole, hessian, metric = build(2, (1,) * 5, 40.0, 8.0, count)
    model = kept_within(whole, *room)
    matrix = hessian + shift * metric
    factor = model.factor(shift)
    assert factor is not None
    step, slope, length = model.descend(factor)

    def value(s: Array) -> float:
        return float(model.gradient @ s + 0.5 * s @ matrix @ s)

    bounds = [(None, None)] * (len(step) - count) + [room] * count
    jac = lambda s: model.gradient + matrix @ s  # noqa: E731
    best = minimize(value, np.zeros(len(step)), jac=jac, bounds=bounds, tol=1e-14)
    assert np.all((room[0] <= step[-count:]) & (step[-count:] <= room[1]))
    assert value(step) == pytest.approx(best.fun, rel=1e-9)
    # the trust region's formula for the decrease of g.s + 1/2 s.H s
    decrease = -0.5 * slope + 0.5 * shift * length
    assert decrease == pytest.approx(-(value(step) - 0.5 * shift * length), rel=1e-10)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_its_bound_the_last_unknown_needs_no_curvature(sign: float) -> None:
    """Where the value falls beyond the bound; from it, the model without bounds is indefinite."""
    concave, _, _ = build(2, (1,) * 5, 40.0, -50.0)
    slope = np.array([-100.0 * sign])
    border = dataclasses.replace(concave.border, slope=slope)
    for room, kept in (((-1.0, 0.0), sign > 0), ((0.0, 1.0), sign < 0), ((-1.0, 1.0), False)):
        steep = BorderedModel(concave.inner, border)
        model = kept_within(steep, *room)
        factor = model.factor(0.0)
        assert (factor is not None) == kept
        if factor is not None:
            step, _, _ = model.descend(factor)
            inner = concave.inner.factor(0.0)
            assert inner is not None
            assert step[-1] == 0.0
            np.testing.assert_allclose(step[:-1], inner.solve(-concave.inner.gradient), atol=1e-12)


def test_the_trust_region_leaves_along_a_concave_last_unknown() -> None:
    model, hessian, _ = build(2, (1,) * 5, 40.0, -50.0)
    trial = solve_subproblem(model, 1.0, 0.0)
    change = model.gradient @ trial.step + 0.5 * trial.step @ hessian @ trial.step
    assert -change == pytest.approx(trial.decrease, rel=1e-8)
    assert abs(trial.step[-1]) > 0.1
