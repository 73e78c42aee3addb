"""Derivatives in the duration, against differences of the action along steps of path and time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity, JerkCost, ViscousFriction
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.free_duration.timed_action import TimedAction
from hovi.planning.solver.free_duration.timed_bounded_action import TimedBoundedAction
from hovi.planning.solver.free_duration.timed_model import TimedModel
from hovi.planning.solver.free_duration.timed_path import TimedPath, TimePrice
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.solver import guess_path
from hovi.schemes import galerkin
from samples.manifold_robots import with_arm

Array = npt.NDArray[np.float64]
PRICE = TimePrice(3.0, 0.1, 20.0)
STEPS = np.array([0.3, 0.2, 0.1, 0.4])
BOUNDS = {"base": "none", "q": [[-4.0, 4.0], [-3.0, 3.0]], "v": 7.0, "a": 60.0, "tau": [30.0, 9.0]}


def two_link_problem(two_link: hovi.Robot, ends: str, order: int = 2) -> TrajectoryProblem:
    """A reach on intervals of unequal lengths and schemes."""
    effects = [Gravity(9.8), ViscousFriction(0.3), *([JerkCost(0.01)] if order == 3 else [])]
    scene = hovi.Scene(two_link, effects)
    schemes = [galerkin(modes, order) for modes in (1, 2, 1, 2)]
    start, goal = State([-1.5, 0.0]), State([0.3, 0.7])
    if ends != "at rest":
        start = State([-1.5, 0.0], [0.8, -0.6])
        free = ("elbow",) if ends == "free" else ()
        goal = State([0.3, 0.7], [0.5, -0.4], free_velocity=free)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid(STEPS, tuple(schemes)))
    return TrajectoryProblem(ld, start, goal)


def floating_problem() -> TrajectoryProblem:
    robot = hovi.load_robot(with_arm("free-flyer"))
    scene = hovi.Scene(robot, [Gravity(9.8)])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid(STEPS, (galerkin(2),) * 4))
    random = np.random.default_rng(4)
    q0 = robot.space.integrate(robot.neutral(), 0.3 * random.normal(size=robot.nv))
    q1 = robot.space.integrate(q0, 0.5 * random.normal(size=robot.nv))
    v = 0.3 * random.normal(size=(2, robot.nv))
    return TrajectoryProblem(ld, State(q0, v[0]), State(q1, v[1]))


def bumped(objective: TimedAction | TimedBoundedAction, problem: TrajectoryProblem) -> TimedPath:
    """A motion that is not stationary, of another duration than the problem's."""
    x = TimedPath(problem.guess("cubic"), problem.grid.duration)
    model = TimedAction(problem, PRICE).model(x, None, None)
    step = 0.05 * np.random.default_rng(1).standard_normal(len(model.gradient))
    step[-1] = 0.2
    return objective.retract(x, step, model)


def product(model: TimedModel, s: Array) -> Array:
    """The bordered Hessian times s."""
    local = np.einsum("kijab,kjb->kia", model.intervals.hessian, model.gather(s))
    border = model.border
    last = border.column @ s[:-1] + border.corner * s[-1]
    return np.append(model.inner.scatter(local) + s[-1] * border.column, last)


def differences(f: Callable[[float], float], h: float) -> tuple[float, float]:
    """First and second derivative at 0, of fourth order."""
    near, far = (f(h), f(-h)), (f(2 * h), f(-2 * h))
    first = (8 * (near[0] - near[1]) - (far[0] - far[1])) / (12 * h)
    return first, (16 * sum(near) - sum(far) - 30 * f(0.0)) / (12 * h * h)


@pytest.mark.parametrize("kind", ["at rest", "moving", "free", "jerk", "floating"])
def test_the_model_of_path_and_duration_is_that_of_differences(
    two_link: hovi.Robot, kind: str
) -> None:
    order = 3 if kind == "jerk" else 2
    ends = "moving" if kind == "jerk" else kind
    problem = floating_problem() if kind == "floating" else two_link_problem(two_link, ends, order)
    objective = TimedAction(problem, PRICE)
    x = bumped(objective, problem)
    model = objective.model(x, None, None)
    step = 0.3 * model.random_vector(2)
    for direction in (step, np.eye(len(step))[-1]):
        moved = [objective.retract(x, s * direction, model) for s in (-1e-9, 0.0, 1e-9)]
        assert moved[1].duration == x.duration
        first, second = differences(
            lambda s, along=direction: objective.value(objective.retract(x, s * along, model)), 2e-3
        )
        assert float(model.gradient @ direction) == pytest.approx(first, rel=1e-7)
        if kind != "floating":  # along whose steps charts bend
            curve = float(direction @ product(model, direction))
            assert curve == pytest.approx(second, rel=1e-5)

    def gradient(s: float) -> Array:
        y = objective.retract(x, s * np.eye(len(step))[-1], model)
        return objective.model(y, None, None).gradient

    h = 1e-3
    expected = (8 * (gradient(h) - gradient(-h)) - gradient(2 * h) + gradient(-2 * h)) / (12 * h)
    border = np.append(model.border.column, model.border.corner)
    np.testing.assert_allclose(border, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("ends", ["at rest", "moving"])
def test_under_limits_it_is_that_of_the_action_with_linear_and_square_terms(
    two_link: hovi.Robot, ends: str
) -> None:
    """phi = S + w T + sum weights (rho y + sigma (y - y0)^2 / 2), with the first weights."""
    problem = two_link_problem(two_link, ends)
    limits = as_limits(two_link, BOUNDS)
    rows = LimitRows(problem.grid, limits, None)
    assert rows.size > 0  # of velocities; and their terms are tested with those at the points
    objective = TimedBoundedAction(problem, limits, None, PRICE, rows)
    x, random = bumped(objective, problem), np.random.default_rng(0)
    y0 = objective.outputs(x).y
    rho, sigma = random.standard_normal(y0.shape), random.uniform(0.0, 9.0, y0.shape)
    model = objective.model(x, sigma, rho, rho)

    def phi(s: float, along: Array) -> float:
        outputs = objective.outputs(objective.retract(x, s * along, model))
        terms = rho * outputs.y + sigma * (outputs.y - y0) ** 2 / 2
        return outputs.value + float(np.sum(objective.bounds.weights * terms))

    step = 0.3 * model.random_vector(2)
    for direction in (step, np.eye(len(step))[-1], step + np.eye(len(step))[-1]):
        first, second = differences(lambda s, along=direction: phi(s, along), 1e-3)
        assert float(model.gradient @ direction) == pytest.approx(first, rel=1e-7)
        curve = float(direction @ product(model, direction))
        assert curve == pytest.approx(second, rel=1e-5)


@pytest.mark.parametrize("ends", ["at rest", "moving"])
def test_pushed_steps_are_first_order_changes_of_path_and_duration(
    two_link: hovi.Robot, ends: str
) -> None:
    problem = two_link_problem(two_link, ends)
    limits = as_limits(two_link, BOUNDS)
    rows = LimitRows(problem.grid, limits, None)
    objective = TimedBoundedAction(problem, limits, None, PRICE, rows)
    x = bumped(objective, problem)
    random = np.random.default_rng(0)
    rho = random.standard_normal(objective.outputs(x).y.shape)
    model = objective.model(x, 0 * rho, rho, rho)
    step = model.random_vector(2)
    dy, h = objective.push(step, model), 1e-5
    up, down = (objective.outputs(objective.retract(x, s * h * step, model)) for s in (1, -1))
    np.testing.assert_allclose(dy, (up.y - down.y) / (2 * h), rtol=1e-6, atol=1e-6)
    slope = float(model.gradient @ step) - float(objective.bounds.weights * rho @ dy)
    model = objective.model(x, 0 * rho, rho, rho)  # that of the path which is pulled back
    pulled = objective.pull(rho, model)
    assert float(pulled @ step) == pytest.approx(float(objective.bounds.weights * rho @ dy))
    assert slope == pytest.approx((up.value - down.value) / (2 * h), rel=1e-6)


@pytest.mark.parametrize("kind", ["moving", "floating"])
def test_a_step_keeps_fixed_ends_and_fits_its_grid(two_link: hovi.Robot, kind: str) -> None:
    problem = floating_problem() if kind == "floating" else two_link_problem(two_link, kind)
    objective = TimedAction(problem, PRICE)
    x = bumped(objective, problem)
    T = x.duration
    assert pytest.approx(np.exp(0.2) * problem.grid.duration) == T
    (q0, q1), (v0, v1) = problem.ends
    np.testing.assert_allclose(x.path.v[[0, -1]], [v0, v1], rtol=1e-13)
    np.testing.assert_allclose(x.path.q[[0, -1]], [q0, q1], rtol=1e-13)
    final = problem.on(problem.grid.stretched(T))
    assert final.ld.action(x.path) + PRICE.weight * T == pytest.approx(objective.value(x))
    guess_path(final, x.path)  # raises unless z fits the nodes
