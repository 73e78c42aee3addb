"""Passive joints: zero torque at points or as moments, orders of convergence, simulation."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import cubic, with_bump
from hovi.errors import SceneError
from oracles.ipopt_oracle import least_action
from oracles.pontryagin_oracle import Extremal, extremal

ACROBOT, CART_POLE, PENDUBOT = "acrobot_swing_up", "cart_pole_swing_up", "pendubot_swing_up"
SPACECRAFT = "spacecraft_reorients"
BUMPS = {CART_POLE: 2, PENDUBOT: 3}
"""Seeds of bumps that lead to minima which these grids resolve."""
MORE_POINTS = [(1, 5), (1, 6), (1, 8), (2, 6), (2, 8)]
"""Inner modes, and points of which there are more than modes and ends."""


@cache
def problem_on(
    scene: str, intervals: int, scheme: str, duration: float | None = None
) -> hovi.TrajectoryProblem:
    """The problem of a scene without its limits."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(duration or task.duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, task.start, task.goal)


@cache
def swing_up(
    scene: str, intervals: int, modes: int, near: int | None = None, points: int | None = None
) -> hovi.Solution:
    """The motion without limits, from the first guess or the motion on `near` intervals."""
    scheme = hovi.schemes.galerkin(modes, points=points).name
    problem = problem_on(scene, intervals, scheme)
    if near is None:
        return hovi.solve(
            problem, first_guess(problem, BUMPS[scene]) if scene in BUMPS else "cubic"
        )
    return hovi.solve(problem, swing_up(scene, near, 2).trajectory)


def first_guess(problem: hovi.TrajectoryProblem, seed: int) -> DiscretePath:
    """The cubic with a bump, from which swing-ups end in the cheaper of their minima."""
    on, T = problem.coordinates, problem.grid.duration
    return problem.path(with_bump(cubic(on, problem.ends, T), on, T, seed))


@cache
def continuous_optimum(scene: str) -> Extremal:
    """The motion by Pontryagin's equations, which know no grid, no moments and no multipliers."""
    near = swing_up(scene, 80, 3, near=40)
    motion, problem = near.trajectory, near.problem
    p, p_tilde = motion.momenta.transpose(1, 2, 0)
    guess = np.concatenate([motion.q.T, motion.v.T, p, p_tilde])
    model, passive = problem.scene.model, problem.passive
    return extremal(
        model, [x[i] for i in (0, 1) for x in problem.ends], motion.t, guess, 1e-8, passive
    )


def samples(solution: hovi.Solution, per_interval: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Times along the curve, both limits at nodes among them, and the torques there."""
    motion = solution.trajectory
    k = np.repeat(np.arange(motion.grid.intervals), per_interval)
    s = np.tile(np.linspace(0.0, 1.0, per_interval), motion.grid.intervals)
    return motion.t[k] + s * motion.grid.steps[k], motion.sample_intervals(k, s).tau


def miss(solution: hovi.Solution) -> float:
    """Largest error at a next node of pin.aba with the planned torques of the active joints.

    SciPy integrates from every node to the next, passive joints with no torque at all.
    """
    motion, scene = solution.trajectory, solution.problem.scene
    model, n = scene.model, scene.robot.nv
    data = model.createData()
    active = np.ones(n)
    active[scene.passive_coordinates] = 0.0
    largest = 0.0
    for k, h in enumerate(motion.grid.steps):

        def rates(t: float, y: np.ndarray, k: int = k, h: float = h) -> np.ndarray:
            tau = motion.sample_intervals([k], [min(t / h, 1.0)]).tau[0] * active
            return np.concatenate([y[n:], pin.aba(model, data, y[:n], y[n:], tau)])

        start = np.concatenate([motion.q[k], motion.v[k]])
        end = solve_ivp(rates, (0, h), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        largest = max(largest, float(np.max(np.abs(end[:n] - motion.q[k + 1]))))
    return largest


def passive_torques(solution: hovi.Solution) -> tuple[np.ndarray, np.ndarray, float]:
    """At the points, the moments of every interval, and the largest torque of all joints."""
    problem = solution.problem
    (x,) = problem.ld.jets(solution.trajectory.path)
    torques = problem.ld.lagrangian.output(*x)
    scheme = problem.grid.schemes[0]
    tau = torques[:, problem.passive].reshape(problem.grid.intervals, len(scheme.points), -1)
    count = scheme.inner_modes + 2
    P = np.polynomial.legendre.legvander(2 * scheme.points - 1, count - 1)
    moments = np.einsum("kpj,p,pm->kmj", tau, scheme.weights, P)
    return tau, moments, float(np.abs(torques).max())


@pytest.mark.parametrize("points", [4, 8])
@pytest.mark.parametrize("scene", [ACROBOT, CART_POLE, PENDUBOT])
def test_a_passive_joint_takes_no_torque_at_points_or_in_moments(scene: str, points: int) -> None:
    solution = swing_up(scene, 40, 2, points=points)
    assert solution.n_neg == 0, solution.message
    tau, moments, largest = passive_torques(solution)
    np.testing.assert_allclose(moments, 0.0, rtol=0, atol=1e-9 * largest)
    assert (np.abs(tau).max() < 1e-9 * largest) == (points == 4)


@pytest.mark.parametrize(
    ("scene", "modes", "points"),
    [(CART_POLE, 1, 5), (CART_POLE, 2, 8), (PENDUBOT, 1, 8), (PENDUBOT, 2, 6)],
)
def test_on_a_coarse_grid_ipopt_finds_the_same_minimum(scene: str, modes: int, points: int) -> None:
    """Ipopt has the moments of the passive torque as equations, formed in CasADi."""
    solution = swing_up(scene, 10, modes, 40, points)
    cost, nodes = least_action(solution.problem, solution.trajectory.path, move=1e-4)
    motion = solution.trajectory
    assert solution.cost == pytest.approx(cost, rel=1e-8)
    ours = np.hstack([motion.q, motion.v])[1:-1]
    np.testing.assert_allclose(ours, nodes, rtol=0, atol=1e-5 * np.abs(nodes).max())


@pytest.mark.parametrize("modes", [0, 1, 2])
def test_cost_and_nodes_of_a_cart_pole_converge_at_the_order_of_the_scheme(modes: int) -> None:
    fine = swing_up(CART_POLE, 160, 3, near=40)
    counts = (40, 80) if modes == 2 else (80, 160)
    errors = []
    for N in counts:
        coarse = swing_up(CART_POLE, N, modes, near=40)
        gap = coarse.trajectory.q - fine.trajectory.q[:: 160 // N]
        errors.append([abs(coarse.cost / fine.cost - 1), np.max(np.abs(gap))])
    slopes = np.log2(np.array(errors[0]) / np.array(errors[1]))
    order = 2 * (modes + 2)
    assert slopes[0] == pytest.approx(order, abs=0.3 if modes < 2 else 2.0)
    assert slopes[1] > order - 0.3


@pytest.mark.parametrize(("modes", "points"), MORE_POINTS)
@pytest.mark.parametrize("scene", [CART_POLE, PENDUBOT])
def test_with_more_points_the_cost_converges_to_the_continuous_optimum(
    scene: str, modes: int, points: int
) -> None:
    """Zero torque at all of these points would lock the motion, with a cost up to 65 % too high."""
    optimum, order = continuous_optimum(scene).cost, 2 * (modes + 2)
    coarse, *counts = (10, 80, 160) if modes == 1 else (10, 40, 80)
    errors = [
        abs(swing_up(scene, N, modes, 40, points).cost / optimum - 1) for N in (coarse, *counts)
    ]
    assert errors[0] < (0.015 if modes == 1 else 0.003)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize(("modes", "points"), MORE_POINTS)
def test_with_more_points_the_cost_of_a_floating_robot_keeps_its_order(
    modes: int, points: int
) -> None:
    fine = swing_up(SPACECRAFT, 32, 3)
    costs = [swing_up(SPACECRAFT, N, modes, 16, points).cost for N in (8, 32)]
    errors = np.abs(np.array(costs) / fine.cost - 1)
    assert 0.5 * np.log2(errors[0] / errors[1]) == pytest.approx(2 * (modes + 2), abs=0.3)


@pytest.mark.parametrize(("modes", "points"), [(1, 3), (1, 5), (1, 8), (2, 4), (2, 6), (2, 8)])
def test_the_torques_between_the_points_converge_with_the_acceleration(
    modes: int, points: int
) -> None:
    """To those of Pontryagin's equations, and at the passive joint to zero."""
    optimum = continuous_optimum(CART_POLE)
    errors, passive = [], []
    for N in (40, 80, 160):
        solution = swing_up(CART_POLE, N, modes, 40, points)
        t, tau = samples(solution)
        errors.append(np.max(np.abs(tau - optimum.tau(t))))
        passive.append(np.max(np.abs(tau[:, solution.problem.passive])))
    for sizes in (errors, passive):
        order = 0.5 * np.log2(sizes[0] / sizes[-1])
        assert order == pytest.approx(modes + 2, abs=0.3)


def test_a_cubic_by_simpsons_rule_does_not_lock() -> None:
    """Three points an interval, and two coefficients."""
    optimum = continuous_optimum(CART_POLE).cost
    problems = [problem_on(CART_POLE, N, "hermite-simpson") for N in (40, 80, 160)]
    near = swing_up(CART_POLE, 40, 2).trajectory
    errors = [hovi.solve(problem, near).cost / optimum - 1 for problem in problems]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(slopes, 4.0, rtol=0, atol=0.3)


@pytest.mark.parametrize("points", [3, 5])
def test_the_simulated_cart_pole_deviates_by_the_order_of_the_scheme(points: int) -> None:
    """Collocation at s Gauss points has a local error of h^(2 s + 1)."""
    misses = [miss(swing_up(CART_POLE, N, 1, 40, points)) for N in (20, 40, 80)]
    slopes = np.log2(np.divide(misses[:-1], misses[1:]))
    assert np.all(slopes > 5.7)
    assert misses[-1] < 1e-8


@pytest.mark.parametrize(("intervals", "points"), [(32, 4), (48, 8)])
def test_a_quadruped_in_free_fall_is_solved_on_fine_grids(intervals: int, points: int) -> None:
    """Rounding moves the torques of its base by more than 1e-10 of those of its legs."""
    solution = swing_up("solo_in_flight", intervals, 2, points=points)
    assert solution.success, solution.message
    assert solution.cost == pytest.approx(swing_up("solo_in_flight", 16, 3).cost, rel=1e-10)
    tau, moments, largest = passive_torques(solution)
    held = tau if points == 4 else moments
    assert 0.0 < np.abs(held).max() < 1e-8 * largest


@pytest.mark.parametrize("points", [4, 8])
def test_the_momenta_of_a_passive_motion_agree_on_both_sides_of_a_node(points: int) -> None:
    """The discrete Euler-Lagrange equations hold with the multipliers' terms in L_d."""
    solution = swing_up(CART_POLE, 40, 2, points=points)
    problem = solution.problem
    d = problem.ld.derivatives(solution.trajectory.path, solution.forces)
    jump = d[1:, :2] + d[:-1, 2:]
    assert np.max(np.abs(jump)) < 1e-6 * np.max(np.abs(d))
    without = problem.ld.derivatives(solution.trajectory.path)
    assert np.max(np.abs(without[1:, :2] + without[:-1, 2:])) > 1e-2 * np.max(np.abs(d))


@pytest.mark.parametrize("points", [4, 8])
def test_the_cost_changes_with_the_duration_as_the_hamiltonian_says(points: int) -> None:
    solution = swing_up(CART_POLE, 40, 2, points=points)
    scheme, T, step = solution.problem.grid.schemes[0].name, solution.trajectory.duration, 1e-3
    costs = [
        hovi.solve(problem_on(CART_POLE, 40, scheme, T + change), solution.trajectory).cost
        for change in (-step, step)
    ]
    slope = (costs[1] - costs[0]) / (2 * step)
    assert solution.duration_derivative == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("points", [4, 8])
def test_the_hamiltonian_of_a_passive_motion_is_constant_at_its_nodes(points: int) -> None:
    """With p~ = M (R tau + lambda), the torque and the multiplier at a node are M^-1 p~."""
    solution = swing_up(CART_POLE, 80, 2, 40, points)
    motion, scene = solution.trajectory, solution.problem.scene
    data, (passive,) = scene.model.createData(), scene.passive_coordinates
    H, size = [], 0.0
    for q, v, (p, p_tilde) in zip(motion.q, motion.v, motion.momenta, strict=True):
        mass = pin.crba(scene.model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        tau = np.linalg.solve(mass, p_tilde)
        tau[passive] = 0.0
        a = pin.aba(scene.model, data, q, v, tau)
        H.append(p @ v + p_tilde @ a - 0.5 * tau @ tau)
        size = max(size, abs(p @ v) + abs(p_tilde @ a) + 0.5 * tau @ tau)
    assert np.ptp(H) < 1e-6 * size


@pytest.mark.parametrize("scheme", ["galerkin-2", "galerkin-2x8"])
def test_an_underactuated_motion_keeps_its_limits(scheme: str) -> None:
    task = hovi.load_task(hovi.example(CART_POLE))
    limits = {"q": {"slide": [-0.1, 1.1]}}
    solution = hovi.plan(
        task.scene,
        task.start,
        task.goal,
        task.duration,
        intervals=40,
        scheme=hovi.schemes.by_name(scheme),
        limits=limits,
    )
    assert solution.success, solution.message
    slide = solution.trajectory.sample(np.linspace(0, task.duration, 2000)).q[:, 0]
    assert slide.min() > -0.1 - 2e-6
    assert slide.max() < 1.1 + 2e-6
    _, moments, largest = passive_torques(solution)
    assert np.abs(moments).max() < 1e-8 * largest


def test_a_pole_held_where_it_would_fall_is_infeasible(models) -> None:
    robot = hovi.load_robot(models / "cart_pole.urdf")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=["hinge"])
    limits = {"q": {"slide": [-0.01, 0.01]}}
    solution = hovi.plan(scene, [0.0, 1.0], [0.0, 1.0], 2.0, limits=limits, max_iterations=500)
    assert not solution.success
    assert "'hinge'" in solution.message or "'slide'" in solution.message


def test_invalid_passive_joints_are_refused(models) -> None:
    robot = hovi.load_robot(models / "cart_pole.urdf")
    with pytest.raises(SceneError, match="did you mean 'hinge'"):
        hovi.Scene(robot, passive=["hinges"])
    with pytest.raises(SceneError, match="list of joint names"):
        hovi.Scene(robot, passive="hinge")
    with pytest.raises(SceneError, match="every joint is passive"):
        hovi.Scene(robot, passive=["hinge", "slide"])
    scene = hovi.Scene(robot, passive=["hinge"])
    assert "no torque at hinge" in scene.describe()
    assert hovi.Scene.from_dict(scene.to_dict()).passive == ("hinge",)
