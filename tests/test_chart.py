"""Charts: Pinocchio's Jacobians, finite differences, curves that are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.chart import Bend, Chart
from hovi.chart_functions import chart_functions
from hovi.configuration_space import ConfigurationSpace
from hovi.lie_groups import GROUPS
from test_lie_groups import model_of

Array = npt.NDArray[np.float64]

POINTS = 4
CURVED = ["SE(2)", "SO(3)", "SE(3)"]
MIXED = (2, "SE(3)", "SO(2)", 1, "SO(3)")
SIZES = [0.0, 1e-9, 1.0, 3.0]


def vectors(space: ConfigurationSpace, size: float, seed: int = 0) -> Array:
    """Tangent vectors whose rotations have the given size."""
    x = np.random.default_rng(seed).normal(size=(POINTS, space.nv))
    for factor in space.curved:
        turn = [factor.v.start + i for i in factor.group.angular]
        x[:, turn] *= size / np.linalg.norm(x[:, turn], axis=1, keepdims=True)
    return x


def bases(space: ConfigurationSpace) -> Array:
    return space.normalized(np.random.default_rng(9).normal(size=(POINTS, space.nq)))


def along(f: Callable[[Array], Array], direction: Array) -> tuple[Array, Array]:
    """First and second derivative at zero of f: (size,) -> (P, r), by central differences."""
    h = 5e-4
    back, here, there = f(-h * direction), f(0 * direction), f(h * direction)
    far, farther = f(-2 * h * direction), f(2 * h * direction)
    first = (8 * (there - back) - (farther - far)) / (12 * h)
    return first, (16 * (there + back) - (farther + far) - 30 * here) / (12 * h * h)


def assert_bends(bend: Bend, f: Callable[[Array], Array], weight: Array) -> None:
    """First and second derivatives of f agree with those of finite differences."""
    random = np.random.default_rng(11)
    for _ in range(12):
        d = random.normal(size=bend.first.shape[2])
        first, second = along(f, d / np.linalg.norm(d))
        d /= np.linalg.norm(d)
        np.testing.assert_allclose(bend.first @ d, first, atol=1e-9)
        expected = np.einsum("pi,pi->p", weight.reshape(POINTS, -1), second)
        np.testing.assert_allclose(bend.second @ d @ d, expected, atol=3e-7)


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.5, 3.0])
@pytest.mark.parametrize("name", CURVED)
def test_jacobians_are_those_of_pinocchio(name: str, size: float) -> None:
    space = ConfigurationSpace((name,))
    model, x = model_of(GROUPS[name]), vectors(space, size)
    J = chart_functions(GROUPS[name]).jacobians(x, x, x)[0]
    expected = [pin.dIntegrate(model, pin.neutral(model), y)[1] for y in x]
    np.testing.assert_allclose(J, expected, rtol=0, atol=1e-12 if name == "SE(2)" else 1e-14)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", CURVED)
def test_velocity_and_acceleration_are_rates_of_the_curve(name: str, size: float) -> None:
    space = ConfigurationSpace((name,))
    chart = Chart(space)
    x, dx, ddx = vectors(space, size), vectors(space, 1.0, 1), vectors(space, 1.0, 2)
    q, v, a = chart.jet(bases(space), x, dx, ddx)
    h = 1e-4

    def at(t: float) -> tuple[Array, Array, Array]:
        return chart.jet(bases(space), x + t * dx + t * t / 2 * ddx, dx + t * ddx, ddx)

    there, back = at(h), at(-h)
    rate = (space.difference(q, there[0]) - space.difference(q, back[0])) / (2 * h)
    np.testing.assert_allclose(v, rate, atol=1e-6)
    np.testing.assert_allclose(a, (there[1] - back[1]) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(chart.rates(x, v, a), (dx, ddx), atol=1e-12)


def test_a_curve_carried_by_another_has_the_rates_of_their_product() -> None:
    space = ConfigurationSpace(MIXED)
    chart, h = Chart(space), 1e-4
    first = [vectors(space, 0.7, seed) for seed in range(3)]
    second = [vectors(space, 0.9, seed) for seed in range(3, 6)]

    def at(t: float) -> tuple[Array, Array, Array]:
        moved = [
            (x + t * dx + t * t / 2 * ddx, dx + t * ddx, ddx) for x, dx, ddx in (first, second)
        ]
        return chart.carried(chart.jet(bases(space), *moved[0]), *moved[1])

    (q, v, a), there, back = at(0.0), at(h), at(-h)
    rate = (space.difference(q, there[0]) - space.difference(q, back[0])) / (2 * h)
    np.testing.assert_allclose(v, rate, atol=1e-6)
    np.testing.assert_allclose(a, (there[1] - back[1]) / (2 * h), atol=1e-6)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", CURVED)
def test_points_bend_as_finite_differences_say(name: str, size: float) -> None:
    space = ConfigurationSpace((name,))
    chart, k, q0 = Chart(space), space.nv, bases(ConfigurationSpace((name,)))
    x, dx, ddx = vectors(space, size), vectors(space, 1.0, 1), vectors(space, 1.0, 2)
    weight = np.random.default_rng(5).normal(size=(POINTS, 3, k))
    q = chart.jet(q0, x, dx, ddx)[0]

    def moved(d: Array) -> Array:
        start = space.integrate(q0, d[:k])
        q1, v, a = chart.jet(start, x + d[k : 2 * k], dx + d[2 * k : 3 * k], ddx + d[3 * k :])
        return np.concatenate([space.difference(q, q1), v, a], axis=1)

    (bend,) = chart.points(x, dx, ddx, weight)
    assert_bends(bend, moved, weight)
    np.testing.assert_allclose(bend.second, bend.second.transpose(0, 2, 1), atol=1e-13)
    ((_, linear),) = chart.linear_points(x, dx, ddx)
    np.testing.assert_array_equal(linear, bend.first)


@pytest.mark.parametrize("size", [1e-9, 1.0, 2.5])
@pytest.mark.parametrize("name", CURVED)
def test_ends_bend_as_finite_differences_say(name: str, size: float) -> None:
    space = ConfigurationSpace((name,))
    chart, k, q0 = Chart(space), space.nv, bases(ConfigurationSpace((name,)))
    q1, v1 = space.integrate(q0, vectors(space, size)), vectors(space, 1.0, 1)
    weight = np.random.default_rng(5).normal(size=(POINTS, 2, k))

    def ends(d: Array) -> Array:
        x1 = space.difference(space.integrate(q0, d[:k]), space.integrate(q1, d[k : 2 * k]))
        return np.concatenate([x1, chart.rates(x1, v1 + d[2 * k :])[0]], axis=1)

    x1, dx1 = np.split(ends(np.zeros(3 * k)), 2, axis=1)
    (bend,) = chart.ends(x1, dx1, weight)
    assert_bends(bend, ends, weight)
