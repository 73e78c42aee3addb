"""Boundary value problems of Lagrangians of order 1, 3 and 4."""

from __future__ import annotations

from math import comb, factorial
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
from hovi.errors import InputError, SchemeError
from hovi.planning.problem.limits import as_limits
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin
from oracles.dense_action import DenseAction

Array = npt.NDArray[np.float64]


def problem_of(
    lagrangian: Lagrangian,
    T: float,
    start: State,
    goal: Any,
    intervals: int = 6,
    modes: int = 3,
    **rest: Any,
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(T, intervals, galerkin(modes, lagrangian.order))
    return hovi.TrajectoryProblem(hovi.DiscreteLagrangian(lagrangian, grid), start, goal, **rest)


def solved(*arguments: Any, **rest: Any) -> hovi.Solution:
    found = hovi.solve(problem_of(*arguments, **rest))
    assert found.success, found.message
    assert found.n_neg == 0
    assert found.error_estimate is not None
    return found


def least_jerk_effort(scene: hovi.Scene, weight: float) -> CasadiLagrangian:
    """1/2 |tau|^2 + w/2 |jerk|^2."""
    q, v, a, j = (ca.SX.sym(name, scene.robot.nv) for name in ("q", "v", "a", "j"))
    effort = hovi.symbolic.lagrangian(scene)(q, v, a, 0.0)
    return CasadiLagrangian([q, v, a, j], effort + weight / 2 * ca.sumsqr(j), scene=scene)


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_a_spline_is_the_polynomial_through_its_ends(k: int) -> None:
    """The one of degree 2 k - 1 from 0 to 1 at rest; cost 1/2 integral |q^(k)|^2 in closed form."""
    found = solved(hovi.spline(1, k), 2.0, State([0.0]), State([1.0]))
    s = np.linspace(0.0, 1.0, 41)
    q = sum(
        (-1) ** i * comb(k - 1 + i, i) * comb(2 * k - 1, k - 1 - i) * s ** (k + i) for i in range(k)
    )
    np.testing.assert_allclose(found.trajectory.sample(2 * s).q[:, 0], q, rtol=0, atol=1e-13)
    cost = factorial(2 * k - 1) * factorial(2 * k - 2) / (2 * factorial(k - 1) ** 2)
    assert found.cost == pytest.approx(cost / 2.0 ** (2 * k - 1), rel=1e-12)
    assert found.error_estimate < 1e-12


def test_given_accelerations_and_jerks_are_met() -> None:
    start = State([0.0, 1.0], [1.0, 0.0], a=[2.0, -1.0], jerk=[0.5, 4.0])
    goal = State([1.0, 0.0], a=[0.0, 3.0])
    motion = solved(hovi.spline(2, 4), 1.5, start, goal).trajectory
    first, last = (np.array([x[0] for x in motion.jet(t, 4)]) for t in ([0.0], [1.5]))
    np.testing.assert_allclose(first[:4], [[0, 1], [1, 0], [2, -1], [0.5, 4]], atol=1e-12)
    np.testing.assert_allclose(last[:4], [[1, 0], [0, 0], [0, 3], [0, 0]], atol=1e-11)


def test_free_accelerations_get_natural_boundary_conditions() -> None:
    """With a free at both ends the least jerk is none: q is the cubic whose jerk is least."""
    ends = [State([x], free_acceleration=["q[0]"]) for x in (0.0, 1.0)]
    found = solved(hovi.spline(1, 3), 1.0, *ends)
    np.testing.assert_allclose(found.trajectory.momenta[[0, -1], 2], 0.0, atol=1e-11)
    s = np.linspace(0.0, 1.0, 21)
    fixed = solved(hovi.spline(1, 3), 1.0, State([0.0]), State([1.0]))
    assert found.cost < fixed.cost
    # x'''''' = 0 with x'''(0) = x'''(1) = 0 has x''' = c s (1 - s), and x' = x'' at no end
    c = found.trajectory.jet([0.5], 3)[3][0, 0] * 4
    np.testing.assert_allclose(
        found.trajectory.jet(s, 3)[3][:, 0], c * s * (1 - s), atol=1e-9 * abs(c)
    )


def test_a_nonlinear_lagrangian_of_order_3_solves_its_euler_lagrange_equation() -> None:
    q, v, a, j = (ca.SX.sym(name) for name in "qvaj")
    L = j**2 / 2 + 3 * a**2 / 2 + 20 * (1 - ca.cos(q)) + 4 * q
    found = solved(CasadiLagrangian([q, v, a, j], L), 1.0, State([0.0]), State([2.0], [1.0]))

    def rates(t: Array, y: Array) -> Array:  # q^(6) = 3 q'''' + dV/dq
        return np.array([*y[1:], 3 * y[4] + 20 * np.sin(y[0]) + 4])

    def boundary(y0: Array, y1: Array) -> Array:
        return np.array([*y0[:3], y1[0] - 2, y1[1] - 1, y1[2]])

    mesh = np.linspace(0, 1, 30)
    expected = solve_bvp(rates, boundary, mesh, np.zeros((6, 30)), tol=1e-8, max_nodes=100_000)
    assert expected.success
    t = np.linspace(0.0, 1.0, 51)
    np.testing.assert_allclose(found.trajectory.sample(t).q[:, 0], expected.sol(t)[0], atol=1e-8)
    jerk = found.trajectory.jet(t, 3)[3][:, 0]
    np.testing.assert_allclose(jerk, expected.sol(t)[3], atol=1e-5)


def test_a_motion_of_mechanics_between_two_points_is_that_of_the_forward_dynamics() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity(9.8)])
    model, T = scene.model, 0.25
    data = model.createData()
    q0, v0 = np.array([-1.2, 0.5]), np.array([2.0, -1.0])

    def rates(t: float, y: Array) -> Array:
        return np.concatenate([y[2:], pin.aba(model, data, y[:2], y[2:], np.zeros(2))])

    y = solve_ivp(rates, (0, T), [*q0, *v0], "DOP853", rtol=1e-13, atol=1e-13, dense_output=True)
    found = solved(hovi.mechanics(scene), T, State(q0), State(y.y[:2, -1]), modes=4)
    t = np.linspace(0.0, T, 31)
    np.testing.assert_allclose(found.trajectory.sample(t).q, y.sol(t)[:2].T, atol=1e-11)
    np.testing.assert_allclose(found.trajectory.v[0], v0, atol=1e-8)
    certificate = hovi.certify(found)
    assert certificate.replay is not None  # no torques act, to rounding
    assert certificate.hamiltonian is not None
    energy = pin.computeMechanicalEnergy(model, data, q0, v0)
    assert certificate.hamiltonian.mean == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize(("k", "modes"), [(1, 0), (1, 1), (1, 2), (3, 0), (3, 1)])
def test_the_order_at_the_nodes_is_twice_modes_plus_k(k: int, modes: int) -> None:
    """On a real arm's mass matrix: the kinetic energy, and a cost of order 3 of it."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity(9.8)])
    lagrangian = hovi.mechanics(scene) if k == 1 else least_jerk_effort(scene, 0.3)
    T, goal = (0.2, [-1.0, 0.3]) if k == 1 else (0.3, [-0.9, 0.5])
    problem = problem_of(lagrangian, T, State([-1.2, 0.1]), State(goal), 8, 7)
    exact = hovi.solve(problem).trajectory
    errors, counts = [], np.array([4, 8] if modes else [4, 8, 16])
    for N in counts:
        motion = solved(lagrangian, T, State([-1.2, 0.1]), State(goal), int(N), modes).trajectory
        errors.append(np.abs(motion.q[1:-1] - exact.sample(motion.t[1:-1]).q).max())
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(2 * (modes + k), abs=0.3)


def test_jerk_in_the_cost_starts_and_ends_a_reach_without_acceleration() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity(9.8)])
    found = solved(least_jerk_effort(scene, 1e-2), 1.0, State([-1.5, 0]), State([0.3, 0.7]), 12)
    motion = found.trajectory.sample(np.linspace(0.0, 1.0, 1001))
    np.testing.assert_allclose(motion.a[[0, -1]], 0.0, atol=1e-9)
    assert np.abs(np.diff(motion.tau, axis=0)).max() < 0.02 * np.abs(motion.tau).max()


@pytest.mark.parametrize("k", [1, 3, 4])
def test_motions_are_saved_loaded_and_replanned(k: int, tmp_path: Path) -> None:
    found = solved(hovi.spline(2, k), 1.0, State([0.0, 1.0]), State([1.0, 0.0]))
    found.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    t, top = np.linspace(0.0, 1.0, 23), max(2, k)
    for one, other in zip(found.trajectory.jet(t, top), loaded.jet(t, top), strict=True):
        np.testing.assert_array_equal(one, other)
    again = found.replan(goal=State([2.0, -1.0]))
    assert again.success
    assert again.cost == pytest.approx(4 * found.cost, rel=1e-10)
    same = hovi.solve(again.problem, loaded)
    assert same.cost == pytest.approx(again.cost, rel=1e-10)


@pytest.mark.parametrize("k", [1, 3, 4])
def test_the_gradient_and_hessian_of_the_action_are_its_derivatives(k: int) -> None:
    """Along random steps, on uneven steps, against central differences."""
    q = [ca.SX.sym(f"q{j}", 2) for j in range(k + 1)]
    L = sum(ca.sumsqr(x) for x in q) / 2 + ca.sin(q[0][0]) * q[k][1] ** 2 + q[0][1] ** 3 * q[k][0]
    grid = hovi.Grid(np.array([0.5, 0.7, 0.4]), (galerkin(2, k), galerkin(1, k), galerkin(2, k)))
    ld = hovi.DiscreteLagrangian(CasadiLagrangian(q, L), grid)
    problem = hovi.TrajectoryProblem(ld, State([0.1, 0.2]), State([0.6, -0.3]))
    dense, random = DenseAction(problem, problem.guess("cubic")), np.random.default_rng(k)
    step = random.normal(size=dense.size)

    def action(size: float) -> float:
        return ld.action(dense.moved(size * step))

    small, large = 1e-5, 1e-3
    slope = 8 * (action(small) - action(-small)) - action(2 * small) + action(-2 * small)
    slope /= 12 * small
    assert slope == pytest.approx(float(dense.gradient @ step), rel=1e-6)
    bend = (action(large) - 2 * action(0.0) + action(-large)) / large**2
    assert bend == pytest.approx(float(step @ dense.hessian @ step), rel=1e-4)


@pytest.mark.parametrize(
    ("k", "goal", "sentence"),
    [
        (1, State([1.0], [0.0]), "goal has v or free_velocity, but motions of order 1 end at"),
        (2, State([1.0], a=[0.0]), "goal has a or free_acceleration, but motions of order 2"),
        (3, State([1.0], jerk=[0.0]), "values of q, v, a only: leave them out"),
        (3, State([1.0], a=[np.nan]), r"goal.a is nan at joint 'q\[0\]'"),
        (
            4,
            hovi.FrameGoal("tool", position=[0, 0, 1]),
            "goals of frames need a Lagrangian of order 2 or 3",
        ),
    ],
)
def test_ends_of_another_order_are_refused_by_name(k: int, goal: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        problem_of(hovi.spline(1, k), 1.0, State([0.0]), goal)


def test_schemes_and_grids_of_another_order_are_refused() -> None:
    with pytest.raises(SchemeError, match="order 2, this one is of order 3"):
        hovi.DiscreteLagrangian(hovi.spline(1, 3), hovi.Grid.uniform(1.0, 4, galerkin(2)))
    with pytest.raises(InputError, match=r"of one order, got \[2, 3\]"):
        hovi.Grid(np.ones(2), (galerkin(2), galerkin(2, 3)))


def test_a_third_positional_argument_of_a_state_is_no_acceleration() -> None:
    with pytest.raises(TypeError, match="from 2 to 3 positional arguments"):
        State([0.0], [0.0], [1.0])  # type: ignore[misc]


def test_limits_of_other_orders_are_refused_by_name() -> None:
    limits = as_limits(hovi.spline(1, 4).coordinates, {"base": "none", "v": 1.0})
    with pytest.raises(InputError, match="limits need a Lagrangian of order 2 or 3"):
        problem_of(hovi.spline(1, 4), 1.0, State([0.0]), State([1.0]), limits=limits)
    limits = as_limits(hovi.spline(1, 2).coordinates, {"base": "none", "jerk": 1.0})
    with pytest.raises(InputError, match=r"the jerk and on the torque rate need .* of order 3"):
        problem_of(hovi.spline(1, 2), 1.0, State([0.0]), State([1.0]), limits=limits)
