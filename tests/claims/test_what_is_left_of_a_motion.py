"""Without time for a solve, `advance` returns the rest of its motion: the same curve and nodes."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.schemes import by_name, galerkin
from samples.manifold_robots import BASES, chain, configurations, with_arm

Array = npt.NDArray[np.float64]

STEPS = np.array([0.3, 0.2, 0.1, 0.4])
GRID = hovi.Grid(STEPS, (galerkin(3), by_name("hermite-simpson"), galerkin(1), galerkin(4)))
NEARLY_OVER = 0.3 - 0.005
"""A time at which 5 ms of the first interval are left, next to one of 200 ms."""


@cache
def motion(base: str) -> hovi.Solution:
    """A reach of two links, or of a base with joints, by a minimum of the discrete action."""
    if base == "two_link":
        robot = hovi.load_robot(hovi.example("two_link.urdf"))
    elif base == "continuous":
        robot = hovi.load_robot(chain([BASES[base]()] * 2))
    else:
        robot = hovi.load_robot(with_arm(base))
    q = configurations(robot, 2, seed=1, size=0.4)
    v = 0.3 * np.random.default_rng(2).normal(size=(2, robot.nv))
    L = hovi.Scene(robot, []).effort_lagrangian()
    return solved(L, GRID, hovi.State(q[0], v[0]), hovi.State(q[1], v[1]))


def solved(L: object, grid: hovi.Grid, *ends: hovi.State) -> hovi.Solution:
    found = hovi.solve(hovi.TrajectoryProblem(hovi.DiscreteLagrangian(L, grid), *ends))
    assert found.n_neg == 0
    return found


def rest(found: hovi.Solution, time: float) -> hovi.Trajectory:
    left = found.advance(time, time_limit=1e-9)
    assert left.status == "time_limit"
    assert "this is the last motion" in left.message
    return left.trajectory


@pytest.mark.parametrize("time", [0.0, 0.07, 0.31, 0.55, 0.95])
@pytest.mark.parametrize("base", ["two_link", "continuous"])
def test_the_rest_is_the_same_curve(base: str, time: float) -> None:
    whole = motion(base).trajectory
    left, t = rest(motion(base), time), np.linspace(0.0, 1.0 - time, 200)
    assert left.duration == pytest.approx(1.0 - time, rel=1e-14)
    assert left.grid.intervals == 5 - np.searchsorted(GRID.t, time, side="right")
    here, there = left.jet(np.minimum(t, left.duration)), whole.jet(np.minimum(time + t, 1.0))
    inner = np.append(left.t[1:-1], 9.0)
    inside = np.abs(t[:, None] - inner).min(axis=1) > 1e-9
    for x, y, tolerance in zip(here, there, (1e-13, 1e-12, 1e-10), strict=True):
        scale = max(1.0, np.abs(y).max())
        np.testing.assert_allclose(x[inside], y[inside], rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("base", ["spherical", "free-flyer"])
def test_on_groups_nodes_are_kept_and_the_rest_follows_closely(base: str) -> None:
    whole, left = motion(base).trajectory, rest(motion(base), 0.07)
    for name in ("q", "v"):
        np.testing.assert_array_equal(getattr(left, name)[1:], getattr(whole, name)[1:])
    begun = whole.jet(np.array([0.07]))
    np.testing.assert_allclose(left.q[0], begun[0][0], atol=1e-13)
    np.testing.assert_allclose(left.v[0], begun[1][0], atol=1e-13)
    t = np.linspace(0.0, left.grid.steps[0], 20)
    assert whole.robot is not None
    gap = whole.robot.difference(left.configurations(t), whole.configurations(0.07 + t))
    assert np.abs(gap).max() < 1e-4


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_it_starts_with_all_derivatives_that_its_order_has(order: int) -> None:
    start = hovi.State(
        [0.0, 1.0],
        [0.5, 0.0] if order > 1 else None,
        a=[1.0, -2.0] if order > 2 else None,
        jerk=[0.5, 0.1] if order > 3 else None,
    )
    grid = hovi.Grid(STEPS, (galerkin(2, order),) * 4)
    found = solved(hovi.spline(2, order), grid, start, hovi.State([1.0, 0.0]))
    here = rest(found, 0.35).jet(np.linspace(0.0, 0.1, 20), order)
    whole = found.trajectory.jet(np.linspace(0.35, 0.45, 20), order)
    for x, y in zip(here, whole, strict=True):
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-9 * max(1.0, np.abs(y).max()))
    goes_on = found.advance(0.35)
    assert goes_on.problem is not None
    for key, y in zip(("q", "v", "a", "jerk")[:order], whole, strict=False):
        np.testing.assert_allclose(getattr(goes_on.problem.start, key), y[0], atol=1e-9)


@pytest.mark.parametrize("kind", ["cubic", "two_link", "continuous"])
def test_an_interval_that_is_nearly_over_becomes_one_with_the_next(kind: str) -> None:
    """One cubic over both is found again; other curves keep both ends."""
    ends = hovi.State([0.0, 1.0], [0.5, 0.0]), hovi.State([1.0, 0.0])
    found = solved(hovi.spline(2), GRID, *ends) if kind == "cubic" else motion(kind)
    left, whole = rest(found, NEARLY_OVER), found.trajectory
    assert left.grid.steps[0] == pytest.approx(0.5 - NEARLY_OVER)
    assert left.grid.schemes == GRID.schemes[1:]
    t = np.linspace(0.0, 0.5 - NEARLY_OVER, 50)
    np.testing.assert_allclose(left.q[0], whole.jet(np.array([NEARLY_OVER]))[0][0], atol=1e-14)
    np.testing.assert_array_equal(left.q[1:], whole.q[2:])
    tolerance = 1e-12 if kind == "cubic" else 1.0
    here, there = left.jet(t)[1], whole.jet(NEARLY_OVER + t)[1]
    np.testing.assert_allclose(here, there, rtol=0, atol=tolerance)


def test_nodes_of_via_points_stay_nodes() -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    ld = hovi.DiscreteLagrangian(hovi.Scene(robot, []).effort_lagrangian(), GRID)
    via = (hovi.Via(0.3, hovi.State([0.3, 0.2])),)
    ends = hovi.State([0.0, 0.0]), hovi.State([0.8, -0.5])
    found = hovi.solve(hovi.TrajectoryProblem(ld, *ends, via=via))
    assert rest(motion("two_link"), 0.2999).grid.intervals == 3
    assert rest(found, 0.2999).grid.intervals == 4
    assert rest(found, 0.9999).grid.intervals == 1
