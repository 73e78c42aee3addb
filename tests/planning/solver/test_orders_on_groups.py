"""Boundary value problems of orders other than 2 on groups: mechanics, and splines of angles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.discrete.interval_paths import path_of_order
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin
from oracles.dense_action import DenseAction
from samples.manifold_robots import BASES, chain, configurations, revolute, rigid_body, with_arm

Array = npt.NDArray[np.float64]

MOMENTS = [1.0, 2.0, 3.5]
ANGLES = ConfigurationSpace(("SO(2)", 1, "SO(2)"))
MIXED = ConfigurationSpace(("SE(3)", "SO(2)", 1, "SO(3)", "SE(2)"))


def problem_of(
    lagrangian: Lagrangian,
    T: float,
    start: State,
    goal: State,
    intervals: int = 8,
    modes: int = 4,
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(T, intervals, galerkin(modes, lagrangian.order))
    return hovi.TrajectoryProblem(hovi.DiscreteLagrangian(lagrangian, grid), start, goal)


def solved(*arguments: Any, **rest: Any) -> hovi.Solution:
    found = hovi.solve(problem_of(*arguments, **rest))
    assert found.success, found.message
    assert found.n_neg == 0
    assert found.error_estimate is not None
    assert found.error_estimate < 1e-9
    return found


def forward_dynamics(scene: hovi.Scene, q: Array, v: Array, times: Array) -> tuple[Array, Array]:
    """q and v at times, by DOP853 on (q', v') with Pinocchio's aba and quaternion rates."""
    robot, model = scene.robot, scene.model
    data, symbols = model.createData(), scene.terms.symbols
    rate = ca.Function("rate", [symbols.q, symbols.v], [rate_of(robot, symbols)])

    def rates(t: float, y: Array) -> Array:
        here, v = y[: robot.nq], y[robot.nq :]
        a = pin.aba(model, data, robot.space.normalized(here), v, np.zeros(robot.nv))
        return np.concatenate([rate(here, v).full()[:, 0], a])

    y = solve_ivp(
        rates, (0, times[-1]), [*q, *v], "DOP853", t_eval=times, rtol=3e-14, atol=1e-14
    ).y.T
    return robot.space.normalized(y[:, : robot.nq]), y[:, robot.nq :]


def rate_of(robot: Robot, symbols: Any) -> ca.SX:
    return configuration_rate(robot.model, symbols.q, symbols.v)


def turned_by(axis: Array, angles: Array) -> Array:
    """Unit quaternions of rotations about an axis, (M, 4)."""
    half = np.asarray(angles)[:, None] / 2
    return np.concatenate([np.sin(half) * axis, np.cos(half)], axis=1)


# Mechanics against the equations of motion


def test_a_free_rigid_body_turns_between_two_orientations_as_euler_says() -> None:
    """I w' = (I w) x w, with the orientation's quaternion, by an independent integrator."""
    moments, T = np.array(MOMENTS), 0.9
    w0 = np.array([0.2, 1.6, -0.3])

    def rates(t: float, y: Array) -> Array:
        u, s, w = y[:3], y[3], y[4:]
        turned = 0.5 * np.append(s * w + np.cross(u, w), -u @ w)
        return np.concatenate([turned, np.cross(moments * w, w) / moments])

    t = np.linspace(0.0, T, 31)
    true = solve_ivp(rates, (0, T), [0, 0, 0, 1, *w0], "DOP853", t_eval=t, rtol=1e-13, atol=1e-13)
    lagrangian = hovi.mechanics(hovi.Scene(rigid_body(MOMENTS)))
    found = solved(lagrangian, T, State(true.y[:4, 0]), State(true.y[:4, -1]))
    motion = found.trajectory.sample(t)
    np.testing.assert_allclose(np.abs(np.vecdot(motion.q, true.y[:4].T)), 1.0, atol=1e-12)
    signs = np.sign(np.vecdot(motion.q, true.y[:4].T))[:, None]
    np.testing.assert_allclose(signs * motion.q, true.y[:4].T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.trajectory.momenta[0, 0], moments * w0, atol=1e-10)
    np.testing.assert_allclose(found.trajectory.v[-1], motion.v[-1], rtol=0, atol=1e-13)


@pytest.mark.parametrize("base", BASES)
def test_an_arm_on_any_base_falls_between_two_configurations(base: str) -> None:
    scene = hovi.Scene(hovi.load_robot(with_arm(base)), [hovi.effects.Gravity()])
    robot, t = scene.robot, np.linspace(0.0, 0.3, 13)
    v = 0.6 * np.random.default_rng(4).normal(size=robot.nv)
    q, _ = forward_dynamics(scene, configurations(robot, 1, size=0.4)[0], v, t)
    found = solved(hovi.mechanics(scene), 0.3, State(q[0]), State(q[-1]))
    miss = robot.difference(q, found.trajectory.configurations(t))
    np.testing.assert_allclose(miss, 0.0, rtol=0, atol=1e-9)


def test_the_center_of_mass_of_a_free_robot_moves_on_a_parabola() -> None:
    scene = hovi.Scene(hovi.load_robot(with_arm("free-flyer")), [hovi.effects.Gravity()])
    q = configurations(scene.robot, 2, seed=1, size=0.3)
    found = solved(hovi.mechanics(scene), 0.5, State(q[0]), State(q[1]))
    data, s = scene.model.createData(), np.linspace(0.0, 1.0, 9)
    at = found.trajectory.configurations(0.5 * s)
    centers = np.array([pin.centerOfMass(scene.model, data, each).copy() for each in at])
    fall = 0.5 * 0.25 * np.outer(s**2 - s, scene.model.gravity.linear)
    straight = centers[0] + np.outer(s, centers[-1] - centers[0])
    np.testing.assert_allclose(centers, straight + fall, rtol=0, atol=1e-9)


def test_a_continuous_joint_makes_the_turns_of_its_revolute_twin() -> None:
    model = chain([pin.JointModelRUBX(), pin.JointModelRUBY()])
    turning, plain = (
        hovi.Scene(hovi.load_robot(each), [hovi.effects.Gravity()])
        for each in (model, revolute(model))
    )
    assert turning.robot.nq == 4
    q, T = np.array([[0.1, -0.3], [2 * np.pi + 0.4, 0.2]]), 0.4
    first = solved(hovi.mechanics(plain), T, State(q[0]), State(q[1]), intervals=12)
    places = turning.robot.integrate(turning.robot.neutral(), q)
    goal = State(places[1], turns={"j0": 1})
    second = solved(hovi.mechanics(turning), T, State(places[0]), goal, intervals=12)
    assert second.cost == pytest.approx(first.cost, rel=1e-11)
    t = np.linspace(0.0, T, 21)
    one, two = first.trajectory.sample(t), second.trajectory.sample(t)
    np.testing.assert_allclose(two.q, turning.robot.integrate(turning.robot.neutral(), one.q))
    np.testing.assert_allclose(two.v, one.v, rtol=0, atol=1e-8)


def test_a_body_beyond_its_conjugate_point_is_a_stationary_point_of_positive_index() -> None:
    """A ball that turns by nearly 1.5 turns: its ends are conjugate at every full turn."""
    robot, axis = rigid_body([1.0, 1.0, 1.0]), np.array([0.6, 0.0, 0.8])
    ends = turned_by(axis, np.array([0.0, 3 * np.pi - 0.3]))
    problem = problem_of(hovi.mechanics(hovi.Scene(robot)), 1.0, *map(State, ends), intervals=12)
    s = np.linspace(0.0, 1.0, 13)
    speed = 3 * np.pi - 0.3
    path = problem.path(
        lambda t: (
            turned_by(axis, speed * t),
            np.tile(speed * axis, (len(t), 1)),
            np.zeros((len(t), 3)),
        )
    )
    found = hovi.solve(problem, path, seek="stationary")
    assert found.success, found.message
    assert found.n_neg == 2  # two directions across the axis
    assert found.cost == pytest.approx(speed**2 / 2, rel=1e-12)
    motion = found.trajectory.sample(s)
    np.testing.assert_allclose(motion.v, np.tile(speed * axis, (13, 1)), atol=1e-9)


def test_a_free_end_on_a_group_has_no_momentum() -> None:
    scene = hovi.Scene(hovi.load_robot(with_arm("spherical")), [hovi.effects.Gravity()])
    q = configurations(scene.robot, 2, size=0.3)
    found = solved(hovi.mechanics(scene), 0.2, State(q[0]), State(q[1], free=["j0"]))
    assert np.abs(found.trajectory.momenta[0, 0, :3]).max() > 1e-2
    np.testing.assert_allclose(found.trajectory.momenta[-1, 0, :3], 0.0, atol=1e-10)
    again = hovi.solve(found.problem, found.trajectory)
    assert again.nit <= 1
    np.testing.assert_allclose(again.trajectory.q, found.trajectory.q, rtol=0, atol=1e-9)


# The discrete action


def lagrangian_on(space: ConfigurationSpace, k: int) -> CasadiLagrangian:
    """A Lagrangian with no symmetry."""
    jet = [ca.SX.sym("q", space.nq), *(ca.SX.sym(f"q{j}", space.nv) for j in range(1, k + 1))]
    weights = np.linspace(0.5, 1.5, space.nq)
    L = ca.sin(ca.dot(weights, jet[0])) + ca.dot(jet[0] ** 3, weights)
    L += ca.sumsqr(jet[-1]) * (1.5 + ca.cos(ca.sum1(jet[0]))) + ca.sum1(jet[1] ** 3) / 3
    return CasadiLagrangian(jet, L, space)


@pytest.mark.parametrize(("space", "k"), [(MIXED, 1), (ANGLES, 1), (ANGLES, 3), (ANGLES, 4)])
def test_the_gradient_and_hessian_of_the_action_are_its_derivatives(
    space: ConfigurationSpace, k: int
) -> None:
    """Along random steps, on uneven steps with uneven modes, against central differences."""
    grid = hovi.Grid(np.array([0.5, 0.7, 0.4]), (galerkin(2, k), galerkin(1, k), galerkin(2, k)))
    ld = hovi.DiscreteLagrangian(lagrangian_on(space, k), grid)
    random = np.random.default_rng(k)
    neutral = space.integrate(pin_neutral(space), 0.3 * random.normal(size=space.nv))
    goal = space.integrate(neutral, 0.4 * random.normal(size=space.nv))
    problem = hovi.TrajectoryProblem(ld, State(neutral), State(goal))
    path = problem.guess("cubic")
    random_step = 0.2 * random.normal(size=DenseAction(problem, path).size)
    path = DenseAction(problem, path).moved(random_step)
    dense = DenseAction(problem, path)
    step = random.normal(size=dense.size)

    def action(size: float) -> float:
        return ld.action(dense.moved(size * step))

    small, large = 1e-5, 1e-3
    slope = 8 * (action(small) - action(-small)) - action(2 * small) + action(-2 * small)
    assert slope / (12 * small) == pytest.approx(float(dense.gradient @ step), rel=1e-6)
    np.testing.assert_allclose(dense.along(ld.gradient(path)), dense.gradient, rtol=1e-9)
    bend = (action(large) - 2 * action(0.0) + action(-large)) / large**2
    assert bend == pytest.approx(float(step @ dense.hessian @ step), rel=1e-4)


def pin_neutral(space: ConfigurationSpace) -> Array:
    """A configuration: zeros and unit elements."""
    return space.normalized(np.ones(space.nq))


def test_the_nodes_have_order_2_r_plus_2_on_rotations() -> None:
    robot = rigid_body(MOMENTS)
    L, T = hovi.mechanics(hovi.Scene(robot)), 1.2
    q = configurations(robot, 2, size=0.8)
    ends = State(q[0]), State(q[1])
    true = solved(L, T, *ends, intervals=24, modes=5).trajectory.momenta[0]
    for r, counts in ((0, (24, 48)), (1, (12, 24)), (2, (6, 12))):
        errors = [
            np.abs(hovi.solve(problem_of(L, T, *ends, N, r)).trajectory.momenta[0] - true).max()
            for N in counts
        ]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * (r + 1), abs=0.3)


# Angles, of any order


@pytest.mark.parametrize("k", [1, 3, 4])
def test_splines_of_angles_are_those_of_numbers_with_their_turns(k: int) -> None:
    jet = [ca.SX.sym("q", 5), *(ca.SX.sym(f"q{j}", 3) for j in range(1, k + 1))]
    L = CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2, ANGLES)
    x = np.array([[0.3, 1.0, -2.0], [3.0, -1.0, 2.0]])
    q = np.stack([np.cos(x[:, 0]), np.sin(x[:, 0]), x[:, 1], *trig(x[:, 2])], axis=1)
    rates = {"v": [0.4, 0.1, -2.0]} if k > 1 else {}
    goal = State(q[1], turns={"q[2]": 2}, **rates)  # the shortest way is by 4 - 2 pi rad
    found = solved(L, 1.5, State(q[0]), goal)
    x[1, 2] += 2 * np.pi
    plain = solved(hovi.spline(3, k), 1.5, State(x[0]), State(x[1], **rates))
    assert found.cost == pytest.approx(plain.cost, rel=1e-11)
    t = np.linspace(0.0, 1.5, 17)
    angles, numbers = found.trajectory.jet(t, max(2, k)), plain.trajectory.jet(t, max(2, k))
    for one, other in zip(angles[1:], numbers[1:], strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * max(1, np.abs(other).max()))
    np.testing.assert_allclose(angles[0][:, :2].T, trig(numbers[0][:, 0]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(angles[0][:, 3:].T, trig(numbers[0][:, 2]), rtol=0, atol=1e-12)


def trig(x: Array) -> tuple[Array, Array]:
    return np.cos(x), np.sin(x)


def test_angles_turn_by_more_than_half_a_turn_in_an_interval(tmp_path: Path) -> None:
    jet = [ca.SX.sym("q", 2), *(ca.SX.sym(f"q{j}", 1) for j in (1, 2, 3))]
    L = CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2, ConfigurationSpace(("SO(2)",)))
    goal = State([np.cos(1.0), np.sin(1.0)], turns={"q[0]": 5})
    found = solved(L, 1.0, State([1.0, 0.0]), goal, intervals=3)
    assert found.cost == pytest.approx(360 * (10 * np.pi + 1) ** 2, rel=1e-11)
    found.trajectory.save(tmp_path / "turns.npz")
    loaded = hovi.Trajectory.load(tmp_path / "turns.npz")
    np.testing.assert_allclose(loaded.sample([0.5]).v, [[15 / 8 * (10 * np.pi + 1)]], rtol=1e-11)
    again = hovi.solve(found.problem, loaded)
    assert again.cost == pytest.approx(found.cost, rel=1e-11)


# Files, guesses and refusals


def test_orientations_keep_the_turns_of_their_path() -> None:
    space, axis = ConfigurationSpace(("SO(3)",)), np.array([0.6, 0.0, 0.8])
    q, angle = turned_by(axis, np.array([0.0, 3.6])), np.array([[[3.5 * 0.6, 0.01, 3.5 * 0.8]]])
    steps = np.array([0.5])
    path = path_of_order(1, q, np.zeros((2, 0, 3)), angle / 0.5, np.zeros((1, 0, 3)), steps, space)
    np.testing.assert_allclose(path.z[0, 0], 3.6 / 0.5 * axis, rtol=1e-12)


def test_a_guess_has_the_turns_of_its_goal() -> None:
    axis = np.array([0.0, 0.0, 1.0])
    q = turned_by(axis, np.array([0.0, 0.5]))
    L = hovi.mechanics(hovi.Scene(rigid_body(MOMENTS)))
    path = problem_of(L, 1.0, State(q[0]), State(q[1], turns={"turn": [0, 0, 1]})).guess("cubic")
    np.testing.assert_allclose(path.z[:, 0].sum(axis=0) / 8, (2 * np.pi + 0.5) * axis, atol=1e-12)


def test_a_curve_is_followed_between_the_nodes_of_its_path() -> None:
    """A body that turns about two axes in turn; its path errs by what its polynomials cannot do."""
    L = hovi.mechanics(hovi.Scene(rigid_body(MOMENTS)))
    robot = rigid_body(MOMENTS)

    def curve(t: Array) -> tuple[Array, Array, Array]:
        x = np.stack([t, 0.5 * t**2, np.sin(t)], axis=1)
        dx = np.stack([1 + 0 * t, t, np.cos(t)], axis=1)
        return robot.chart.jet(np.tile(robot.neutral(), (len(t), 1)), x, dx, 0 * x)

    ends = curve(np.array([0.0, 1.0]))[0]
    problem = problem_of(L, 1.0, State(ends[0]), State(ends[1]))
    t = np.linspace(0.0, 1.0, 41)
    motion = problem.trajectory(problem.path(curve))
    miss = robot.difference(curve(t)[0], motion.configurations(t))
    np.testing.assert_allclose(miss, 0.0, rtol=0, atol=1e-9)


@pytest.mark.parametrize("base", ["free-flyer", "continuous"])
def test_motions_are_saved_loaded_replanned_and_certified(base: str, tmp_path: Path) -> None:
    scene = hovi.Scene(hovi.load_robot(with_arm(base)), [hovi.effects.Gravity()])
    q = configurations(scene.robot, 3, size=0.3)
    found = solved(hovi.mechanics(scene), 0.3, State(q[0]), State(q[1]))
    found.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    t = np.linspace(0.0, 0.3, 23)
    for one, other in zip(found.trajectory.jet(t), loaded.jet(t), strict=True):
        np.testing.assert_array_equal(one, other)
    again = found.replan(goal=State(q[2]))
    assert again.success
    np.testing.assert_array_equal(again.trajectory.q[-1], q[2])
    direct = solved(hovi.mechanics(scene), 0.3, State(q[0]), State(q[2]))
    assert again.cost == pytest.approx(direct.cost, rel=1e-10)
    from_file = hovi.solve(again.problem, loaded)
    assert from_file.cost == pytest.approx(direct.cost, rel=1e-10)
    from_path = hovi.solve(again.problem, found.trajectory.path)
    assert from_path.cost == pytest.approx(direct.cost, rel=1e-10)
    certificate = hovi.certify(again)
    assert certificate.residual is not None
    assert certificate.residual < 1e-10


def test_nodes_that_do_not_match_their_intervals_are_refused() -> None:
    scene = hovi.Scene(hovi.load_robot(with_arm("spherical")))
    q = configurations(scene.robot, 2, size=0.3)
    problem = problem_of(hovi.mechanics(scene), 0.3, State(q[0]), State(q[1]))
    path = problem.guess("cubic")
    broken = DiscretePath(path.q, path.v, 1.1 * path.z, path.inner)
    with pytest.raises(InputError, match="does not match its start and z"):
        hovi.solve(problem, broken)


def test_order_3_is_refused_by_name_where_orientations_turn_in_charts() -> None:
    jet = [ca.SX.sym("q", 4), *(ca.SX.sym(f"q{j}", 3) for j in (1, 2, 3))]
    L = CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2, ConfigurationSpace(("SO(3)",)))
    with pytest.raises(InputError, match="order 3 need the third derivatives of charts"):
        problem_of(L, 1.0, State([0.0, 0, 0, 1]), State([1.0, 0, 0, 0]))
