"""What a motion past an obstacle costs: as much as the calculus of variations says."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from samples.small_robots import arm

RADIUS, MASS = 0.08, 0.5
"""Of the ball that slides along y, in [m] and [kg]."""
SPEED, DURATION, MARGIN = 2.0, 1.0, 0.02
"""It starts towards the wall, and ends where it started, away from it: in [m/s], [s] and [m]."""
GRID = {"scheme": "galerkin-2x8", "intervals": 16, "self_collision": False}


def sliding(farthest: float | None, limits: object = "none") -> hovi.Solution:
    """farthest: where a wall leaves the ball, in [m]; None for no wall."""
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    ends = hovi.State([0.0], [SPEED]), hovi.State([0.0], [-SPEED])
    walls = []
    if farthest is not None:
        walls = [hovi.HalfSpace([0.0, -1.0, 0.0], [0.0, farthest + RADIUS + MARGIN, 0.0])]
    found = hovi.plan(scene, *ends, DURATION, obstacles=walls, margin=MARGIN, limits=limits, **GRID)
    assert found.success, found.message
    return found


def cost_of_cubic(way: float, T: float) -> float:
    """1/2 integral (m a)^2 of the cubic over a way from SPEED to rest in T."""
    square = 4 * SPEED**2 / T - 12 * SPEED * way / T**2 + 12 * way**2 / T**3
    return 0.5 * MASS**2 * square


@pytest.mark.parametrize("farthest", [0.36, 0.4, 0.45])
def test_a_wall_is_touched_between_two_cubics(farthest: float) -> None:
    """Without it the ball would get 0.5 m far."""
    found = sliding(farthest)
    exact = 2 * cost_of_cubic(farthest, DURATION / 2)
    assert found.cost == pytest.approx(exact, rel=1e-3)
    q = found.trajectory.sample(np.linspace(0.0, DURATION, 5_001)).q[:, 0]
    assert farthest - 1e-3 < q.max() < farthest + 1e-6
    assert abs(q.argmax() - 2_500) < 100


@pytest.mark.parametrize("farthest", [0.2, 0.3, 0.4])
def test_a_wall_is_a_limit_of_the_joint(farthest: float) -> None:
    """Nearer than a third of the way at the first speed it is followed for a while."""
    wall = sliding(farthest)
    bound = sliding(None, {"base": "none", "q": [[-9.0, farthest]]})
    assert wall.cost == pytest.approx(bound.cost, rel=2e-3)
    t = np.linspace(0.0, DURATION, 101)
    np.testing.assert_allclose(wall.trajectory.sample(t).q, bound.trajectory.sample(t).q, atol=2e-3)


@pytest.mark.parametrize("beyond", [0.05, 0.15, 0.28, 0.35, 2.0])
def test_a_wall_that_is_not_touched_costs_nothing(beyond: float) -> None:
    """However near it is; distances of more than 0.3 m beyond the margin are not even looked at."""
    free, found = sliding(None), sliding(0.5 + beyond)
    exact = 2 * cost_of_cubic(0.5, DURATION / 2)
    assert free.cost == pytest.approx(exact, rel=1e-9)
    assert found.cost == pytest.approx(exact, rel=1e-6)
