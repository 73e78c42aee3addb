"""Passive joints: zero torque at the points, orders of convergence, forward simulation."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import hovi
from hovi.errors import SceneError
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import unmet_sentence
from hovi.planning.solver.multipliers import Residuals

ACROBOT, CART_POLE, PENDUBOT = "acrobot_swing_up", "cart_pole_swing_up", "pendubot_swing_up"


@cache
def swing_up(scene: str, intervals: int, modes: int, near: int | None = None) -> hovi.Solution:
    """The swing-up without limits, from the cubic guess or the motion on `near` intervals."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.galerkin(modes))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    guess = "cubic" if near is None else swing_up(scene, near, 2).trajectory
    return hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal), guess)


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


@pytest.mark.parametrize("scene", [ACROBOT, CART_POLE, PENDUBOT])
def test_a_passive_joint_takes_no_torque_at_the_quadrature_points(scene: str) -> None:
    solution = swing_up(scene, 40, 2)
    assert solution.status is hovi.Status.MINIMUM
    assert solution.n_neg == 0
    problem = solution.problem
    residuals = ActionObjective(problem).residuals(solution.trajectory.path)
    assert residuals.torque_share < 1e-9
    assert max(np.max(np.abs(tau)) for tau in residuals.torque) > 0.0  # measured, not masked


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


def test_the_simulated_cart_pole_deviates_by_the_order_of_the_scheme() -> None:
    """Collocation at s Gauss points has a local error of h^(2 s + 1)."""
    misses = [miss(swing_up(CART_POLE, N, 1, near=40)) for N in (20, 40, 80)]
    slopes = np.log2(np.divide(misses[:-1], misses[1:]))
    assert np.all(slopes > 5.7)
    assert misses[-1] < 1e-8


def test_the_momenta_of_a_passive_motion_agree_on_both_sides_of_a_node() -> None:
    """The discrete Euler-Lagrange equations hold with the multipliers' terms in L_d."""
    solution = swing_up(CART_POLE, 40, 2)
    problem = solution.problem
    d = problem.ld.derivatives(solution.trajectory.path, solution.forces)
    jump = d[1:, :2] + d[:-1, 2:]
    assert np.max(np.abs(jump)) < 1e-6 * np.max(np.abs(d))
    without = problem.ld.derivatives(solution.trajectory.path)
    assert np.max(np.abs(without[1:, :2] + without[:-1, 2:])) > 1e-2 * np.max(np.abs(d))


def test_the_hamiltonian_of_a_passive_motion_is_constant_at_its_nodes() -> None:
    """With p~ = M (R tau + lambda), the torque and the multiplier at a node are M^-1 p~."""
    solution = swing_up(CART_POLE, 80, 2, near=40)
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


def test_an_underactuated_motion_keeps_its_limits() -> None:
    task = hovi.load_task(hovi.example(CART_POLE))
    limits = {"q": {"slide": [-0.1, 1.1]}}
    solution = hovi.plan(
        task.scene, task.start, task.goal, task.duration, intervals=40, limits=limits
    )
    assert solution.success, solution.message
    slide = solution.trajectory.sample(np.linspace(0, task.duration, 2000)).q[:, 0]
    assert slide.min() > -0.1 - 2e-6
    assert slide.max() < 1.1 + 2e-6
    assert ActionObjective(solution.problem).residuals(solution.trajectory.path).torque_share < 1e-8


def test_a_pole_held_where_it_would_fall_is_infeasible(models) -> None:
    robot = hovi.load_robot(models / "cart_pole.urdf")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=["hinge"])
    limits = {"q": {"slide": [-0.01, 0.01]}}
    solution = hovi.plan(scene, [0.0, 1.0], [0.0, 1.0], 2.0, limits=limits, max_iterations=60)
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


def test_a_residual_torque_is_reported_where_there_are_no_conditions() -> None:
    solution = swing_up("acrobot_swing_up", 12, 0)
    assert solution.problem is not None
    left = Residuals([np.full((3, 1), 1e-5)], [], 1.0)
    sentence = unmet_sentence(solution.problem, solution.trajectory.path, left)
    assert "the remaining torque is 1e-05 of the largest" in sentence
