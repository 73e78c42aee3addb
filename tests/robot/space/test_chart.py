"""Charts against Pinocchio's Jacobians, finite differences and known curves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.groups import GROUPS
from samples.group_models import model_of

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


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.5, 3.0, 5.0])
@pytest.mark.parametrize("name", CURVED)
def test_jacobians_match_pinocchio(name: str, size: float) -> None:
    space = ConfigurationSpace((name,))
    model, x = model_of(GROUPS[name]), vectors(space, size)
    expected = np.array([pin.dIntegrate(model, pin.neutral(model), y)[1] for y in x])
    tolerance = 1e-12 if name == "SE(2)" else 1e-14
    for i, e in enumerate(np.eye(space.nv)):
        dx = np.tile(e, (POINTS, 1))
        _, v, a = Chart(space).jet(bases(space), x, 0 * dx, dx)
        np.testing.assert_allclose(a, expected[:, :, i], rtol=0, atol=tolerance)
        np.testing.assert_array_equal(v, 0 * dx)


@pytest.mark.parametrize("size", [1.0, 5.0, 6.2])
@pytest.mark.parametrize("name", CURVED)
def test_jacobians_match_their_series_up_to_a_full_turn(name: str, size: float) -> None:
    """J = sum_k (-ad)^k / (k + 1)! in extended precision: Pinocchio loses digits towards 2 pi."""
    space = ConfigurationSpace((name,))
    places, x = list(GROUPS[name].se3_indices), vectors(space, size)
    twists = np.zeros((POINTS, 6), dtype=np.longdouble)
    twists[:, places] = x
    for e in np.eye(space.nv):
        dx = np.tile(e, (POINTS, 1))
        _, _, a = Chart(space).jet(bases(space), x, 0 * dx, dx)
        for twist, found in zip(twists, a, strict=True):
            term = np.zeros(6, dtype=np.longdouble)
            term[places] = e
            total = term.copy()
            for k in range(60):
                linear = np.cross(twist[3:], term[:3]) + np.cross(twist[:3], term[3:])
                term = -np.append(linear, np.cross(twist[3:], term[3:])) / (k + 2)
                total += term
            np.testing.assert_allclose(found, total[places].astype(float), rtol=0, atol=2e-14)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", CURVED)
def test_velocity_and_acceleration_are_derivatives_of_the_curve(name: str, size: float) -> None:
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


def test_a_composed_curve_has_the_rates_of_the_product() -> None:
    space = ConfigurationSpace(MIXED)
    chart, h = Chart(space), 1e-4
    first = [vectors(space, 0.7, seed) for seed in range(3)]
    second = [vectors(space, 0.9, seed) for seed in range(3, 6)]

    def at(t: float) -> tuple[Array, Array, Array]:
        moved = [
            (x + t * dx + t * t / 2 * ddx, dx + t * ddx, ddx) for x, dx, ddx in (first, second)
        ]
        return chart.composed(chart.jet(bases(space), *moved[0]), *moved[1])

    (q, v, a), there, back = at(0.0), at(h), at(-h)
    rate = (space.difference(q, there[0]) - space.difference(q, back[0])) / (2 * h)
    np.testing.assert_allclose(v, rate, atol=1e-6)
    np.testing.assert_allclose(a, (there[1] - back[1]) / (2 * h), atol=1e-6)
