"""solve: minima against independent solvers, saddles reported as such, no false success."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi import Solution, Status, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import check_path, regularized
from hovi.discrete.interval_batch import CHUNK
from hovi.discrete.state import State
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import PointTerms
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from hovi.system.deadline import Deadline, OutOfTimeError
from oracles.dense_action import DenseAction
from oracles.finite_differences import derivative
from oracles.ipopt_oracle import least_action
from samples.joint_lagrangian import JointLagrangian
from samples.paper_arm import HANG, REACH_COST, REACH_Q, REACH_V, REST, extremal

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Counted(JointLagrangian):
    """1/2 |a|^2 + 1/4 sum a_i^4, whose Hessians are counted."""

    hessians: ClassVar[int] = 0

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        return np.asarray(np.sum(jet[2] ** 2 / 2 + jet[2] ** 4 / 4, axis=1))

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        Counted.hessians += 1
        (P, n), a = jet[2].shape, jet[2]
        gradient, hessian = np.zeros((P, 3, n)), np.zeros((P, 3, n, 3, n))
        gradient[:, 2] = a + a**3
        hessian[:, 2, range(n), 2, range(n)] = 1 + 3 * a**2
        return self.value(*jet), gradient, hessian

    def gradient(
        self, *jet: Array, t: Array | None = None, terms: PointTerms | None = None
    ) -> Array:
        a = jet[2]
        return np.stack([0 * a, 0 * a, a + a**3], axis=1)


START, GOAL = State(HANG), State(REACH_Q, REACH_V)


def problem_on(
    scene: Scene,
    start: State = START,
    goal: State = GOAL,
    *,
    duration: float = 1.0,
    intervals: int = 32,
    scheme: str = "galerkin-2",
    grid: Grid | None = None,
) -> TrajectoryProblem:
    grid = Grid.uniform(duration, intervals, by_name(scheme)) if grid is None else grid
    return TrajectoryProblem(DiscreteLagrangian(scene.effort_lagrangian(), grid), start, goal)


@pytest.fixture(scope="module")
def reach(arm_scene: Scene) -> Solution:
    return solve(problem_on(arm_scene))


@pytest.fixture(scope="module")
def saddle(arm_scene: Scene) -> DiscretePath:
    """The stationary path near the cubic one."""
    found = solve(problem_on(arm_scene), seek="stationary")
    assert found.success, found.message
    return found.trajectory.path


def assert_fits(problem: TrajectoryProblem, solution: Solution) -> None:
    """The motion meets its ends to the last bit, and q, v and z are consistent."""
    path = solution.trajectory.path
    (q0, q1), (v0, v1) = problem.ends
    for found, end in zip((path.q[0], path.v[0], path.q[-1], path.v[-1]), (q0, v0, q1, v1)):  # noqa: B905
        np.testing.assert_array_equal(found, end)
    z = regularized(problem.robot, problem.grid, path.q, path.v)
    slack = 1e-13 * np.abs(path.q).max() / problem.grid.steps.min() ** 2 + 1e-9 * np.abs(z).max()
    np.testing.assert_allclose(path.z, z, rtol=0, atol=slack)
    assert solution.cost == pytest.approx(problem.ld.action(path), rel=1e-13, abs=1e-25)


def least(problem: TrajectoryProblem, *guess: object, **options: object) -> Solution:
    """A minimum of the discrete action, whether or not the grid resolves the motion."""
    found = solve(problem, *guess, **options)
    assert found.status in ("minimum", "unresolved"), found.message
    assert found.n_neg == 0
    return found


def assert_stationary(problem: TrajectoryProblem, solution: Solution, tolerance: float) -> None:
    """D1(k) + D3(k-1) = 0 and D2(k) + D4(k-1) = 0, and the inner modes are extremal."""
    D = problem.ld.derivatives(solution.trajectory.path)
    scale = np.abs(D).max(axis=(0, 2))  # of each of D1 .. D4
    residual = D[1:, :2] + D[:-1, 2:]
    np.testing.assert_allclose(residual / scale[:2, None], 0.0, rtol=0, atol=tolerance)
    gradient = problem.ld.expand(solution.trajectory.path, "nodal").gradient
    scale = np.abs(gradient[:, :4]).max()
    np.testing.assert_allclose(gradient[:, 4:] / scale, 0.0, rtol=0, atol=tolerance)


# The reach, against independent solvers


def test_the_reach_is_the_known_minimum(arm_scene: Scene, reach: Solution) -> None:
    problem = problem_on(arm_scene)
    assert reach.success
    assert reach.status is Status.MINIMUM
    assert reach.cost == pytest.approx(REACH_COST, rel=1e-9)
    assert reach.n_neg == 0
    assert reach.nit <= 15
    assert reach.minima == (reach.cost,)
    assert_fits(problem, reach)
    assert_stationary(problem, reach, 1e-10)


def test_the_reach_solves_pontryagins_equations(reach: Solution) -> None:
    motion = reach.trajectory
    guess = np.hstack([motion.q, motion.v, motion.momenta[:, 0], motion.momenta[:, 1]]).T
    truth = extremal((HANG, REST, REACH_Q, REACH_V), 1.0, (motion.t, guess), 1e-6)
    assert reach.cost == pytest.approx(truth.cost, rel=1e-8)
    found = motion.q, motion.v, motion.momenta[:, 0], motion.momenta[:, 1]
    for ours, theirs in zip(found, truth.at(motion.t), strict=True):
        scale = np.abs(theirs).max()
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * scale)


def test_a_reach_in_a_millisecond_solves_pontryagins_equations(arm_scene: Scene) -> None:
    T = 1e-3
    problem = problem_on(arm_scene, duration=T)
    fast = solve(problem)
    assert fast.status is Status.MINIMUM
    assert fast.n_neg == 0
    assert fast.cost == pytest.approx(3.13597e10, rel=1e-5)
    assert_fits(problem, fast)
    assert_stationary(problem, fast, 1e-10)
    motion = fast.trajectory
    guess = np.hstack([motion.q, motion.v, motion.momenta[:, 0], motion.momenta[:, 1]]).T
    truth = extremal((HANG, REST, REACH_Q, REACH_V), T, (motion.t, guess), 1e-5)
    assert fast.cost == pytest.approx(truth.cost, rel=1e-7)
    for ours, theirs in zip((motion.q, motion.v), truth.at(motion.t)[:2], strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())


@pytest.mark.parametrize("name", ["two_link_reach", "ur5_reach", "panda_reach"])
def test_ipopt_finds_the_same_minimum(name: str) -> None:
    task = load_task(example(name))
    problem = problem_on(
        task.scene,
        task.start,
        task.goal,
        duration=task.duration,
        intervals=8,
        scheme=task.options.scheme,
    )
    solution = least(problem)
    cost, nodes = least_action(problem, solution.trajectory.path)
    assert solution.cost == pytest.approx(cost, rel=1e-7)
    ours = np.hstack([solution.trajectory.q, solution.trajectory.v])[1:-1]
    np.testing.assert_allclose(ours, nodes, rtol=0, atol=1e-5 * np.abs(ours).max())


def test_pontryagins_hamiltonian_is_constant(arm_scene: Scene, reach: Solution) -> None:
    # H = p.v + p~.a - L with a from p~ = dL/da = M tau
    motion = reach.trajectory
    (p, pt), functions = motion.momenta.transpose(1, 0, 2), casadi_functions(arm_scene.model)
    M = np.stack([functions.mass_matrix(q).full() for q in motion.q])
    tau = np.linalg.solve(M, pt[:, :, None])[:, :, 0]
    drift = arm_scene.inverse_dynamics(motion.q, motion.v, 0 * motion.v)
    a = np.linalg.solve(M, (tau - drift)[:, :, None])[:, :, 0]
    H = np.sum(p * motion.v + pt * a - tau**2 / 2, axis=1)
    np.testing.assert_allclose(H, H[0], rtol=1e-6)
    assert H[0] == pytest.approx(55.452, abs=1e-3)


def test_momenta_are_the_derivatives_of_the_least_cost(arm_scene: Scene) -> None:
    base = problem_on(arm_scene, intervals=6)
    origin = solve(base)

    def least_cost(x: Array) -> Array:
        moved = base.between(State(x[0], x[1]), State(x[2], x[3]))
        return np.array(solve(moved, origin.trajectory).cost)

    found = derivative(least_cost, np.stack([HANG, REST, REACH_Q, REACH_V]), step=3e-3)
    p = origin.trajectory.momenta
    expected = np.stack([-p[0, 0], -p[0, 1], p[-1, 0], p[-1, 1]])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_nodes_and_momenta_do_not_depend_on_the_algebra(arm_scene: Scene) -> None:
    # more than a thousand intervals are merged in pairs, fewer use a banded matrix
    few, many = (
        solve(problem_on(arm_scene, intervals=N, scheme="galerkin-1")) for N in (505, 1010)
    )
    assert few.status is many.status is Status.MINIMUM
    assert few.cost == pytest.approx(REACH_COST, rel=1e-10)
    assert many.cost == pytest.approx(few.cost, rel=1e-13)
    for name in ("q", "v", "momenta"):
        one, other = getattr(few.trajectory, name), getattr(many.trajectory, name)[::2]
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8 * np.abs(one).max())


# Grids


@pytest.mark.parametrize("kind", ["alternating", "growing", "random"])
def test_a_grid_of_unequal_steps_has_the_same_minimum(arm_scene: Scene, kind: str) -> None:
    N = 32
    shares = {
        "alternating": np.tile([1.0, 3.0], N // 2),
        "growing": np.linspace(1.0, 3.0, N),
        "random": np.random.default_rng(0).uniform(0.5, 1.5, N),
    }[kind]
    grid = Grid(shares / shares.sum(), (by_name("galerkin-3"),) * N)
    problem = problem_on(arm_scene, grid=grid)
    solution = solve(problem)
    assert_fits(problem, solution)
    assert_stationary(problem, solution, 1e-9)
    assert solution.status is Status.MINIMUM
    assert solution.cost == pytest.approx(REACH_COST, rel=1e-6)


def test_intervals_of_different_schemes_are_solved_together(arm_scene: Scene) -> None:
    names = ["galerkin-2", "galerkin-3", "galerkin-1", "galerkin-4"] * 8
    grid = Grid(np.full(32, 1 / 32), tuple(by_name(name) for name in names))
    problem = problem_on(arm_scene, grid=grid)
    solution = solve(problem)
    assert_fits(problem, solution)
    assert_stationary(problem, solution, 1e-9)
    assert solution.cost == pytest.approx(REACH_COST, rel=1e-5)


@pytest.mark.parametrize(
    "scheme", ["taylor-midpoint", "hermite-simpson", "galerkin-0", "galerkin-3"]
)
@pytest.mark.parametrize("intervals", [1, 2, 3])
def test_a_few_intervals_suffice(arm_scene: Scene, scheme: str, intervals: int) -> None:
    problem = problem_on(arm_scene, intervals=intervals, scheme=scheme)
    solution = least(problem)
    assert_fits(problem, solution)
    if intervals > 1 or scheme == "galerkin-3":
        gradient = problem.ld.expand(solution.trajectory.path).gradient
        np.testing.assert_allclose(gradient[:, 4:], 0.0, atol=1e-8 * np.abs(gradient).max())


# Saddles


def test_the_stationary_motion_near_the_cubic_is_a_saddle(
    arm_scene: Scene, saddle: DiscretePath
) -> None:
    problem = problem_on(arm_scene)
    solution = solve(problem, saddle, escape_saddles=False)
    assert not solution.success
    assert solution.status is Status.SADDLE
    assert solution.cost == pytest.approx(44.8177, abs=1e-3)
    assert solution.n_neg == 2
    assert solution.minima == ()
    assert "2 directions of negative curvature" in solution.message
    assert_stationary(problem, solution, 1e-9)


def test_the_saddle_is_left_unless_escape_saddles_is_false(
    arm_scene: Scene, saddle: DiscretePath
) -> None:
    problem = problem_on(arm_scene)
    solution = solve(problem, saddle)
    assert solution.status is Status.MINIMUM
    assert solution.n_neg == 0
    assert solution.cost < 44.0
    assert "A saddle of cost 44.817" in solution.message
    assert_stationary(problem, solution, 1e-9)


def test_holding_the_arm_horizontal_is_a_saddle_that_is_left(arm_scene: Scene) -> None:
    level = State(REST)
    problem = problem_on(arm_scene, level, level, duration=10.0, intervals=64)
    held = solve(problem, escape_saddles=False)
    assert held.status is Status.SADDLE
    assert held.cost == pytest.approx(300.59, abs=0.01)
    assert held.n_neg == 25
    left = solve(problem)
    assert left.success, left.message
    assert left.n_neg == 0
    assert left.cost < 100.0
    assert "A saddle of cost 300.59" in left.message
    assert_fits(problem, left)
    assert_stationary(problem, left, 1e-8)


@pytest.mark.parametrize("duration", [1.0, 5.0, 10.0])
def test_swing_ups_end_in_minima(arm_scene: Scene, duration: float) -> None:
    problem = problem_on(arm_scene, START, State(-HANG), duration=duration)
    solution = least(problem)
    assert solution.success or duration == 10.0
    assert solution.cost < {1.0: 163.0, 5.0: 5.0, 10.0: 2.5}[duration]
    assert_fits(problem, solution)
    assert_stationary(problem, solution, 1e-8)


def test_random_motions_are_minima_or_report_failure(two_link: Robot, pendulum: Robot) -> None:
    for robot in (pendulum, two_link):
        scene = Scene(robot, [Gravity()])
        for seed in range(15):
            random = np.random.default_rng(seed)
            q0, v0, q1, v1 = random.normal(size=(4, robot.nv)) * 2
            problem = problem_on(
                scene,
                State(q0, v0),
                State(q1, v1),
                duration=float(10 ** random.uniform(-2, 1)),
                intervals=16,
            )
            solution = least(problem)
            assert_fits(problem, solution)
            assert solution.success == (solution.status is Status.MINIMUM)
            assert_stationary(problem, solution, 1e-7)


# Motions that cost nothing


@pytest.mark.parametrize("scheme", ["taylor-midpoint", "galerkin-0", "galerkin-2"])
def test_staying_at_rest_is_a_success_in_one_step(arm_scene: Scene, scheme: str) -> None:
    solution = solve(problem_on(arm_scene, START, START, duration=3.0, scheme=scheme))
    assert solution.status is Status.MINIMUM
    assert solution.nit <= 1
    assert solution.cost == pytest.approx(0.0, abs=1e-25)
    assert solution.n_neg == 0


def test_without_gravity_a_turning_joint_needs_no_torque(pendulum: Robot) -> None:
    problem = problem_on(Scene(pendulum), State([0.0], [2.0]), State([6.0], [2.0]), duration=3.0)
    solution = solve(problem)
    assert solution.status is Status.MINIMUM
    assert solution.cost == pytest.approx(0.0, abs=1e-20)
    np.testing.assert_allclose(solution.trajectory.q[:, 0], 2 * solution.trajectory.t, atol=1e-13)


def test_one_joint_without_gravity_moves_by_the_cubic(pendulum: Robot) -> None:
    # tau = J a: the least effort is J^2 times the spline's
    problem = problem_on(
        Scene(pendulum), State([0.0], [1.0]), State([2.0]), duration=2.0, intervals=5
    )
    solution = solve(problem)
    J = 1.0 + 1.6e-4  # m l^2 and the bob's own 2/5 m r^2
    T, d, v0 = 2.0, 2.0, 1.0
    spline = 6 * d**2 / T**3 - 6 * d * v0 / T**2 + 2 * v0**2 / T
    assert solution.cost == pytest.approx(J**2 * spline, rel=1e-12)
    assert solution.nit <= 2


# Budgets and bad guesses


def test_the_iteration_limit_gives_the_best_so_far(arm_scene: Scene) -> None:
    problem = problem_on(arm_scene)
    costs = [solve(problem, max_iterations=k).cost for k in (1, 2, 4)]
    assert costs == sorted(costs, reverse=True)
    stopped = solve(problem, max_iterations=2)
    assert (stopped.success, stopped.status) == (False, Status.ITERATION_LIMIT)
    assert stopped.nit == len(stopped.history) == 2
    assert "iteration limit was reached after 2 steps" in stopped.message
    assert stopped.minima == ()
    assert_fits(problem, stopped)


KINDS = ("plain", "limited", "constrained")


def problem_of(kind: str, scene: Scene) -> TrajectoryProblem:
    problem = problem_on(scene, goal=State(REACH_Q))
    if kind == "limited":
        return dataclasses.replace(problem, limits=as_limits(scene.robot, {"tau": 400.0}))
    return problem if kind == "plain" else dataclasses.replace(problem, via=(HALFWAY,))


HALFWAY = Via(0.5, State(REACH_Q))


@pytest.mark.parametrize("kind", KINDS)
def test_a_deadline_of_the_caller_ends_a_solve(arm_scene: Scene, kind: str) -> None:
    problem = problem_of(kind, arm_scene)
    with Deadline(-1.0).in_force():
        late = solve(problem)
    assert (late.success, late.status, late.nit) == (False, Status.TIME_LIMIT, 0)
    assert "the time limit was reached" in late.message
    assert_fits(problem, late)
    assert solve(problem).success


@pytest.mark.parametrize("kind", KINDS)
def test_a_time_limit_ends_a_solve_between_two_steps(arm_scene: Scene, kind: str) -> None:
    problem, limit = problem_of(kind, arm_scene), 1.0

    def wait(step: int, cost: float) -> None:
        if step == 2:
            time.sleep(limit)

    late = solve(problem, time_limit=limit, report=wait)
    assert (late.success, late.status) == (False, Status.TIME_LIMIT)
    assert late.nit <= 2
    assert_fits(problem, late)


def test_a_deadline_ends_an_evaluation_of_many_intervals(arm_scene: Scene) -> None:
    several, one = problem_on(arm_scene, intervals=CHUNK + 1), problem_on(arm_scene)
    with Deadline(-1.0).in_force():
        with pytest.raises(OutOfTimeError):
            several.ld.expand(several.guess("cubic"))
        one.ld.expand(one.guess("cubic"))


def test_another_newton_step_changes_nothing(arm_scene: Scene) -> None:
    robot = load_robot("kinova")
    goal = robot.integrate(robot.neutral(), np.array([0.5, 0.3, -0.2, 2.0, 0.4, -1.0]))
    wound = State(goal, turns={"j2s6s200_joint_6": 1})
    ends, scene = (State(robot.neutral()), wound), Scene(robot, [Gravity()])
    for problem in (problem_on(arm_scene), problem_on(scene, *ends, duration=2.0, intervals=8)):
        solution = least(problem)
        assert DenseAction(problem, solution.trajectory.path).newton_step() <= 1e-11
        assert solution.nit == len(solution.history)
        assert solve(problem, max_iterations=solution.nit - 1).nit == solution.nit - 1


def test_the_time_limit_gives_the_best_so_far(arm_scene: Scene) -> None:
    problem = problem_on(arm_scene)
    stopped = solve(problem, time_limit=0.0)
    assert (stopped.success, stopped.status) == (False, Status.TIME_LIMIT)
    assert stopped.cost == pytest.approx(problem.ld.action(problem.guess("cubic")))
    assert "time limit was reached" in stopped.message
    assert_fits(problem, stopped)


@pytest.mark.parametrize("kind", KINDS)
def test_an_interrupt_gives_the_best_so_far(arm_scene: Scene, kind: str) -> None:
    def report(step: int, cost: float) -> None:
        if step == 3:
            raise KeyboardInterrupt

    problem = problem_of(kind, arm_scene)
    stopped = solve(problem, report=report)
    assert (stopped.success, stopped.status) == (False, Status.INTERRUPTED)
    assert stopped.nit <= 3
    assert kind == "constrained" or stopped.cost <= problem.ld.action(problem.guess("cubic"))
    assert_fits(problem, stopped)


def test_a_guess_of_infinite_cost_is_diverged_with_joint_and_time(arm_scene: Scene) -> None:
    problem = problem_on(arm_scene)
    path = problem.guess("cubic")
    inner = path.inner.copy()
    inner[3] = 1e200
    with np.errstate(over="ignore", invalid="ignore"):
        solution = solve(problem, dataclasses.replace(path, inner=inner))
    assert (solution.success, solution.status) == (False, Status.DIVERGED)
    assert "try another initial guess" in solution.message
    assert "the torque of joint 'shoulder' is nan at t = 0.09" in solution.message
    assert "(interval 3)" in solution.message
    inner[3] = 1e308
    with np.errstate(over="ignore", invalid="ignore"):
        solution = solve(problem, dataclasses.replace(path, inner=inner))
    assert "the acceleration of joint 'shoulder' is -inf at t = 0.11" in solution.message


@pytest.mark.parametrize("guess", ["cubic", "minimum-jerk"])
def test_named_guesses_lead_to_minima(arm_scene: Scene, guess: str) -> None:
    solution = solve(problem_on(arm_scene), guess)
    assert solution.status is Status.MINIMUM
    assert solution.cost == pytest.approx(REACH_COST, rel=1e-9)


def test_a_motion_on_another_grid_is_a_guess(arm_scene: Scene, reach: Solution) -> None:
    solution = solve(problem_on(arm_scene, intervals=48, scheme="galerkin-3"), reach.trajectory)
    assert solution.nit <= 3
    assert solution.cost == pytest.approx(REACH_COST, rel=1e-9)
    slower = solve(problem_on(arm_scene, duration=1.05), reach.trajectory)
    assert slower.status is Status.MINIMUM
    assert slower.cost < REACH_COST


def test_a_path_is_a_guess_on_its_own_grid_only(arm_scene: Scene, reach: Solution) -> None:
    again = solve(problem_on(arm_scene), reach.trajectory.path)
    assert again.nit <= 1
    assert again.cost == pytest.approx(reach.cost, rel=1e-13)
    with pytest.raises(
        InputError, match=r"shape \(17, 2\), got \(33, 2\).*Trajectory to change grids"
    ):
        solve(problem_on(arm_scene, intervals=16), reach.trajectory.path)


@pytest.mark.parametrize("scheme", ["galerkin-1", "galerkin-3"])
def test_a_path_with_other_inner_modes_is_refused(
    arm_scene: Scene, reach: Solution, scheme: str
) -> None:
    with pytest.raises(InputError, match="guess's inner must be"):
        solve(problem_on(arm_scene, scheme=scheme), reach.trajectory.path)


@pytest.mark.parametrize("name", ["q", "v", "z", "inner"])
def test_a_path_that_is_not_finite_is_refused(arm_scene: Scene, reach: Solution, name: str) -> None:
    broken = getattr(reach.trajectory.path, name).copy()
    broken[2] = np.nan
    with pytest.raises(InputError, match=f"guess's {name} must be finite"):
        solve(problem_on(arm_scene), dataclasses.replace(reach.trajectory.path, **{name: broken}))


def test_a_path_between_other_ends_is_moved_to_them(arm_scene: Scene, reach: Solution) -> None:
    goal = State(REACH_Q + 0.1, REACH_V)
    problem = problem_on(arm_scene, START, goal)
    solution = solve(problem, reach.trajectory.path)
    assert solution.status is Status.MINIMUM
    assert_fits(problem, solution)


def test_an_inconsistent_path_is_refused(arm_scene: Scene, reach: Solution) -> None:
    path = reach.trajectory.path
    with pytest.raises(InputError, match="guess's z does not match its q and v"):
        solve(problem_on(arm_scene), dataclasses.replace(path, z=path.z + 1.0))


def test_a_motion_of_another_robot_is_no_guess(pendulum: Robot, reach: Solution) -> None:
    problem = problem_on(Scene(pendulum), State([0.0]), State([1.0]))
    with pytest.raises(InputError, match="has 2 velocities, but robot 'pendulum' has 1"):
        solve(problem, reach.trajectory)


def test_an_unknown_guess_is_refused(arm_scene: Scene) -> None:
    with pytest.raises(InputError, match="no guess 'cubik': did you mean 'cubic'"):
        solve(problem_on(arm_scene), "cubik")


# The solution


def test_the_same_input_gives_the_same_bytes(arm_scene: Scene) -> None:
    runs = [solve(problem_on(Scene(arm_scene.robot, [Gravity(9.8)]))) for _ in range(2)]
    assert runs[0].cost == runs[1].cost
    assert runs[0].history == runs[1].history
    for name in ("q", "v", "z", "inner"):
        one, other = (getattr(run.trajectory.path, name) for run in runs)
        assert one.tobytes() == other.tobytes()
    assert runs[0].trajectory.momenta.tobytes() == runs[1].trajectory.momenta.tobytes()


def test_the_trajectory_holds_its_momenta_scene_and_metadata(
    arm_scene: Scene, reach: Solution
) -> None:
    motion = reach.trajectory
    assert motion.scene is arm_scene
    expected = {"cost": reach.cost, "status": "minimum", "n_neg": 0}
    assert expected.items() <= dict(motion.metadata).items()
    evaluated = problem_on(arm_scene).ld.momenta(motion.path)
    atol = 1e-12 * np.abs(evaluated).max()
    np.testing.assert_allclose(motion.momenta, evaluated, rtol=0, atol=atol)
    assert len(reach.history) == reach.nit
    assert reach.error_estimate is not None
    assert 0 < reach.error_estimate < 1e-6
    assert reach.setup_seconds >= 0
    assert reach.solve_seconds >= 0


def test_every_step_is_reported(arm_scene: Scene) -> None:
    reports: list[tuple[int, float]] = []
    solution = solve(problem_on(arm_scene), report=lambda k, cost: reports.append((k, cost)))
    assert [k for k, _ in reports] == list(range(1, solution.nit + 1))
    assert (np.diff([cost for _, cost in reports]) <= 1e-12).all()


def test_a_heavier_weight_costs_in_proportion(arm_scene: Scene, reach: Solution) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian([4.0, 4.0]), reach.trajectory.grid)
    solution = solve(TrajectoryProblem(ld, START, GOAL))
    assert solution.cost == pytest.approx(4 * reach.cost, rel=1e-12)
    np.testing.assert_allclose(solution.trajectory.q, reach.trajectory.q, atol=1e-9)


# Replanning


def test_replanning_finds_the_minimum_between_other_states(
    arm_scene: Scene, reach: Solution
) -> None:
    goal = State(REACH_Q + 0.02, REACH_V - 0.01)
    again = reach.replan(goal=goal)
    problem = problem_on(arm_scene, START, goal)
    fresh = solve(problem)
    assert again.status is Status.MINIMUM
    assert_fits(problem, again)
    assert again.cost == pytest.approx(fresh.cost, rel=1e-12)
    np.testing.assert_allclose(again.trajectory.q, fresh.trajectory.q, rtol=0, atol=1e-9)
    assert again.nit <= fresh.nit


def test_replanning_with_nothing_changed_is_the_same_motion(reach: Solution) -> None:
    again = reach.replan()
    assert again.cost == pytest.approx(reach.cost, rel=1e-14)
    np.testing.assert_allclose(again.trajectory.q, reach.trajectory.q, rtol=0, atol=1e-12)


def test_replanning_can_be_chained_from_configurations(reach: Solution) -> None:
    motion = reach
    for k in range(5):
        motion = motion.replan(start=HANG + 0.05 * (k + 1), goal=State(REACH_Q, REACH_V))
        assert motion.status is Status.MINIMUM
        assert motion.problem is not None
        assert_fits(motion.problem, motion)
    np.testing.assert_array_equal(motion.trajectory.v[0], 0.0)


def test_a_solution_without_its_problem_cannot_replan(reach: Solution) -> None:
    with pytest.raises(InputError, match="has no problem"):
        dataclasses.replace(reach, problem=None).replan()


def warm_start(origin: Solution, start: State, goal: State) -> Solution:
    """What a replan begins with: it counts as one step."""
    ahead = origin.replan(start, goal, max_iterations=0)
    assert (ahead.status, ahead.nit) == (Status.ITERATION_LIMIT, 1)
    assert ahead.problem is not None
    check_path(ahead.trajectory.path, ahead.problem.grid, ahead.problem.robot)
    return ahead


@pytest.mark.parametrize("intervals", [32, 1200])  # in nodal and in regularized coordinates
def test_a_warm_start_follows_the_ends_to_first_order(arm_scene: Scene, intervals: int) -> None:
    reach = solve(problem_on(arm_scene, intervals=intervals))
    errors, sizes = [], np.array([0.06, 0.02])
    for size in sizes:
        ends = State(HANG - size, REST + size), State(REACH_Q + size, REACH_V - size)
        ahead = warm_start(reach, *ends).trajectory
        truth = reach.replan(*ends).trajectory
        errors.append(np.abs(ahead.q - truth.q).max())
    order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.3)


def test_a_warm_start_on_another_grid_is_as_good(arm_scene: Scene, reach: Solution) -> None:
    """What is known of the last grid is not used there."""
    finer = solve(problem_on(arm_scene, intervals=64))
    goal = State(REACH_Q + 0.02, REACH_V)
    ahead = warm_start(finer, START, goal).trajectory
    other = finer.replan(START, goal, guess=solve(problem_on(arm_scene, intervals=64)))
    np.testing.assert_allclose(ahead.q, other.trajectory.q, rtol=0, atol=1e-3)


def test_a_goal_does_not_change_with_the_array_that_it_came_from(arm_scene: Scene) -> None:
    goal = REACH_Q + 0.05
    again = solve(problem_on(arm_scene)).replan(goal=goal)
    wanted = goal.copy()
    goal += 1.0
    moved = again.replan(start=State(HANG + 0.01))
    np.testing.assert_array_equal(moved.trajectory.q[-1], wanted)


def test_a_motion_is_replanned_nearby_with_a_single_hessian(arm_scene: Scene) -> None:
    L = Counted(arm_scene)
    ld = DiscreteLagrangian(L, Grid.uniform(1.0, 32, galerkin(2)))
    reach = solve(TrajectoryProblem(ld, START, GOAL))
    assert reach.success, reach.message
    Counted.hessians = 0
    again = reach.replan(goal=State(REACH_Q + 1e-3, REACH_V))
    assert again.status is Status.MINIMUM
    assert Counted.hessians == 1


@pytest.mark.parametrize("intervals", [1, 2, 3])
def test_a_warm_start_moves_both_ends_of_a_few_intervals(arm_scene: Scene, intervals: int) -> None:
    reach = least(problem_on(arm_scene, intervals=intervals, scheme="galerkin-3"))
    ends = State(HANG + 1e-4, REST - 1e-4), State(REACH_Q - 1e-4, REACH_V + 1e-4)
    ahead = warm_start(reach, *ends).trajectory.path
    truth = reach.replan(*ends).trajectory.path
    before = reach.trajectory.path.arrays
    for old, mine, true in zip(before, ahead.arrays, truth.arrays, strict=True):
        np.testing.assert_allclose(mine, true, rtol=0, atol=1e-2 * np.abs(true - old).max())


def test_an_arm_replans_to_a_goal_nearby_in_at_most_five_steps() -> None:
    task = load_task(example("ur5_reach"))
    grid = Grid.uniform(task.duration, 16, by_name("galerkin-2"))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    motion = solve(TrajectoryProblem(ld, task.start, task.goal))
    home = goal = np.asarray(task.goal.q, dtype=float)
    random = np.random.default_rng(1)
    for _ in range(20):
        direction = random.standard_normal(6) + 40 * (home - goal)
        goal = goal + 0.05 * direction / np.linalg.norm(direction)
        motion = motion.replan(goal=goal)
        assert motion.status is Status.MINIMUM
        assert motion.nit <= 5


def test_a_replan_starts_from_the_motion_that_is_given(arm_scene: Scene) -> None:
    """Of two minima, with the elbow on either side, each leads to one of its own kind."""
    task = State([0.9, 1.2]), State([-0.9, 1.2])
    grid = Grid.uniform(2.0, 16, galerkin(2))
    scene = Scene(arm_scene.robot, [Gravity(9.8)])
    problem = TrajectoryProblem(DiscreteLagrangian(scene.effort_lagrangian(), grid), *task)
    t = np.linspace(0.0, 1.0, 17)[:, None]
    found = []
    for bump in (0.0, 2.5):
        path = problem.guess("cubic")
        q = path.q + bump * np.array([1.0, -1.0]) * np.sin(np.pi * t) ** 2
        v = path.v + bump * np.array([1.0, -1.0]) * np.pi / 2 * np.sin(2 * np.pi * t)
        bent = DiscretePath(q, v, regularized(scene.robot, grid, q, v), path.inner)
        found.append(solve(problem, bent))
    one, other = found
    assert one.success
    assert other.success
    assert abs(one.cost - other.cost) > 1e-2 * one.cost
    for origin, guess in ((one, other), (other, one)):
        again = origin.replan(goal=State([-0.89, 1.2]), guess=guess)
        assert abs(again.cost - guess.cost) < 0.1 * abs(one.cost - other.cost)
        unchanged = origin.replan(goal=State([-0.89, 1.2]))
        assert abs(unchanged.cost - origin.cost) < 0.1 * abs(one.cost - other.cost)


@pytest.mark.parametrize("limits", ["none", "urdf"])
@pytest.mark.parametrize("passive", [(), ("elbow",), ("shoulder",)])
def test_an_interval_without_unknowns_is_solved_or_infeasible(
    two_link: Robot, limits: str, passive: tuple[str, ...]
) -> None:
    """One interval without inner modes between fixed ends; the arm hangs at rest, or moves."""
    scene, down = Scene(two_link, [Gravity()], passive=passive), np.array([-np.pi / 2, 0.0])
    once = {"scheme": "taylor-midpoint", "intervals": 1, "limits": limits}
    still = hovi.plan(scene, down, down, 1.0, **once)
    assert still.success, still.message
    assert still.cost < 1e-20
    moved = hovi.plan(scene, down, [0.3, 0.2], 1.0, **once)
    assert moved.status == ("infeasible" if passive else "unresolved")
    if passive:
        assert f"zero torque at passive joint {passive[0]!r}" in moved.message
