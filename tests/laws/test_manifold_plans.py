"""Motions of robots on manifolds: equivalent robots, symmetries, oracles."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import root

from hovi import Solution, plan
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import cubic, with_turns
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Armature, Effect, Gravity
from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import configurations, revolute, rigid_body, with_arm

Array = npt.NDArray[np.float64]


def solved(
    robot: Robot,
    start: State,
    goal: State,
    T: float = 1.0,
    intervals: int = 8,
    scheme: str = "galerkin-2",
    effects: Sequence[Effect] = (),
    guess: str | Trajectory = "cubic",
) -> Solution:
    scene = Scene(robot, effects)
    grid = Grid.uniform(T, intervals, by_name(scheme))
    problem = TrajectoryProblem(DiscreteLagrangian(scene.effort_lagrangian(), grid), start, goal)
    solution = solve_on_grid(problem, guess)
    assert solution.success, solution.message
    return solution


# Continuous joints are revolute joints


CONTINUOUS = {"j2s6s200_joint_1": 0, "j2s6s200_joint_4": 3, "j2s6s200_joint_6": 5}
"""Kinova's continuous joints and their indices in v."""


# Without armature the light wrist makes a landscape in which hundreds of steps are taken.
@pytest.mark.parametrize("armature", [0.0, 0.3])
@pytest.mark.parametrize("T", [1.0, 2.0])
@pytest.mark.parametrize("turns", [(0, 0, 0), (0, 0, 1), (0, 0, -3), (-3, 3, 2)], ids=str)
def test_continuous_joints_move_like_revolute_ones(
    turns: tuple[int, ...], T: float, armature: float
) -> None:
    robot = load_robot("kinova")
    twin = load_robot(revolute(robot.model))
    d = np.array([0.5, 0.3, -0.2, 2.0, 0.4, -1.0])
    start, goal = robot.neutral(), robot.integrate(robot.neutral(), d)
    wound = State(goal, turns=dict(zip(CONTINUOUS, turns, strict=True)))
    d[list(CONTINUOUS.values())] += 2 * np.pi * np.array(turns)
    effects = [Gravity(), Armature(armature)]
    continuous = solved(robot, State(start), wound, T, effects=effects)
    vector = solved(twin, State(np.zeros(6)), State(d), T, effects=effects)
    assert continuous.cost == pytest.approx(vector.cost, rel=1e-10)
    t = np.linspace(0.0, T, 23)
    found, expected = continuous.trajectory.sample(t), vector.trajectory.sample(t)
    q = robot.integrate(start, expected.q)
    errors = robot.difference(q, found.q), found.v - expected.v, found.tau - expected.tau
    for error, size in zip(errors, (expected.q, expected.v, expected.tau), strict=True):
        per_joint = np.abs(error).max(axis=0) / np.abs(size).max(axis=0)
        assert per_joint.max() < 1e-10, per_joint


def test_a_guess_keeps_several_turns_within_one_interval() -> None:
    robot = load_robot("kinova")
    q = robot.neutral()
    turns = np.array([0.0, 0, 0, 0, 0, 4])
    grid, ends = Grid.uniform(1.0, 1, galerkin(2)), (np.stack([q, q]), np.zeros((2, 6)))
    curve = with_turns(cubic(robot, ends, 1.0), robot, 1.0, turns)
    path = path_on_grid(curve, grid, ends, robot)
    np.testing.assert_allclose(path.z[0, 0], 8 * np.pi * (turns > 0), atol=1e-12)


@pytest.mark.parametrize("turns", [1, 5, 20, 60])
def test_a_body_makes_the_requested_turns(turns: int) -> None:
    """About a principal axis, at minimum effort: theta is a cubic, the cost 6 (I theta)^2/T^3."""
    robot, T = rigid_body((0.7, 1.1, 1.6)), 2.0
    q = robot.neutral()
    goal = State(q, turns={"turn": [0, -turns, 0]})
    solution = plan(Scene(robot), q, goal, T, intervals=6, limits="none")
    assert solution.success
    angle = 2 * np.pi * turns
    assert solution.cost == pytest.approx(6 * (1.1 * angle) ** 2 / T**3, rel=1e-9)
    assert solution.problem is not None
    assert solution.problem.ld.turns(solution.trajectory.path).max() < np.pi
    half = solution.trajectory.sample(np.array([T / 2])).v[0]
    np.testing.assert_allclose(half, [0.0, -1.5 * angle / T, 0.0], atol=1e-9 * angle)


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar"])
def test_v_and_a_of_a_guess_with_many_turns_are_derivatives_of_q(base: str) -> None:
    robot = load_robot(with_arm(base))
    q0, q1 = configurations(robot, 2, 3)
    random = np.random.default_rng(8)
    v0, v1 = random.normal(size=(2, robot.nv))
    axis = {"free-flyer": slice(3, 6), "spherical": slice(0, 3), "planar": slice(2, 3)}[base]
    turns = np.zeros(robot.nv)
    turns[axis] = [20.0] if base == "planar" else [4.0, -8.0, 19.0]  # of length 21
    curve = with_turns(cubic(robot, ((q0, q1), (v0, v1)), 1.0), robot, 1.0, turns)
    h, t = 1e-5, np.linspace(0.05, 0.95, 40)
    (qm, vm, _), (_, v, a), (qp, vp, _) = curve(t - h), curve(t), curve(t + h)
    # the error of central differences: h^2 |w|^3 / 6 and less, with |w| up to 200 rad/s
    np.testing.assert_allclose(robot.difference(qm, qp) / (2 * h), v, atol=1e-3)
    np.testing.assert_allclose((vp - vm) / (2 * h), a, rtol=1e-6, atol=1e-1)


def test_invalid_turns_are_refused() -> None:
    robot, free = load_robot("kinova"), load_robot(with_arm("free-flyer"))
    for bad, who, words in (
        ({"j2s6s200_joint_2": 1}, robot, "no joint 'j2s6s200_joint_2' that can make full turns"),
        ({"j2s6s200_joint_1": 0.5}, robot, "takes an integer"),
        ({"j2s6s200_joint_1": 1e300}, robot, "takes an integer, at most 1,000,000 turns"),
        ({"j0": 1}, free, "three numbers of integer length"),
        ({"j0": [0.5, 0.0, 0.0]}, free, "three numbers of integer length"),
    ):
        with pytest.raises(InputError, match=words):
            State(who.neutral(), turns=bad).turns_on(who, "goal")
    for no_joints in ([1], 1, None):
        with pytest.raises(InputError, match="turns are given by joint, such as"):
            State(robot.neutral(), turns=no_joints)  # type: ignore[arg-type]
    np.testing.assert_array_equal(
        State(free.neutral(), turns={"j0": [0, 1, 0]}).turns_on(free, "goal"), np.eye(9)[4]
    )


# The world may be turned and shifted


def test_a_motion_is_invariant_under_rigid_motions_of_the_world() -> None:
    robot = load_robot(with_arm("free-flyer"))
    q0, q1 = configurations(robot, 2, 3, 0.7)
    v0, v1 = 0.3 * np.random.default_rng(1).normal(size=(2, robot.nv))
    here = solved(robot, State(q0, v0), State(q1, v1))
    g = pin.SE3(pin.exp3(np.array([0.3, -1.0, 2.0])), np.array([1.0, 2.0, -0.5]))

    def there(q: Array) -> Array:
        moved = q.copy()
        moved[:7] = pin.SE3ToXYZQUAT(g * pin.XYZQUATToSE3(q[:7]))
        return moved

    shifted = solved(robot, State(there(q0), v0), State(there(q1), v1))
    assert shifted.cost == pytest.approx(here.cost, rel=1e-11)
    back = np.array([there(q) for q in here.trajectory.q])
    np.testing.assert_allclose(robot.difference(back, shifted.trajectory.q), 0.0, atol=1e-8)
    np.testing.assert_allclose(shifted.trajectory.v, here.trajectory.v, atol=1e-7)


# Oracles


def test_a_riemannian_cubic_on_so3_satisfies_its_equation() -> None:
    """For a spherical inertia tau = w', so that the least |w'|^2 obeys w''' = w'' x w."""
    robot = rigid_body([1.0, 1.0, 1.0])
    q1 = robot.integrate(robot.neutral(), np.array([1.0, -0.6, 0.8]))
    v0, v1 = np.array([0.5, 1.0, -0.3]), np.array([-0.4, 0.2, 1.0])

    def equations(t: Array, y: Array) -> Array:
        """(quaternion, w, w', w'') in the body frame."""
        u, s, w, dw, ddw = y[:3], y[3], y[4:7], y[7:10], y[10:13]
        cross = lambda a, b: np.cross(a, b, axis=0)  # noqa: E731
        du = 0.5 * (s * w + cross(u, w))
        return np.vstack([du, -0.5 * np.sum(u * w, axis=0)[None], dw, ddw, cross(ddw, w)])

    solution = solved(robot, State(robot.neutral(), v0), State(q1, v1), intervals=32)
    ends = (robot.neutral(), v0), (q1, v1)
    assert_same_motion(solution, equations, *ends, lambda y: 0.5 * np.sum(y[7:10] ** 2, axis=0))


def test_a_rigid_body_satisfies_pontryagins_equations() -> None:
    """Least |tau|^2 between two orientations: the equations of the costates, by SciPy."""
    inertia = np.array([1.0, 2.0, 3.5])
    robot = rigid_body(inertia)
    q1 = robot.integrate(robot.neutral(), np.array([1.2, -0.5, 0.7]))
    v0, v1 = np.array([0.3, 0.6, -0.2]), np.array([-0.2, 0.1, 0.5])
    I = inertia[:, None]  # noqa: E741

    def equations(t: Array, y: Array) -> Array:
        """(quaternion, w, mu, p): H = mu.w + p.w' - |tau|^2 / 2, I w' = tau - w x I w."""
        u, s, w, mu, p = y[:3], y[3], y[4:7], y[7:10], y[10:13]
        cross = lambda a, b: np.cross(a, b, axis=0)  # noqa: E731
        tau = p / I
        dw = (tau - cross(w, I * w)) / I
        # p' = -dH/dw, mu' = mu x w (left-trivialized)
        x = p / I
        dp = -mu + I * cross(x, w) - cross(x, I * w)
        du = 0.5 * (s * w + cross(u, w))
        return np.vstack([du, -0.5 * np.sum(u * w, axis=0)[None], dw, cross(mu, w), dp])

    solution = solved(robot, State(robot.neutral(), v0), State(q1, v1), intervals=32)
    ends = (robot.neutral(), v0), (q1, v1)
    assert_same_motion(
        solution, equations, *ends, lambda y: 0.5 * np.sum((y[10:] / I) ** 2, axis=0)
    )


def assert_same_motion(
    solution: Solution,
    equations: Callable[[Array, Array], Array],
    state0: tuple[Array, Array],
    state1: tuple[Array, Array],
    density: Callable[[Array], Array],
) -> None:
    """The motion agrees with SciPy's answer to the equations to 1e-8, its cost too.

    By collocation first, then by shooting from where that begins, whose error is smaller.
    """

    def ends(a: Array, b: Array) -> Array:
        parts = (a[:4] - state0[0], a[4:7] - state0[1], b[:3] - state1[0][:3], b[4:7] - state1[1])
        return np.concatenate(parts)

    t = np.linspace(0.0, 1.0, 21)
    sample = solution.trajectory.sample(t)
    guess = np.zeros((13, len(t)))
    guess[:4], guess[4:7] = sample.q.T, sample.v.T
    rough = solve_bvp(equations, ends, t, guess, tol=1e-4, max_nodes=10_000)
    assert rough.success, rough.message

    def shot(y: Array, times: Array | None = None) -> Array:
        y0 = np.concatenate([*state0, y])
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "t_eval": times}
        flow = solve_ivp(lambda s, z: equations(s, z[:, None])[:, 0], (0.0, 1.0), y0, **options)
        return np.asarray(flow.y)

    def miss(y: Array) -> Array:
        end = shot(y)[:, -1]
        return np.concatenate([end[:3] - state1[0][:3], end[4:7] - state1[1]])

    exact = root(miss, rough.y[7:, 0], tol=1e-12)
    assert np.abs(exact.fun).max() < 1e-10
    y = shot(exact.x, t)
    q = y[:4] * np.sign(np.sum(y[:4] * sample.q.T, axis=0))
    np.testing.assert_allclose(sample.q, q.T, atol=1e-8)
    nodes = solution.trajectory
    np.testing.assert_allclose(nodes.v, shot(exact.x, nodes.t)[4:7].T, atol=1e-8)
    x, w = np.polynomial.legendre.leggauss(40)
    cost = 0.5 * w @ density(shot(exact.x, (x + 1) / 2))
    assert solution.cost == pytest.approx(cost, rel=1e-8)


# Orders


def reference_and_errors(
    robot: Robot,
    start: State,
    goal: State,
    T: float,
    schemes: dict[str, list[int]],
    effects: Sequence[Effect],
    intervals: int = 24,
) -> dict[str, Array]:
    """Errors of the nodes' q (by difference) and v and of the cost, (grids, 3) per scheme.

    intervals: of the reference.
    """
    exact = solved(robot, start, goal, T, intervals, "galerkin-4", effects)
    errors = {}
    for name, grids in schemes.items():
        rows = []
        for N in grids:
            found = solved(robot, start, goal, T, N, name, effects, exact.trajectory)
            nodes = exact.trajectory.sample(found.trajectory.t)
            dq = robot.difference(nodes.q, found.trajectory.q)
            dv = found.trajectory.v - nodes.v
            sizes = np.abs(dq).max(), np.abs(dv).max(), abs(found.cost / exact.cost - 1)
            rows.append(sizes)
        errors[name] = np.array(rows)
    return errors


ORDERS = {"galerkin-0": (4, 0.3), "galerkin-1": (6, 0.3), "galerkin-2": (8, 0.5)}


def assert_orders(errors: dict[str, Array], schemes: dict[str, list[int]]) -> None:
    for name, (order, slack) in ORDERS.items():
        ratio = np.log(schemes[name][-1] / schemes[name][-2])
        slopes = np.log(errors[name][-2] / errors[name][-1]) / ratio
        assert np.abs(slopes - order).max() < slack, (name, slopes)


def test_nodes_and_cost_have_their_orders_on_a_free_flyer_with_an_arm() -> None:
    robot = load_robot(with_arm("free-flyer"))
    q0, q1 = configurations(robot, 2, 3, 0.5)
    schemes = {"galerkin-0": [24, 48], "galerkin-1": [24, 48], "galerkin-2": [16, 24]}
    errors = reference_and_errors(robot, State(q0), State(q1), 1.0, schemes, [Gravity()])
    assert_orders(errors, schemes)


def test_nodes_and_cost_have_their_orders_on_kinova() -> None:
    robot = load_robot("kinova")
    q0 = robot.integrate(robot.neutral(), np.array([0.0, 2.5, 2.0, 0.0, 1.0, 0.0]))
    q1 = robot.integrate(q0, np.random.default_rng(2).uniform(-1, 1, 6))
    schemes = {"galerkin-0": [16, 32], "galerkin-1": [16, 24], "galerkin-2": [10, 16]}
    # reflected inertias tame what the light wrist would do otherwise
    effects = [Gravity(), Armature(0.3)]
    errors = reference_and_errors(robot, State(q0), State(q1), 1.0, schemes, effects)
    assert_orders(errors, schemes)


def test_nodes_and_cost_have_their_orders_on_kinova_without_rotors() -> None:
    """The light wrist rotates fast to reduce the other torques, so grids must be fine."""
    robot = load_robot("kinova")
    hangs = robot.integrate(robot.neutral(), np.pi * np.array([0.0, 0.0, 1.0, 0.0, 1.0, 0.0]))
    goal = robot.integrate(hangs, 0.03 * np.random.default_rng(4).uniform(-1, 1, 6))
    schemes = {"galerkin-0": [192, 256], "galerkin-1": [128, 192], "galerkin-2": [96, 128]}
    ends = State(hangs), State(goal)
    assert_orders(reference_and_errors(robot, *ends, 1.0, schemes, [Gravity()], 256), schemes)
