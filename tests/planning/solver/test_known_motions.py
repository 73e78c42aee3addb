"""Motions against closed forms, and against differential equations that know no discrete action."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.optimize import root

import hovi
from hovi.discrete.state import State
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin
from samples.manifold_robots import chain

Array = npt.NDArray[np.float64]
Rates = Callable[[float, Array], Array]

T_PLOT = np.linspace(0.0, 1.0, 101)


def solved(
    lagrangian: Lagrangian, start: State, goal: State, intervals: int = 12, modes: int = 4
) -> Any:
    """The motion of duration 1."""
    grid = hovi.Grid.uniform(1.0, intervals, galerkin(modes, lagrangian.order))
    ld = hovi.DiscreteLagrangian(lagrangian, grid)
    found = hovi.solve(hovi.TrajectoryProblem(ld, start, goal))
    assert found.success, found.message
    assert found.n_neg == 0
    return found.trajectory


def flow_of(rates: Rates, y: Array, T: float) -> Any:
    """The solution of y' = rates from y at 0, up to T."""
    return solve_ivp(rates, (0, T), y, "DOP853", rtol=3e-14, atol=3e-14, dense_output=True)


def shot(rates: Rates, start: Array, unknown: Array, goal: Array, T: float = 1.0) -> Any:
    """The solution from (start, unknown) whose first entries at T are the goal, by shooting."""

    def miss(u: Array) -> Array:
        return np.asarray(flow_of(rates, np.append(start, u), T).y[: len(goal), -1] - goal)

    found = root(miss, unknown, tol=1e-13)
    assert np.abs(miss(found.x)).max() < 1e-11
    return flow_of(rates, np.append(start, found.x), T).sol


# Elastica


def test_an_elastica_bends_as_its_arc_length_says() -> None:
    """1/2 integral of the squared curvature of a graph y(x), which is regular up to the vertical.

    In arc length theta' = kappa and kappa'' + kappa^3 / 2 = 0: the free elastica of Bernoulli.
    """
    Q, V, A = (ca.SX.sym(name) for name in "qva")
    L = CasadiLagrangian([Q, V, A], A**2 / 2 * (1 + V**2) ** -2.5)
    start, goal = (State([y], [slope]) for y, slope in ((0.0, 0.3), (0.4, -0.8)))
    found = solved(L, start, goal, intervals=32, modes=5)

    def rates(s: float, z: Array) -> Array:  # x, y, theta, kappa, kappa', length; s in [0, 1]
        _, _, theta, kappa, slope, length = z
        return length * np.array([np.cos(theta), np.sin(theta), kappa, slope, -(kappa**3) / 2, 0.0])

    first, last = np.array([0.0, 0.0, np.arctan(0.3)]), np.array([1.0, 0.4, np.arctan(-0.8)])
    true = shot(rates, first, np.array([1.0, -5.0, 1.2]), last)
    x, y, theta = true(T_PLOT)[:3]
    motion = found.sample(np.clip(x, 0, 1))
    np.testing.assert_allclose(motion.q[:, 0], y, rtol=0, atol=1e-9)
    np.testing.assert_allclose(motion.v[:, 0], np.tan(theta), rtol=0, atol=1e-8)


# Least jerk


def pendulum(gravity: float) -> tuple[hovi.Scene, float, Callable[[Any], Any]]:
    """A scene of one joint, its inertia M, and its torque of gravity, A sin q + B cos q."""
    robot = hovi.load_robot(chain([pin.JointModelRX()]))
    effects = [hovi.effects.Gravity(gravity)] if gravity else []
    scene = hovi.Scene(robot, effects)
    data = scene.model.createData()
    mass = float(pin.crba(scene.model, data, np.zeros(1))[0, 0])
    at = [
        float(pin.rnea(scene.model, data, np.array([q]), np.zeros(1), np.zeros(1))[0])
        for q in (0.0, np.pi / 2)
    ]
    return scene, mass, lambda q: at[1] * np.sin(q) + at[0] * np.cos(q)


def least_jerk(scene: hovi.Scene, weight: float) -> CasadiLagrangian:
    """1/2 |tau|^2 + w/2 |jerk|^2."""
    q, v, a, j = (ca.SX.sym(name, scene.robot.nv) for name in "qvaj")
    effort = hovi.symbolic.lagrangian(scene)(q, v, a, 0.0)
    return CasadiLagrangian([q, v, a, j], effort + weight / 2 * ca.sumsqr(j), scene=scene)


def test_the_least_jerk_of_a_joint_without_gravity_is_a_cubic_with_two_exponentials() -> None:
    """M^2 q'''' = w q^(6): 1, t, t^2, t^3, exp(-l t), exp(l (t - 1)) with l = M / sqrt(w)."""
    scene, mass, _ = pendulum(0.0)
    weight = 0.02
    rate = mass / np.sqrt(weight)
    start, goal = State([0.1], [0.5], a=[-2.0]), State([1.3], [-0.4], a=[3.0])
    found = solved(least_jerk(scene, weight), start, goal, modes=5)

    def basis(t: Array, j: int) -> Array:
        powers = [np.polynomial.Polynomial.basis(i).deriv(j)(t) for i in range(4)]
        falling, rising = np.exp(-rate * t), np.exp(rate * (t - 1))
        return np.stack([*powers, (-rate) ** j * falling, rate**j * rising], axis=-1)

    rows = [basis(np.array(t), j) for t in (0.0, 1.0) for j in range(3)]
    c = np.linalg.solve(np.array(rows), [0.1, 0.5, -2.0, 1.3, -0.4, 3.0])
    jet = found.jet(T_PLOT, 3)
    for j, size in enumerate([1e-12, 1e-11, 1e-9, 1e-7]):
        np.testing.assert_allclose(jet[j][:, 0], basis(T_PLOT, j) @ c, rtol=0, atol=size)


def test_the_least_jerk_of_a_pendulum_solves_its_equation() -> None:
    """tau dg/dq + M tau'' - w q^(6) = 0 with tau = M a + g(q), between accelerations too."""
    scene, mass, gravity = pendulum(9.81)
    weight = 0.5

    def rates(t: float, y: Array) -> Array:
        q, v, a, _, snap, _ = y
        slope, bend = gravity(q + np.pi / 2), -gravity(q)  # of A sin q + B cos q
        torque = mass * a + gravity(q)
        second = mass * snap + slope * a + bend * v**2
        return np.append(y[1:], (torque * slope + mass * second) / weight)

    found = solved(least_jerk(scene, weight), State([-0.5]), State([0.9], [0.3], a=[1.0]), 12, 5)
    jerk, momenta = found.jet([0.0], 3)[3][0, 0], found.momenta[0, :, 0]
    torque = gravity(-0.5)  # at rest
    # p_2 = w jerk, p_1 = M tau - w snap, p_0 = - d/dt p_1
    snap = (mass * torque - momenta[1]) / weight
    rate = mass * jerk  # of tau, at rest
    crackle = (mass * rate + momenta[0]) / weight
    true = shot(rates, np.array([-0.5, 0, 0]), np.array([jerk, snap, crackle]), [0.9, 0.3, 1.0])
    motion = found.jet(T_PLOT, 3)
    for j, size in enumerate([1e-9, 1e-9, 1e-8, 1e-6]):
        np.testing.assert_allclose(motion[j][:, 0], true(T_PLOT)[j], rtol=0, atol=size)


# Riemannian cubics


def test_a_riemannian_cubic_of_ur5_follows_hamiltons_equations() -> None:
    """L = 1/2 (M a + b) . M^-1 (M a + b) has H = p . v + 1/2 p~ . M^-1 p~ - p~ . M^-1 b."""
    robot = hovi.load_robot("ur5")
    scene = hovi.Scene(robot)
    q, v, p, pt = (ca.SX.sym(name, 6) for name in ("q", "v", "p", "pt"))
    body = hovi.symbolic.rigid_body(scene)
    M, b = body.mass_matrix(q), body.bias(q, v)
    solved_b, solved_p = ca.solve(M, b), ca.solve(M, pt)
    H = ca.dot(p, v) + ca.dot(pt, solved_p) / 2 - ca.dot(pt, solved_b)
    z = ca.vertcat(q, v, p, pt)
    slope = ca.gradient(H, z)
    field = ca.Function("X", [z], [ca.vertcat(slope[12:], -slope[:12])])
    start = State([0.1, -1.0, 0.8, -0.3, 0.5, 0.2], [0.5, 0, -0.4, 0.2, 0, 0.3])
    goal = State([0.9, -0.4, 1.4, 0.3, -0.2, 0.8], [0, 0.6, 0, -0.5, 0.4, 0])
    found = solved(hovi.riemannian_cubic(scene), start, goal, intervals=16, modes=4)
    y = np.concatenate([start.q, start.v, *found.momenta[0]])
    true = flow_of(lambda t, y: field(y).full()[:, 0], y, 1.0).sol(T_PLOT)
    motion = found.sample(T_PLOT)
    np.testing.assert_allclose(motion.q, true[:6].T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(true[:12, -1], np.concatenate([goal.q, goal.v]), atol=1e-9)
