"""Joint minima in the motion and the duration: against solves for given durations."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Armature, Gravity
from hovi.optimize.criteria import Criteria
from hovi.optimize.interior_point import minimize_bounded
from hovi.planning.problem.limits import as_limits, no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.free_duration.joint_solve import solve_jointly, solves_jointly
from hovi.planning.solver.free_duration.timed_bounded_action import TimedBoundedAction
from hovi.planning.solver.free_duration.timed_path import TimedPath, TimePrice
from hovi.planning.solver.limits.limit_rows import MAX_LOSS, LimitRows
from hovi.planning.solver.methods.interior_point import InteriorPoint
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.scene.standard_lagrangians import spline
from hovi.schemes import galerkin

WEIGHT = 20.0
PRICE = TimePrice(WEIGHT, 0.3, 6.0)
TORQUES = {"base": "none", "v": 4.0, "tau": [8.0, 3.0]}


def arm_problem(two_link: hovi.Robot, T: float, ends: str = "at rest") -> TrajectoryProblem:
    scene = hovi.Scene(two_link, [Gravity(9.8), Armature(0.05)])
    start, goal = State([-1.5, 0.0]), State([0.3, 0.7])
    if ends == "moving":
        start, goal = State([-1.5, 0.0], [0.8, -0.6]), State([0.3, 0.7], [0.5, -0.4])
    grid = Grid(T * np.repeat([0.04, 0.06], 10), (galerkin(2),) * 20)
    return TrajectoryProblem(DiscreteLagrangian(scene.effort_lagrangian(), grid), start, goal)


def six_joints(T: float) -> TrajectoryProblem:
    task = hovi.load_task(hovi.example("ur5_reach"))
    ld = DiscreteLagrangian(task.scene.effort_lagrangian(), Grid.uniform(T, 12, galerkin(2)))
    return TrajectoryProblem(ld, task.start, task.goal)


def jointly(problem: TrajectoryProblem, price: TimePrice = PRICE, **options: bool) -> Solution:
    return solve_jointly(problem, problem.guess("cubic"), price, **options)  # type: ignore[arg-type]


def near(found: Solution) -> Callable[[float], float]:
    """J + w T for given durations, each by a solve of its own from the motion found."""

    def total(T: float) -> float:
        assert found.problem is not None
        problem = found.problem.on(found.problem.grid.stretched(T))
        solved = solve_on_grid(problem, found.trajectory)
        assert solved.success
        return solved.cost + WEIGHT * T

    return total


def slope_by_differences(total: Callable[[float], float], T: float) -> float:
    """dS/dT + w by a stencil of sixth order."""
    h = 3e-3 * T
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    return sum(c * (total(T + k * h) - total(T - k * h)) for k, c in weights.items()) / h


@pytest.mark.parametrize("kind", ["at rest", "moving", "six joints"])
def test_the_price_of_time_is_what_differences_of_solved_motions_say(
    two_link: hovi.Robot, kind: str
) -> None:
    problem = six_joints(1.7) if kind == "six joints" else arm_problem(two_link, 1.0, kind)
    found = jointly(problem)
    T = found.trajectory.duration
    assert found.status is Status.MINIMUM, found.message
    assert (found.success, found.n_neg) == (True, 0)
    assert abs(slope_by_differences(near(found), T)) <= 1e-7 * WEIGHT
    assert abs(found.duration_derivative + WEIGHT) <= 1e-10 * WEIGHT
    assert found.problem is not None
    assert found.problem.grid.duration == pytest.approx(T, rel=1e-14)
    assert found.cost == pytest.approx(found.problem.ld.action(found.trajectory.path), rel=1e-13)


@pytest.mark.parametrize("kind", ["at rest", "moving", "six joints"])
def test_the_best_duration_is_that_of_a_scalar_search_around_solves(
    two_link: hovi.Robot, kind: str
) -> None:
    problem = six_joints(1.7) if kind == "six joints" else arm_problem(two_link, 1.0, kind)
    found = jointly(problem)
    T = found.trajectory.duration
    searched = minimize_scalar(
        near(found), bracket=(0.99 * T, 1.001 * T, 1.01 * T), options={"xtol": 1e-9}
    )
    assert pytest.approx(searched.x, rel=1e-6) == T
    assert found.cost + WEIGHT * T == pytest.approx(searched.fun, rel=1e-11)


def moving_point(T: float) -> TrajectoryProblem:
    """q'' of least square from 0 to 1 with the velocity 1 at both ends.

    J = 6 (1 - T)^2 / T^3 is 0 at T = 1, has a maximum at T = 3, and falls beyond.
    """
    ld = DiscreteLagrangian(spline(1), Grid.uniform(T, 4, galerkin(1)))
    return TrajectoryProblem(ld, State([0.0], [1.0]), State([1.0], [1.0]))


def test_a_maximum_in_the_duration_is_no_minimum() -> None:
    problem, price = moving_point(3.0), TimePrice(0.0, 0.2, 8.0)
    for T in (1.5, 3.0, 5.0):
        solved = solve_on_grid(moving_point(T))
        assert (solved.status, solved.n_neg) == (Status.MINIMUM, 0)
        assert solved.cost == pytest.approx(6 * (1 - T) ** 2 / T**3, rel=1e-12)
    stays = jointly(problem, price, escape_saddles=False)
    assert stays.trajectory.duration == pytest.approx(3.0, rel=1e-6)
    assert (stays.success, stays.status, stays.n_neg) == (False, Status.SADDLE, 1)
    leaves = jointly(problem, price)
    T = leaves.trajectory.duration
    assert leaves.success, leaves.message
    assert pytest.approx(8.0, rel=1e-14) == T or pytest.approx(1.0, rel=1e-5) == T


@pytest.mark.parametrize(("bounds", "end"), [((3.5, 8.0), 8.0), ((1.5, 2.9), 1.5)])
def test_a_duration_at_its_bound_is_exactly_there(bounds: tuple[float, float], end: float) -> None:
    """The cost falls beyond it, and is concave in the duration there at T = 2.9."""
    first = float(np.sqrt(bounds[0] * bounds[1]))
    found = jointly(moving_point(first), TimePrice(0.0, *bounds))
    assert (found.success, found.n_neg) == (True, 0)
    assert found.trajectory.duration == pytest.approx(end, rel=1e-15)
    assert found.cost == pytest.approx(6 * (1 - end) ** 2 / end**3, rel=1e-10)
    assert found.duration_derivative * (1 if end == bounds[0] else -1) > 0


def test_at_a_bound_the_curvature_in_the_duration_does_not_count() -> None:
    """J falls from T = 3 to T = 1, and is concave at T = 2.5."""
    found = jointly(moving_point(2.9), TimePrice(0.0, 2.5, 2.95))
    assert found.trajectory.duration == 2.5
    assert (found.status, found.n_neg) == (Status.MINIMUM, 0)


def test_within_limits_at_the_points_the_best_duration_is_that_of_a_scalar_search(
    two_link: hovi.Robot,
) -> None:
    limits = as_limits(two_link, TORQUES)
    options = Criteria(decrease=1e-12)
    problem = arm_problem(two_link, 1.0, "moving")
    rows = LimitRows(problem.grid, no_limits(two_link), None)
    objective = TimedBoundedAction(problem, limits, None, PRICE, rows)
    first = TimedPath(problem.guess("cubic"), problem.grid.duration)
    found = minimize_bounded(objective, first, options)
    T = found.x.duration
    assert found.feasible
    assert float(np.abs(found.outputs.y - 0.5).max()) > 0.5 - 1e-6  # some limits are active

    def total(T: float) -> float:
        stretched = problem.on(problem.grid.stretched(T))
        bounded = BoundedAction(stretched, limits)
        solved = minimize_bounded(bounded, stretched.guess("cubic"), options)
        assert solved.feasible
        return solved.outputs.value + WEIGHT * T

    searched = minimize_scalar(total, bracket=(0.95 * T, 1.01 * T, 1.1 * T), options={"xtol": 1e-8})
    assert pytest.approx(searched.x, rel=1e-5) == T
    assert found.outputs.value == pytest.approx(searched.fun, rel=1e-9)


def limited(two_link: hovi.Robot, T: float) -> TrajectoryProblem:
    problem = arm_problem(two_link, T)
    limits = as_limits(two_link, TORQUES)
    return TrajectoryProblem(problem.ld, problem.start, problem.goal, limits)


@pytest.mark.parametrize("first", [0.35, 1.6, 5.0])
def test_limits_hold_everywhere_at_the_best_duration(two_link: hovi.Robot, first: float) -> None:
    """From durations that are too short for any motion, and from longer ones."""
    found = jointly(limited(two_link, first))
    T = found.trajectory.duration
    assert found.success, found.message
    assert abs(found.duration_derivative + WEIGHT) <= 1e-7 * WEIGHT
    motion = found.trajectory.sample(np.linspace(0.0, T, 20_000))
    assert found.problem is not None
    tau = found.problem.scene.inverse_dynamics(motion.q, motion.v, motion.a)
    assert np.abs(motion.v).max() <= 4.0 * (1 + 2e-6)
    assert np.all(np.abs(tau).max(axis=0) <= np.array([8.0, 3.0]) * (1 + 2e-6))
    assert (np.abs(tau).max(axis=0) / [8.0, 3.0]).max() > 0.999
    costs = [
        solve_on_grid(limited(two_link, s * T), found.trajectory).cost + WEIGHT * s * T
        for s in (0.97, 1.03)
    ]
    assert found.cost + WEIGHT * T < min(costs)


@pytest.mark.parametrize(("bounds", "end"), [((2.0, 4.0), 2.0), ((1.2, 1.35), 1.35)])
def test_within_limits_a_duration_ends_exactly_at_a_bound(
    two_link: hovi.Robot, bounds: tuple[float, float], end: float
) -> None:
    """The best duration without bounds is 1.43 s; the motion is that of the bound alone."""
    found = jointly(limited(two_link, 1.45), TimePrice(WEIGHT, *bounds))
    assert (found.success, found.n_neg) == (True, 0)
    assert found.trajectory.duration == pytest.approx(end, rel=1e-15)
    assert (found.duration_derivative + WEIGHT) * (1 if end == bounds[0] else -1) > 0
    fixed = solve_on_grid(limited(two_link, end))
    assert found.cost == pytest.approx(fixed.cost, rel=5 * MAX_LOSS)


def test_ends_beyond_their_limits_are_told_without_a_solve(two_link: hovi.Robot) -> None:
    problem = limited(two_link, 1.0)
    limits = as_limits(two_link, {"base": "none", "q": [[-1.0, 1.0], [-1.0, 1.0]]})
    found = jointly(TrajectoryProblem(problem.ld, problem.start, problem.goal, limits))
    assert (found.status, found.nit) == (Status.INFEASIBLE, 0)
    assert "shoulder" in found.message


def test_a_stopped_solve_is_no_success(two_link: hovi.Robot) -> None:
    for problem in (arm_problem(two_link, 4.0), limited(two_link, 4.0)):
        solve = partial(solve_jointly, problem, problem.guess("cubic"), PRICE)
        late, few = solve(time_limit=1e-4), solve(max_iterations=2)
        assert (late.success, late.status) == (False, Status.TIME_LIMIT)
        assert (few.success, few.status) == (False, Status.ITERATION_LIMIT)


def test_problems_with_equations_obstacles_and_torque_rates_are_not_supported(
    two_link: hovi.Robot,
) -> None:
    problem = arm_problem(two_link, 1.0)
    assert solves_jointly(problem)
    assert solves_jointly(limited(two_link, 1.0))
    ball = hovi.Clearance([hovi.Sphere([0.0, 2.8, 0.0], 0.1)])
    around = TrajectoryProblem(problem.ld, problem.start, problem.goal, clearance=ball)
    passive = hovi.Scene(two_link, [Gravity(9.8)], passive=["elbow"])
    ld = DiscreteLagrangian(passive.effort_lagrangian(), problem.grid)
    acrobot = TrajectoryProblem(ld, problem.start, problem.goal)
    fine = problem.on(Grid.uniform(1.0, 1001, galerkin(1)))
    jerk = hovi.Scene(two_link, [hovi.effects.JerkCost(0.1)])
    third = DiscreteLagrangian(jerk.effort_lagrangian(), Grid.uniform(1.0, 8, galerkin(2, 3)))
    rates = as_limits(two_link, {"base": "none", "torque_rate": 50.0}, 3)
    smooth = TrajectoryProblem(third, problem.start, problem.goal, rates)
    assert not any(map(solves_jointly, (around, acrobot, fine, smooth)))


def test_the_central_path_of_a_free_duration_is_one_of_its_last_duration(
    two_link: hovi.Robot,
) -> None:
    """Its points do not cost less than the motion, as those of a longer duration would."""
    found = jointly(limited(two_link, 5.0))
    assert found.success
    assert found.problem is not None
    assert found.central is not None
    assert found.trajectory.duration < 2.5
    points = found.central.points
    assert len(points) > 1
    assert np.array_equal(points[-1][1].q, found.trajectory.q)
    costs = [found.problem.ld.action(path) for _, path in points]
    assert min(costs) >= found.cost * (1.0 - 1e-4)  # their rows and margins differ a little
    method = InteriorPoint(found.central.freed())
    again = solve_on_grid(found.problem, found.trajectory.path, method=method, near=True)
    cold = solve_on_grid(found.problem)
    assert again.nit < 0.7 * cold.nit
    assert again.cost == pytest.approx(found.cost, rel=1e-4)


def test_the_bounded_action_at_a_duration_is_that_of_its_problem(two_link: hovi.Robot) -> None:
    problem, T = limited(two_link, 1.3), 1.9
    assert problem.limits is not None
    limits, rows = problem.limits, LimitRows(problem.grid, problem.limits, None)
    timed = TimedBoundedAction(problem, limits, None, PRICE, rows)
    other = problem.on(problem.grid.stretched(T))
    built = BoundedAction(other, limits, rows=rows.on(other.grid))
    path, at = other.guess("cubic"), timed.at(T)
    assert np.allclose(at.outputs(path).y, built.outputs(path).y, rtol=1e-12, atol=1e-14)
    assert at.outputs(path).value == pytest.approx(built.outputs(path).value, rel=1e-13)
    for name in ("lower", "upper", "weights"):
        assert np.allclose(getattr(at.bounds, name), getattr(built.bounds, name), rtol=1e-13)
    assert at.bounds.measure == pytest.approx(built.bounds.measure, rel=1e-14)
    sigma, rho, force = np.random.default_rng(0).random((3, len(at.bounds.lower)))
    models = [each.model(path, sigma, rho, force) for each in (at, built)]
    assert np.allclose(models[0].gradient, models[1].gradient, rtol=1e-10)
    pulled = [each.pull(rho, model) for each, model in zip((at, built), models, strict=True)]
    assert np.allclose(*pulled, rtol=1e-10)
