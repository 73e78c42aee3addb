"""Motions at their limits against closed forms: cost, curve, limits at all times, multipliers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import root

import hovi
from hovi.discrete.state import State
from hovi.planning.problem.limits import as_limits
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

INERTIA = 1.0 + 1.6e-4
"""Of the pendulum: m l^2 and the bob's own 2/5 m r^2."""
SAMPLES = 20_001
X, W = np.polynomial.legendre.leggauss(400)


@dataclass(frozen=True)
class Optimum:
    """Least cost, and the state over time, of a motion of duration T within limits.

    cost: as a function of T. q: as a function of times. peak: the quantity that is limited, and
    its bound.
    """

    cost: Callable[[float], float]
    T: float
    peak: tuple[str, float]

    @cached_property
    def slope(self) -> float:
        h = 1e-4
        return (self.cost(self.T + h) - self.cost(self.T - h)) / (2 * h)


def saturated(k: int, most: float, T: float, distance: float = 1.0) -> float:
    """1/2 int u^2 for q^(k) = u, |u| <= most, from rest to rest: u is a clipped polynomial.

    Of degree k - 1, by Pontryagin; its coefficients from the moments of u against T - t.
    """
    t, w = (X + 1) * T / 2, W * T / 2
    s = 2 * t / T - 1
    basis = np.polynomial.legendre.legvander(s, k - 1)
    moments = np.array([(T - t) ** (k - 1 - i) for i in range(k)])
    wanted = np.zeros(k)
    wanted[0] = distance * np.prod(np.arange(1, k))

    def miss(c: Array) -> Array:
        u = np.clip(basis @ c, -most, most)
        return moments @ (w * u) / T ** np.arange(k, 0, -1) - wanted / T ** np.arange(k, 0, -1)

    free = np.linalg.solve(moments @ (w[:, None] * basis), wanted)
    found = root(miss, free, tol=1e-12)
    assert np.abs(miss(found.x)).max() < 1e-6
    u = np.clip(basis @ found.x, -most, most)
    return float(w @ u**2 / 2)


def cruising(most: float, T: float, distance: float = 1.0) -> float:
    """The speed rises as a parabola for 3 (b T - D) / (2 b), stays at its bound b, and falls."""
    rise = 3 * (most * T - distance) / (2 * most)
    return 4 * most**2 / (3 * rise)


def bounced(most: float, T: float) -> float:
    """Bryson and Denham: from q = 0 back to it, at the speed 1 and -1, with q <= l.

    For l <= T/6 it is held at l, for longer or shorter; up to T/4 it is touched once.
    """
    return 4 / (9 * most) if most <= T / 6 else (2 + 6 * (1 - 4 * most / T) ** 2) / T


def known(kind: str) -> Optimum:
    return {
        "v": Optimum(lambda T: cruising(1.2, T), 1.0, ("v", 1.2)),
        "a": Optimum(lambda T: saturated(2, 5.0, T), 1.0, ("a", 5.0)),
        "jerk": Optimum(lambda T: saturated(3, 40.0, T), 1.0, ("jerk", 40.0)),
        "tau": Optimum(lambda T: INERTIA**2 * saturated(2, 5.0, T), 1.0, ("tau", 5.0 * INERTIA)),
        "tau and a": Optimum(
            lambda T: INERTIA**2 * saturated(2, 5.0, T), 1.0, ("tau", 5.0 * INERTIA)
        ),
    }[kind]


def problem_of(kind: str, intervals: int = 40) -> hovi.TrajectoryProblem:
    """From 0 to 1 at rest. The pendulum has no gravity; two limits of it say the same."""
    optimum, order = known(kind), 3 if kind == "jerk" else 2
    grid = hovi.Grid.uniform(optimum.T, intervals, galerkin(2, order))
    bound = {optimum.peak[0]: optimum.peak[1]} | ({"a": 5.0} if kind == "tau and a" else {})
    if "tau" in kind:
        scene = hovi.Scene(hovi.load_robot(hovi.example("pendulum.urdf")))
        L, limits = scene.effort_lagrangian(), as_limits(scene.robot, {"base": "none", **bound})
    else:
        L = hovi.spline(1, order)
        limits = as_limits(L.coordinates, {"base": "none", **bound}, order)
    ld = hovi.DiscreteLagrangian(L, grid)
    return hovi.TrajectoryProblem(ld, State([0.0]), State([1.0]), limits)


def peak(motion: hovi.Trajectory, kind: str, order: int) -> float:
    N = motion.grid.intervals
    k, s = np.repeat(np.arange(N), SAMPLES // N), np.tile(np.linspace(0, 1, SAMPLES // N), N)
    if kind == "tau":
        return float(np.abs(motion.sample_intervals(k, s).tau).max())
    jet = motion.jet_intervals(k, s, order)
    return float(np.abs(jet[["q", "v", "a", "jerk"].index(kind)]).max())


def assert_known(found: hovi.Solution, kind: str, more: float) -> None:
    """Costs at most `more` of the optimum above it, and keeps its limit everywhere."""
    optimum = known(kind)
    assert found.success, found.message
    assert found.n_neg == 0
    assert 1 - 1e-6 < found.cost / optimum.cost(optimum.T) < 1 + more
    most = peak(found.trajectory, optimum.peak[0], 3 if kind == "jerk" else 2)
    assert 0.99 < most / optimum.peak[1] < 1 + 2e-6


KINDS = {"v": 11, "a": 9, "jerk": 12, "tau": 12, "tau and a": 11}
"""Most steps."""


@pytest.mark.parametrize("kind", KINDS)
def test_cost_and_limits_are_those_of_the_known_optimum(kind: str) -> None:
    found = hovi.solve(problem_of(kind))
    assert_known(found, kind, 2e-3)
    assert found.nit <= KINDS[kind]
    t = np.linspace(0.0, 1.0, 201)
    q = found.trajectory.sample(t).q[:, 0]
    np.testing.assert_allclose(q, 1 - q[::-1], rtol=0, atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_multipliers_say_what_time_is_worth(kind: str) -> None:
    """dJ/dT, of which limits take the largest part."""
    found, optimum = hovi.solve(problem_of(kind)), known(kind)
    assert found.duration_derivative == pytest.approx(optimum.slope, rel=1e-2)


@pytest.mark.parametrize("kind", ["v", "a", "tau"])
@pytest.mark.parametrize("size", [1.0, 10.0, 100.0])
def test_however_far_outside_the_guess_is_the_optimum_is_as_exact(kind: str, size: float) -> None:
    problem = problem_of(kind)

    def far(t: Array) -> tuple[Array, Array, Array]:
        s, T = t[:, None], problem.grid.duration
        q = s + size * np.sin(2 * np.pi * s / T) ** 2
        rate = size * 2 * np.pi / T * np.sin(4 * np.pi * s / T)
        return q, rate, size * 8 * np.pi**2 / T**2 * np.cos(4 * np.pi * s / T)

    near = hovi.solve(problem)
    found = hovi.solve(problem, problem.path(far))
    assert_known(found, kind, 2e-3)
    assert found.cost == pytest.approx(near.cost, rel=2e-5)


SWITCHED = {"v": 1.2, "a": 4.8 / 1.1, "tau": INERTIA * 4.8 / 1.1, "q": 1 / 12}
"""Bounds at which limits begin and cease to hold after a quarter and three quarters of T."""


@pytest.mark.parametrize("intervals", [4, 8])
@pytest.mark.parametrize("kind", SWITCHED)
def test_with_nodes_where_limits_begin_to_hold_the_optimum_is_exact(
    kind: str, intervals: int
) -> None:
    """It is a polynomial in every interval; what remains is the barrier, and distances of rows."""
    most, v = SWITCHED[kind], 1.0 if kind == "q" else 0.0
    start, goal = State([0.0], [v]), State([0.0 if kind == "q" else 1.0], [-v])
    robot = hovi.load_robot(hovi.example("pendulum.urdf"))
    L = hovi.Scene(robot).effort_lagrangian() if kind == "tau" else hovi.spline(1)
    bound = [[-1.0, most]] if kind == "q" else most
    on = robot if kind == "tau" else L.coordinates
    limits = as_limits(on, {"base": "none", kind: bound})
    ld = hovi.DiscreteLagrangian(L, hovi.Grid.uniform(1.0, intervals, galerkin(2)))
    found = hovi.solve(hovi.TrajectoryProblem(ld, start, goal, limits))
    exact = {
        "v": cruising(most, 1.0),
        "a": most**2 * (0.25 + 0.5 / 6),
        "tau": most**2 * (0.25 + 0.5 / 6),
        "q": bounced(most, 1.0),
    }[kind]
    assert found.success, found.message
    assert found.cost == pytest.approx(exact, rel=3e-5)
    assert found.cost > exact * (1 - 1e-7)


def bouncing(most: float, intervals: int) -> hovi.TrajectoryProblem:
    L = hovi.spline(1)
    ld = hovi.DiscreteLagrangian(L, hovi.Grid.uniform(1.0, intervals, galerkin(3)))
    limits = as_limits(L.coordinates, {"base": "none", "q": [[-1.0, most]]})
    return hovi.TrajectoryProblem(ld, State([0.0], [1.0]), State([0.0], [-1.0]), limits)


@pytest.mark.parametrize("most", [0.05, 0.1, 0.15])
@pytest.mark.parametrize("intervals", [10, 40])
def test_a_position_is_touched_where_bryson_and_denham_say(most: float, intervals: int) -> None:
    """It is reached after 3 l, stays, and is left 3 l before the end; the grid knows of neither."""
    found = hovi.solve(bouncing(most, intervals))
    assert found.usable, found.message
    assert found.cost == pytest.approx(bounced(most, 1.0), rel=3e-3 if intervals == 40 else 0.05)
    assert found.cost > bounced(most, 1.0) * (1 - 1e-6)
    q = found.trajectory.sample(np.linspace(0.0, 1.0, SAMPLES)).q[:, 0]
    assert most * (1 - 1e-3) < q.max() <= most + 2e-6
    t = np.linspace(0.0, 3 * most, 50)
    rising = most * (1 - (1 - t / (3 * most)) ** 3)
    held = found.trajectory.sample(t).q[:, 0]
    np.testing.assert_allclose(held, rising, rtol=0, atol=most * (5e-3 if intervals == 40 else 0.1))


@pytest.mark.parametrize("most", [0.1, 1 / 12, 0.2])
def test_a_longer_rest_at_a_position_is_free_and_a_later_touch_is_not(most: float) -> None:
    found, h = hovi.solve(bouncing(most, 40)), 1e-5
    slope = (bounced(most, 1.0 + h) - bounced(most, 1.0 - h)) / (2 * h)
    assert found.duration_derivative == pytest.approx(slope, abs=5e-3 * found.cost)


@pytest.mark.parametrize(("most", "first"), [(1 / 12, 2), (0.2, 4)])
def test_momenta_change_where_a_position_is_held_and_nowhere_else(most: float, first: int) -> None:
    """p is minus the jerk before the first of 8 nodes that is held, plus the jerk after the last.

    At these two nodes it jumps, and between them nothing moves.
    """
    motion = hovi.solve(bouncing(most, 8)).trajectory
    p, (*_, jerk) = motion.momenta[:, 0, 0], motion.jet([0.05], 3)
    expected = np.zeros(9)
    expected[:first], expected[9 - first :] = -jerk[0, 0], jerk[0, 0]
    rest = np.delete(np.arange(9), [first, 8 - first])
    size = np.abs(expected).max()
    np.testing.assert_allclose(p[rest], expected[rest], rtol=0, atol=2e-3 * size)


def test_a_speed_that_has_hardly_any_room_is_kept() -> None:
    """Of 1 +- 1e-3, and 1 on average: the motion is uniform and costs nothing."""
    L = hovi.spline(1)
    ld = hovi.DiscreteLagrangian(L, hovi.Grid.uniform(1.0, 8, galerkin(2)))
    limits = as_limits(L.coordinates, {"base": "none", "v": [[0.999, 1.001]]})
    ends = State([0.0], [1.0]), State([1.0], [1.0])
    found = hovi.solve(hovi.TrajectoryProblem(ld, *ends, limits))
    assert found.usable, found.message
    assert (found.n_neg, found.cost) == (0, pytest.approx(0.0, abs=1e-7))


@pytest.mark.parametrize("share", [0.99, 0.6])
@pytest.mark.parametrize("kind", ["v", "a", "tau"])
def test_limits_that_no_motion_satisfies_are_infeasible(kind: str, share: float) -> None:
    """The least duration of a trapezoid, or of full acceleration and braking, is longer."""
    least = {"v": 1.0, "a": 4.0, "tau": 4.0 * INERTIA}[kind]
    problem = problem_of(kind, 16)
    space = problem.robot if kind == "tau" else problem.coordinates
    limits = as_limits(space, {"base": "none", kind: share * least})
    found = hovi.solve(hovi.TrajectoryProblem(problem.ld, problem.start, problem.goal, limits))
    assert found.status == "infeasible"
    assert not found.usable


QVA: list[Any] = [ca.SX.sym(name) for name in "qva"]


def test_a_cost_without_any_curvature_is_bang_bang() -> None:
    """int q from rest to rest at 0 with |a| <= 1: down, up and down again by quarters of T."""
    L = hovi.CasadiLagrangian(QVA, QVA[0])
    grid = hovi.Grid.uniform(1.0, 32, galerkin(1))
    limits = as_limits(L.coordinates, {"base": "none", "a": 1.0})
    problem = hovi.TrajectoryProblem(
        hovi.DiscreteLagrangian(L, grid), State([0.0]), State([0.0]), limits
    )
    found = hovi.solve(problem)
    assert found.usable, found.message
    assert found.n_neg == 0
    assert found.cost == pytest.approx(-1 / 32, rel=2e-3)
    assert found.trajectory.sample([0.5]).q[0, 0] == pytest.approx(-1 / 16, rel=5e-3)
