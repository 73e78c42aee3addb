"""Stationary points of any index, with their Morse index."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

import hovi
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.limits import as_limits
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

Q, V, A = (ca.SX.sym(name) for name in ("q", "v", "a"))


def sought(
    L: CasadiLagrangian, T: float, goal: Any, intervals: int = 16, modes: int = 4, **rest: Any
) -> hovi.Solution:
    grid = hovi.Grid.uniform(T, intervals, galerkin(modes, L.order))
    problem = hovi.TrajectoryProblem(hovi.DiscreteLagrangian(L, grid), State([0.0]), goal, **rest)
    return hovi.solve(problem, seek="stationary")


@pytest.mark.parametrize("T", [2.0, 4.0, 7.5, 10.0])
def test_an_oscillator_has_an_index_for_every_conjugate_point(T: float) -> None:
    """q'' = -q is conjugate to its start at multiples of pi: Morse's index theorem."""
    found = sought(CasadiLagrangian([Q, V], V**2 / 2 - Q**2 / 2), T, State([1.0]))
    assert found.status is hovi.Status.STATIONARY
    assert found.success
    assert found.n_neg == int(T / np.pi)
    t = np.linspace(0.0, T, 41)
    q = found.trajectory.sample(t).q[:, 0]
    np.testing.assert_allclose(q, np.sin(t) / np.sin(T), rtol=0, atol=1e-7)
    assert found.error_estimate is not None
    exact = 1 / (2 * np.tan(T))
    assert found.cost == pytest.approx(exact, rel=max(3 * found.error_estimate, 1e-13))


def test_a_pendulum_beyond_its_conjugate_points_moves_as_it_does() -> None:
    found = sought(CasadiLagrangian([Q, V], V**2 / 2 + 9.81 * ca.cos(Q)), 6.0, State([1.0]), 40)
    assert found.success, found.message
    assert found.n_neg > 0
    v0 = float(found.trajectory.momenta[0, 0, 0])  # p = v

    def rates(t: float, y: Array) -> Array:
        return np.array([y[1], -9.81 * np.sin(y[0])])

    true = solve_ivp(rates, (0, 6), [0.0, v0], "DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
    t = np.linspace(0.0, 6.0, 61)
    np.testing.assert_allclose(found.trajectory.sample(t).q[:, 0], true.sol(t)[0], atol=1e-6)
    certificate = hovi.certify(found)
    assert certificate.bound is None
    assert certificate.residual is not None
    assert certificate.residual < 1e-9


def test_an_indefinite_cost_of_order_2_has_the_index_of_its_negative_modes() -> None:
    """1/2 a^2 - c^4/2 q^2, clamped: negative modes are those with k_n < c, cosh k cos k = 1."""
    roots = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    for c in (4.0, 6.0, 9.0):
        found = sought(CasadiLagrangian([Q, V, A], A**2 / 2 - c**4 * Q**2 / 2), 1.0, State([1.0]))
        assert found.success
        assert found.n_neg == int(np.sum(roots < c))


def test_replanning_seeks_a_stationary_point_again() -> None:
    found = sought(CasadiLagrangian([Q, V], V**2 / 2 - Q**2 / 2), 4.0, State([1.0]))
    again = found.replan(goal=State([0.5]))
    assert again.status is hovi.Status.STATIONARY
    assert again.n_neg == 1
    assert again.cost == pytest.approx(found.cost / 4, rel=1e-9)


def test_a_grid_that_does_not_carry_the_motion_is_said_to_be_unresolved() -> None:
    found = sought(CasadiLagrangian([Q, V], V**2 / 2 - Q**2 / 2), 40.0, State([1.0]), 5, 0)
    assert found.status is hovi.Status.UNRESOLVED
    assert not found.success
    assert "the motion is stationary on 5 intervals, which do not resolve it" in found.message


def test_a_search_that_ends_early_is_no_success() -> None:
    L = CasadiLagrangian([Q, V], V**2 / 2 + 9.81 * ca.cos(Q))
    grid = hovi.Grid.uniform(6.0, 20, galerkin(3, 1))
    problem = hovi.TrajectoryProblem(hovi.DiscreteLagrangian(L, grid), State([0.0]), State([1.0]))
    found = hovi.solve(problem, seek="stationary", max_iterations=1)
    assert found.status is hovi.Status.ITERATION_LIMIT
    assert not found.success
    assert "before a stationary point was found" in found.message


def test_limits_are_refused() -> None:
    limits = as_limits(hovi.spline(1).coordinates, {"base": "none", "v": 1.0})
    with pytest.raises(InputError, match="Stationary does not support this problem"):
        sought(hovi.spline(1), 1.0, State([1.0]), limits=limits)


def test_another_goal_of_the_search_is_refused() -> None:
    found = sought(hovi.spline(1), 1.0, State([1.0]))
    with pytest.raises(InputError, match="seek must be"):
        hovi.solve(found.problem, seek="maximum")  # type: ignore[arg-type]
