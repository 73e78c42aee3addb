"""The chain rule of charts: finite differences, exact values at the ends, reproducible bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.interval_charts import IntervalCharts
from hovi.robot.space.chart import Chart
from hovi.robot.space.compiled_charts import CompiledCharts, local_rates, rates
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.schemes import Scheme, by_name
from oracles.finite_differences import derivative

Array = npt.NDArray[np.float64]

STEPS = np.array([0.7, 0.4, 0.9])
SPACES = [
    ConfigurationSpace(parts)
    for parts in (("SE(2)",), ("SO(3)",), ("SE(3)",), (1, "SE(3)", "SO(2)", 8, "SO(3)"))
]
SIZES = [1e-9, 1.0, 3.0]
GALERKIN = by_name("galerkin-1")
AT_END = Scheme("end", 0, np.ones(1), np.ones(1), np.array([[[1.0, 1, 0], [1, 0, 1], [0, 0, 0]]]))
"""A table whose only point is the end node, with x'' = 0."""
each_space = pytest.mark.parametrize("space", SPACES, ids=lambda space: str(space.parts))
each_size = pytest.mark.parametrize("size", SIZES)


@dataclass(frozen=True)
class Intervals:
    """Three intervals by their nodal columns: q0, q1 (B, nq) and h v0, h v1, c, (B, n) each."""

    space: ConfigurationSpace
    scheme: Scheme
    q0: Array
    q1: Array
    rest: Array

    def moved(self, step: Array) -> Intervals:
        """The intervals after a step of (q0, h v0, q1, h v1, c), (B, m, n)."""
        q0, q1 = (self.space.integrate(q, step[:, i]) for q, i in ((self.q0, 0), (self.q1, 2)))
        rest = self.rest + step[:, [1, 3, *range(4, step.shape[1])]]
        return Intervals(self.space, self.scheme, q0, q1, rest)

    @property
    def charts(self) -> IntervalCharts:
        x1, v0 = self.space.difference(self.q0, self.q1), self.rest[:, 0]
        dx1 = Chart(self.space).rates(x1, self.rest[:, 1])[0]
        columns = np.concatenate(
            [np.stack([v0, x1 - v0, dx1 - v0], axis=1), self.rest[:, 2:]], axis=1
        )
        powers = STEPS[:, None, None] ** -np.arange(3.0)[:, None, None, None]
        x = powers * np.einsum("qri,bin->rbqn", self.scheme.table, columns)
        ends = np.stack([x1, dx1], axis=1)
        rows = x.reshape(3, -1, self.space.nv)
        return IntervalCharts(Chart(self.space), self.scheme, STEPS, rows, ends)

    @property
    def jets(self) -> tuple[Array, Array, Array]:
        """(q, v, a) at the points, (B Q, n) each."""
        return Chart(self.space).jets_from(self.q0, self.charts.x)


def random_intervals(space: ConfigurationSpace, size: float, scheme: Scheme) -> Intervals:
    """Intervals in which every orientation rotates by `size`."""
    random = np.random.default_rng(space.nv)
    d = random.normal(size=(len(STEPS), space.nv))
    for factor in space.curved:
        turn = [factor.v.start + i for i in factor.group.angular]
        d[:, turn] *= size / np.linalg.norm(d[:, turn], axis=1, keepdims=True)
    q0 = space.normalized(random.normal(size=(len(STEPS), space.nq)))
    rest = random.normal(size=(len(STEPS), 2 + scheme.inner_modes, space.nv))
    return Intervals(space, scheme, q0, space.integrate(q0, d), rest)


def random_terms(space: ConfigurationSpace, scheme: Scheme) -> tuple[Array, Array]:
    """A gradient (P, 3 n) and a symmetric Hessian (P, 3 n, 3 n) at the points."""
    random = np.random.default_rng(7)
    P, n = len(STEPS) * len(scheme.weights), space.nv
    H = random.normal(size=(P, 3 * n, 3 * n))
    return random.normal(size=(P, 3 * n)), H + H.transpose(0, 2, 1)


def random_jacobian(space: ConfigurationSpace) -> tuple[Array, Array]:
    """Four test functions (K, Q), and the Jacobian (P, p, 3 n) of two outputs at the points."""
    random = np.random.default_rng(8)
    Q = len(GALERKIN.weights)
    return random.normal(size=(4, Q)), random.normal(size=(len(STEPS) * Q, 2, 3 * space.nv))


def actions(there: Intervals, here: Intervals, g: Array, H: Array) -> Array:
    """h sum w L with L = g . d + d^T H d / 2 and d the jet's difference from that here, (B,)."""
    (q, v, a), (r, w, b) = there.jets, here.jets
    d = np.concatenate([here.space.difference(r, q), v - w, a - b], axis=1)
    L = np.sum(g * d, axis=1) + 0.5 * np.einsum("pij,pi,pj->p", H, d, d)
    return STEPS * (L.reshape(len(STEPS), -1) @ here.scheme.weights)


@each_size
@each_space
def test_gradient_and_hessian_match_finite_differences(
    space: ConfigurationSpace, size: float
) -> None:
    here = random_intervals(space, size, GALERKIN)
    terms = random_terms(space, GALERKIN)
    gradient, hessian = here.charts.expand(*terms)
    random = np.random.default_rng(5)
    for _ in range(12):
        d = random.normal(size=gradient.shape)
        d /= np.linalg.norm(d, axis=(1, 2), keepdims=True)

        def along(x: Array, d: Array = d) -> Array:
            return actions(here.moved(x[0] * d), here, *terms)

        first = derivative(along, np.zeros(1), 1e-3)[:, 0]
        second = derivative(lambda x, f=along: derivative(f, x, 2e-3), np.zeros(1), 2e-3)[:, 0, 0]
        np.testing.assert_allclose(
            np.einsum("bia,bia->b", gradient, d), first, rtol=0, atol=1e-9 * np.abs(gradient).max()
        )
        np.testing.assert_allclose(
            np.einsum("bijxy,bix,bjy->b", hessian, d, d),
            second,
            rtol=0,
            atol=1e-7 * np.abs(hessian).max(),
        )


@each_size
@each_space
def test_the_end_of_an_interval_is_its_node(space: ConfigurationSpace, size: float) -> None:
    n = space.nv
    g, H = random_terms(space, AT_END)
    # x'' = 0 is none of the nodal columns, so that nothing is known of the acceleration
    g[:, 2 * n :], H[:, 2 * n :], H[:, :, 2 * n :] = 0.0, 0.0, 0.0
    gradient, hessian = random_intervals(space, size, AT_END).charts.expand(g, H)
    h = STEPS[:, None, None]
    powers = h ** -np.arange(2.0)[:, None]
    expected = np.zeros_like(gradient)
    expected[:, 2:] = h * powers * g.reshape(-1, 3, n)[:, :2]
    np.testing.assert_allclose(gradient, expected, atol=1e-12)
    blocks = H.reshape(-1, 3, n, 3, n).transpose(0, 1, 3, 2, 4)[:, :2, :2]
    whole = np.zeros_like(hessian)
    scale = h[..., None, None] * powers[:, :, None, :, None] * powers[:, None, :, :, None]
    whole[:, 2:, 2:] = scale * blocks
    np.testing.assert_allclose(hessian, whole, rtol=0, atol=1e-12 * np.abs(whole).max())


@each_space
def test_the_hessian_is_symmetric(space: ConfigurationSpace) -> None:
    _, H = random_intervals(space, 1.0, GALERKIN).charts.expand(*random_terms(space, GALERKIN))
    np.testing.assert_allclose(H, H.transpose(0, 2, 1, 4, 3), rtol=0, atol=1e-13 * np.abs(H).max())


@each_size
@each_space
def test_gradients_are_pulled_back_as_steps_are_pushed_forward(
    space: ConfigurationSpace, size: float
) -> None:
    charts = random_intervals(space, size, GALERKIN).charts
    g, H = random_terms(space, GALERKIN)
    gradient, points = charts.expand(g, H)[0], g.reshape(-1, 3, space.nv)
    np.testing.assert_array_equal(charts.nodal_gradient(points), gradient)
    np.testing.assert_allclose(charts.end_gradient(points), gradient[:, :4], atol=1e-12)
    step = np.random.default_rng(3).normal(size=gradient.shape)
    change = charts.point_steps(step)
    weights = STEPS[:, None] * GALERKIN.weights
    pushed = np.einsum("bq,bqrn,bqrn->b", weights, g.reshape(change.shape), change)
    np.testing.assert_allclose(np.einsum("bia,bia->b", gradient, step), pushed, rtol=1e-12)


@each_size
@each_space
def test_moments_of_outputs_are_gradients_of_weighted_sums(
    space: ConfigurationSpace, size: float
) -> None:
    charts = random_intervals(space, size, GALERKIN).charts
    tests, J = random_jacobian(space)
    moments = charts.nodal_moments(tests, J)
    for k, test in enumerate(tests):
        for i in range(J.shape[1]):
            gradient = charts.nodal_gradient(np.tile(test, len(STEPS))[:, None] * J[:, i])
            np.testing.assert_allclose(
                moments[:, k, i], gradient, rtol=0, atol=1e-13 * np.abs(gradient).max()
            )


@each_space
def test_an_interval_has_the_same_bytes_in_every_batch(space: ConfigurationSpace) -> None:
    charts = random_intervals(space, 1.0, GALERKIN).charts
    g, H = random_terms(space, GALERKIN)
    Q = len(GALERKIN.weights)
    together = charts.expand(g, H)
    for k in range(len(STEPS)):
        own, points = slice(k, k + 1), slice(k * Q, k * Q + Q)
        parts = charts.h[own], charts.x[:, points].copy(), charts.ends[own]
        alone = IntervalCharts(charts.chart, GALERKIN, *parts).expand(g[points], H[points])
        for one, other in zip(together, alone, strict=True):
            np.testing.assert_array_equal(one[k], other[0])


def expanded(charts: CompiledCharts, g: Array, H: Array) -> tuple[Array, ...]:
    return charts.expand(g, H)


def pulled(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    return (charts.pull_gradient(g, False),)


def pulled_regularly(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    return (charts.pull_gradient(g, True),)


def pushed(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    B, m, n = len(charts.h), charts.table.shape[2], charts.x.shape[2]
    return (charts.push_steps(np.random.default_rng(3).normal(size=(B, m, n))),)


def moments_pulled(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    random, Q = np.random.default_rng(8), len(charts.weights)
    J = random.normal(size=(len(g), 2, g.shape[1]))
    return (charts.pull_moments(random.normal(size=(4, Q)), J),)


def rated(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    carried = np.random.default_rng(4).normal(size=charts.x[:2].shape)
    layout, portable = charts.layout, charts.portable
    alone = rates(layout, charts.x, portable=portable)
    return *alone, *rates(layout, charts.x, carried, portable=portable)


def rated_locally(charts: CompiledCharts, g: Array, _: Array) -> tuple[Array, ...]:
    return local_rates(charts.layout, *charts.x, portable=charts.portable)


DOORS = [expanded, pulled, pulled_regularly, moments_pulled, pushed, rated, rated_locally]


@pytest.mark.parametrize("door", DOORS)
@each_space
def test_all_kernels_agree(
    space: ConfigurationSpace, door: Callable[..., tuple[Array, ...]]
) -> None:
    charts, terms = random_intervals(space, 1.0, GALERKIN).charts, random_terms(space, GALERKIN)
    table = GALERKIN.regular_table if door is pulled_regularly else GALERKIN.nodal_table
    fast, slow = (door(charts.compiled(table, portable), *terms) for portable in (False, True))
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * np.abs(other).max())
