"""Boundary value problems of Lagrangians of order 2 that are no effort, and of no robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_bvp, solve_ivp

import hovi
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import as_limits
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

Q, V, A, TIME = (ca.SX.sym(name) for name in ("q", "v", "a", "t"))


def problem_of(
    lagrangian: Lagrangian, T: float, start: State, goal: Any, intervals: int = 8, **rest: Any
) -> hovi.TrajectoryProblem:
    ld = hovi.DiscreteLagrangian(lagrangian, hovi.Grid.uniform(T, intervals, galerkin(4)))
    return hovi.TrajectoryProblem(ld, start, goal, **rest)


def solved(*arguments: Any, **rest: Any) -> hovi.Solution:
    found = hovi.solve(problem_of(*arguments, **rest))
    assert found.success, found.message
    assert found.n_neg == 0
    assert found.error_estimate is not None
    assert found.error_estimate < 1e-8
    return found


def scalar_bvp(fourth: Any, T: float, ends: list[float]) -> Any:
    """The solution of q'''' = fourth(t, q, q', q'', q''') between (q, q') at both ends."""

    def rates(t: Array, y: Array) -> Array:
        return np.array([y[1], y[2], y[3], fourth(t, *y)])

    def boundary(y0: Array, y1: Array) -> Array:
        return np.array([*y0[:2], *y1[:2]]) - ends

    found = solve_bvp(
        rates, boundary, np.linspace(0, T, 30), np.zeros((4, 30)), tol=1e-10, max_nodes=100_000
    )
    assert found.success
    return found.sol


def test_a_spline_is_the_cubic_through_its_ends() -> None:
    start, goal = State([0.0, 0.0], [10.0, 10.0]), State([10.0, 0.0], [10.0, 20.0])
    found = solved(hovi.spline(2), 1.0, start, goal)
    s = np.linspace(0.0, 1.0, 101)[:, None]
    cubic = 10 * s + np.array([0.0, 1.0]) * (30 * s**3 - 40 * s**2)
    np.testing.assert_allclose(found.trajectory.sample(s[:, 0]).q, cubic, rtol=0, atol=1e-13)
    assert found.cost == pytest.approx(1400.0, rel=1e-13)


def test_a_beam_under_tension_on_an_elastic_foundation_bends_as_its_equation_says() -> None:
    tension, stiffness, load = 3.0, 40.0, 5.0
    L = A**2 / 2 + tension * V**2 / 2 + stiffness * Q**2 / 2 - load * Q
    found = solved(CasadiLagrangian([Q, V, A], L), 1.0, State([0.0]), State([0.2], [0.5]))

    def fourth(t: Array, q: Array, dq: Array, ddq: Array, dddq: Array) -> Array:
        return np.asarray(tension * ddq - stiffness * q + load)

    expected = scalar_bvp(fourth, 1.0, [0.0, 0.0, 0.2, 0.5])
    t = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(found.trajectory.sample(t).q[:, 0], expected(t)[0], atol=1e-11)


def test_a_nonlinear_cost_may_depend_on_time() -> None:
    L = A**2 / 2 + ca.sin(5 * TIME) * Q + 2 * Q**4
    lagrangian = CasadiLagrangian([Q, V, A], L, time=TIME)
    found = solved(lagrangian, 1.5, State([0.0]), State([1.0]))

    def fourth(t: Array, q: Array, dq: Array, ddq: Array, dddq: Array) -> Array:
        return -np.sin(5 * t) - 8 * q**3

    expected = scalar_bvp(fourth, 1.5, [0.0, 0.0, 1.0, 0.0])
    t = np.linspace(0.0, 1.5, 101)
    np.testing.assert_allclose(found.trajectory.sample(t).q[:, 0], expected(t)[0], atol=1e-9)
    assert hovi.certify(found).hamiltonian is None  # which is not constant


def test_a_free_velocity_gets_the_natural_boundary_condition() -> None:
    goal = State([1.0], free_velocity=["q[0]"])
    found = solved(hovi.spline(1), 2.0, State([0.0]), goal)
    assert found.cost == pytest.approx(3 / (2 * 2.0**3), rel=1e-13)
    assert abs(found.trajectory.momenta[-1, 1, 0]) < 1e-13  # p~ = dL/da


def test_between_ends_of_a_geodesic_the_riemannian_cubic_is_the_geodesic() -> None:
    robot = hovi.load_robot("ur5")
    model, v0 = robot.model.copy(), np.array([0.5, -0.4, 0.6, 0.3, -0.7, 0.8])
    model.gravity.linear[:] = 0.0
    data, q0 = model.createData(), np.array([0.1, -1.0, 0.8, -0.3, 0.5, 0.2])

    def rates(t: float, y: Array) -> Array:
        return np.concatenate([y[6:], pin.aba(model, data, y[:6], y[6:], np.zeros(6))])

    y = np.concatenate([q0, v0])
    end = solve_ivp(rates, (0, 1), y, "DOP853", rtol=1e-13, atol=1e-13, dense_output=True)
    lagrangian = hovi.riemannian_cubic(hovi.Scene(robot))
    found = hovi.solve(
        problem_of(lagrangian, 1.0, State(q0, v0), State(end.y[:6, -1], end.y[6:, -1]))
    )
    assert found.cost < 1e-14
    t = np.linspace(0.0, 1.0, 21)
    np.testing.assert_allclose(found.trajectory.sample(t).q, end.sol(t)[:6].T, atol=1e-9)
    assert found.trajectory.robot is robot  # its motion can be replayed


def test_a_cubic_on_rotations_solves_its_euler_poincare_equation() -> None:
    """omega''' = omega'' x omega in body coordinates. [NoakesHeinzingerPaden1989]"""
    v0, v1, angle = np.array([0.3, 0.0, 0.5]), np.array([0.0, 0.6, 0.2]), 1.2
    q0, q1 = np.array([0.0, 0, 0, 1]), np.array([np.sin(angle / 2), 0, 0, np.cos(angle / 2)])
    g, w, dw = (ca.SX.sym(*name) for name in (("g", 4), ("w", 3), ("dw", 3)))
    space = ConfigurationSpace(("SO(3)",))
    lagrangian = CasadiLagrangian([g, w, dw], ca.sumsqr(dw) / 2, space)
    found = solved(lagrangian, 1.0, State(q0, v0), State(q1, v1))

    def rates(t: Array, y: Array) -> Array:
        u, s, w, dw, ddw = y[:3], y[3], y[4:7], y[7:10], y[10:]
        turned = 0.5 * (s * w + np.cross(u, w, axis=0))
        third = np.cross(ddw, w, axis=0)
        return np.concatenate([turned, -0.5 * np.sum(u * w, axis=0)[None], dw, ddw, third])

    def boundary(y0: Array, y1: Array) -> Array:
        return np.concatenate([y0[:4] - q0, y0[4:7] - v0, y1[:3] - q1[:3], y1[4:7] - v1])

    t = np.linspace(0.0, 1.0, 41)
    guess = np.concatenate([found.trajectory.sample(t).q.T, np.zeros((9, 41))])
    expected = solve_bvp(rates, boundary, t, guess, tol=1e-9, max_nodes=50_000)
    assert expected.success
    np.testing.assert_allclose(found.trajectory.sample(t).q, expected.sol(t)[:4].T, atol=1e-9)


def test_a_bound_on_the_speed_is_met_by_the_known_optimum() -> None:
    """The speed rises as a parabola, stays at its bound b, and falls; T1 = 3 (b T - D) / (2 b)."""
    D, T, bound = 1.0, 1.0, 1.2
    coordinates = hovi.spline(1).coordinates
    limits = as_limits(coordinates, {"base": "none", "v": bound})
    problem = problem_of(hovi.spline(1), T, State([0.0]), State([D]), intervals=40, limits=limits)
    found = hovi.solve(problem)
    assert found.success, found.message
    rise = 3 * (bound * T - D) / (2 * bound)
    assert found.cost == pytest.approx(4 * bound**2 / (3 * rise), rel=1e-3)
    assert closeness(found.trajectory, limits).min() >= -2e-6


def test_a_motion_without_torques_is_sampled_saved_and_loaded(tmp_path: Path) -> None:
    found = solved(hovi.spline(3), 1.0, State([0.0, 1.0, 2.0]), State([1.0, 0.0, 2.5]))
    t = np.linspace(0.0, 1.0, 11)
    found.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    for one, other in zip(found.trajectory.sample(t), loaded.sample(t), strict=True):
        np.testing.assert_array_equal(one, other)
    assert loaded.sample(t).tau.shape == (11, 0)
    assert loaded.coordinate_names == ("q[0]", "q[1]", "q[2]")


def test_the_certificate_says_what_needs_a_robot() -> None:
    found = solved(hovi.spline(1), 1.0, State([0.0]), State([1.0]))
    certificate = hovi.certify(found)
    assert certificate.bound == pytest.approx(6.0, rel=1e-12)
    assert certificate.residual is not None
    assert certificate.residual < 1e-12
    assert certificate.torque is None
    assert sorted(certificate.missing) == ["errors", "replay", "torque"]


def test_replanning_moves_the_goal() -> None:
    found = solved(hovi.spline(1), 1.0, State([0.0]), State([1.0]))
    again = found.replan(goal=State([3.0]))
    assert again.success
    assert again.cost == pytest.approx(9 * found.cost, rel=1e-12)


@pytest.mark.parametrize(
    ("goal", "sentence"),
    [
        (
            hovi.FrameGoal("tool", position=[0, 0, 1]),
            "must be a State: the Lagrangian has no frames",
        ),
        (State([1.0, 2.0]), r"goal has shape \(2,\), expected \(1,\): one number each for q\[0\]"),
        (State([1.0], free=["elbow"]), "the Lagrangian has no joint 'elbow'"),
    ],
)
def test_goals_that_need_a_robot_or_do_not_fit_are_refused(goal: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        problem_of(hovi.spline(1), 1.0, State([0.0]), goal)


def test_limits_of_a_urdf_need_a_robot() -> None:
    with pytest.raises(InputError, match="the Lagrangian has no URDF"):
        as_limits(hovi.spline(1).coordinates, "urdf")


def test_an_expression_of_other_symbols_is_refused_by_name() -> None:
    with pytest.raises(InputError, match="symbols that are not in its jet: t"):
        CasadiLagrangian([Q, V, A], A**2 + TIME)


def test_a_lagrangian_of_time_asks_for_times() -> None:
    lagrangian = CasadiLagrangian([Q, V, A], A**2 + TIME, time=TIME)
    one = np.ones((2, 1))
    np.testing.assert_allclose(lagrangian.value(one, one, one, t=np.array([1.0, 2.0])), [2.0, 3.0])
    with pytest.raises(InputError, match="depends on time: give t"):
        lagrangian.value(one, one, one)
