"""Travels within limits on v and a, against the integral of the fastest velocity at each time."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.planning.problem.limits import Limits
from hovi.planning.problem.presolve.least_time import Pace, fastest

INF = np.inf
PACES = [(2.0, 5.0), (2.0, INF), (INF, 5.0), (0.3, 40.0), (30.0, 0.7)]


def integrated(speed: float, acceleration: float, time: float, rests: int) -> float:
    """The integral of min(v, a t, a (T - t)), the ramps only at ends at rest."""
    t = np.linspace(0.0, time, 200_001)
    fastest = np.full_like(t, speed)
    if np.isfinite(acceleration):
        for ramp in (acceleration * t, acceleration * (time - t))[:rests]:
            fastest = np.minimum(fastest, ramp)
    return float(np.trapezoid(fastest, t))


@pytest.mark.parametrize("rests", [0, 1, 2])
@pytest.mark.parametrize("time", [0.05, 0.6, 4.0])
def test_the_farthest_travel_is_the_integral_of_the_fastest_velocity(
    time: float, rests: int
) -> None:
    speed, acceleration = np.array(PACES).T
    pace = Pace(speed, 2 * speed, acceleration)
    down, up = pace.travel(time, np.full(len(PACES), rests))
    for i, (v, a) in enumerate(PACES):
        if np.isinf(v) and rests == 0:
            assert np.isinf([down[i], up[i]]).all()
            continue
        assert down[i] == pytest.approx(integrated(v, a, time, rests), rel=1e-8)
        assert up[i] == pytest.approx(integrated(2 * v, a, time, rests), rel=1e-8)


@pytest.mark.parametrize("rests", [0, 1, 2])
def test_the_least_time_is_that_in_which_the_travel_is_just_possible(rests: int) -> None:
    random = np.random.default_rng(3)
    speed, acceleration = random.uniform(0.1, 5.0, (2, 50))
    pace, counts = Pace(speed, 3 * speed, acceleration), np.full(50, rests)
    distance = random.uniform(-4.0, 4.0, 50)
    for i, time in enumerate(pace.least_time(distance, counts)):
        down, up = pace.travel(float(time), counts)
        assert (up if distance[i] > 0 else down)[i] == pytest.approx(abs(distance[i]))


def test_unlimited_joints_take_no_time_and_others_their_tolerance() -> None:
    lower, upper = np.full((4, 2), -INF), np.full((4, 2), INF)
    upper[1, 0], lower[1, 0] = 2.0, -1.0
    pace = Pace.of(Limits(lower, upper, 0.01))
    assert pace.least_time(np.array([3.0, 7.0]), np.array([2, 2])) == pytest.approx([3 / 2.03, 0])
    assert pace.least_time(np.array([-3.0, 0.0]), np.array([2, 2])) == pytest.approx([3 / 1.03, 0])


@pytest.mark.parametrize("seed", range(20))
def test_the_fastest_travel_between_velocities_has_its_distance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    V, A = rng.uniform(0.3, 3.0, 2)
    u, w = rng.uniform(-V, V, 2)
    d = rng.uniform(-4.0, 4.0)
    time, peak = fastest(d, (u, w), (V, V), A)
    t, sign = np.linspace(0.0, time, 200_001), np.sign(peak)
    velocity = np.minimum(sign * u + A * t, sign * w + A * (time - t))
    assert np.trapezoid(np.minimum(velocity, V), t) == pytest.approx(sign * d, abs=1e-7)
    assert velocity.max() >= abs(peak) * (1 - 1e-4)
    assert fastest(-d, (-u, -w), (V, V), A) == pytest.approx((time, -peak))


def test_the_fastest_travel_between_ends_at_rest_takes_the_least_time() -> None:
    speed, acceleration = np.array(PACES).T
    least = Pace(speed, speed, acceleration).least_time(np.full(len(PACES), 0.9), np.array(2))
    for i, (v, a) in enumerate(PACES):
        assert fastest(0.9, (0.0, 0.0), (v, v), a)[0] == pytest.approx(least[i])
        assert fastest(-0.9, (np.nan, np.nan), (v, v), a)[0] == pytest.approx(0.9 / v)
