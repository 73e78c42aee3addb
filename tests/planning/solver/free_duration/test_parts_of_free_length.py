"""Lengths of parts as unknowns: derivatives are those of the action and of bounded outputs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.conditions.condition import Condition
from hovi.conditions.expression import function_of
from hovi.conditions.places import Along
from hovi.conditions.sets import Equal
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.optimize.bordered_model import BorderedModel
from hovi.optimize.equation_model import EquationModel
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.seams import Seam
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.free_duration.joint_solve import solves_jointly
from hovi.planning.solver.free_duration.timed_action import TimedAction
from hovi.planning.solver.free_duration.timed_bounded_action import TimedBoundedAction
from hovi.planning.solver.free_duration.timed_model import TimedModel
from hovi.planning.solver.free_duration.timed_path import TimedPath
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.multipliers import Multipliers
from hovi.schemes import galerkin
from samples.asked_motions import two_link

Array = npt.NDArray[np.float64]

GRID = Grid(np.array([0.1, 0.2, 0.15, 0.12, 0.2, 0.1, 0.13, 0.2]), (galerkin(3),) * 8)
T, FIRST, LAST = GRID.duration, GRID.t[2], GRID.t[5]
CLOCKS = {
    "whole": (Clock(), [T]),
    "between seams": (Clock((FIRST, T - LAST)), [LAST - FIRST]),
    "from the start": (Clock((0.0, T - FIRST)), [FIRST]),
    "to the goal": (Clock((LAST, 0.0)), [T - LAST]),
    "all segments": (Clock((0.0, 0.0, 0.0, 0.0)), [FIRST, LAST - FIRST, T - LAST]),
    "first and last": (Clock((0.0, LAST - FIRST, 0.0)), [FIRST, T - LAST]),
}
AT_REST = hovi.State([0.3, 0.4]), hovi.State([1.0, -0.5])
FREE = tuple(hovi.State(each.q, free_velocity=["shoulder", "elbow"]) for each in AT_REST)
MOVING = tuple(hovi.State(each.q, v=[0.5, -0.2]) for each in AT_REST)


def problem_of(
    goals: tuple[hovi.State, ...], limits: Limits | None = None, kept: str = ""
) -> TrajectoryProblem:
    """kept: a formula that keeps its value 0.2 between the seams."""
    scene = hovi.Scene(two_link(), [hovi.effects.Gravity()])
    seams = tuple(Seam(t, goal) for t, goal in zip((FIRST, LAST), goals, strict=True))
    ends = hovi.State([0.0, 0.0], v=[0.3, 0.2]), hovi.State([1.0, 0.4], v=[0.1, -0.4])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), GRID)
    given = []
    if kept:
        y, part = function_of(kept, "kept", two_link()), (float(FIRST), float(LAST))
        given = [Condition(y, Equal(np.array([0.2])), Along(0), "kept", during=part)]
    return TrajectoryProblem(ld, *ends, limits, seams, conditions=given)


def price_of(clock: Clock, count: int) -> TimePrice:
    return TimePrice(3.0, np.full(count, 0.01), np.full(count, 5.0), clock)


def hessian_of(model: BorderedModel) -> Array:
    """The dense bordered Hessian."""
    inner, border = model.inner, model.border
    plain = inner.inner if isinstance(inner, EquationModel) else inner
    products = [
        inner.scatter(np.einsum("kabij,kbj->kai", plain.intervals.hessian, inner.gather(unit)))
        for unit in np.eye(len(inner.gradient))
    ]
    return np.block([[np.array(products), border.columns], [border.columns.T, border.corner]])


@pytest.mark.parametrize("goals", [AT_REST, MOVING, FREE], ids=["rest", "moving", "free"])
@pytest.mark.parametrize("name", CLOCKS)
def test_the_model_has_the_derivatives_of_the_action(
    name: str, goals: tuple[hovi.State, ...]
) -> None:
    """By differences along random steps from a random motion, of the value after the step."""
    clock, first = CLOCKS[name]
    rng, lengths = np.random.default_rng(3), np.array(first)
    problem = problem_of(goals)
    objective = TimedAction(problem, price_of(clock, len(lengths)), lengths)
    x = TimedPath(problem.guess("cubic"), lengths)
    model = objective.model(x, None, None)
    x = objective.retract(x, 0.2 * rng.normal(size=len(model.gradient)), model)
    model = objective.model(x, None, None)
    hessian = hessian_of(model)

    def value(step: Array) -> float:
        return objective.value(objective.retract(x, step, model))

    for alone in (False, True):
        step = 1e-3 * rng.normal(size=len(model.gradient))
        if alone:
            step[: -len(lengths)] = 0.0
        up, down, wide, low = (value(each * step) for each in (1.0, -1.0, 2.0, -2.0))
        slope = (8.0 * (up - down) - (wide - low)) / 12.0
        assert slope == pytest.approx(model.gradient @ step, rel=1e-7)
        bend = (16.0 * (up + down) - (wide + low) - 30.0 * value(0.0 * step)) / 12.0
        assert bend == pytest.approx(step @ hessian @ step, rel=1e-6)


def away_from_cubic(
    objective: TimedBoundedAction, rng: np.random.Generator
) -> tuple[TimedPath, TimedModel]:
    """A motion some way from the cubic guess, and the model there, without the terms of bounds."""
    none = np.zeros(len(objective.bounds.lower))
    x = TimedPath(objective.first.problem.guess("cubic"), objective.lengths)
    model = objective.model(x, none, none, none)
    x = objective.retract(x, 0.2 * rng.normal(size=len(model.gradient)), model)
    model = objective.model(x, none, none, none)
    assert isinstance(model, TimedModel)
    return x, model


@pytest.mark.parametrize("goals", [AT_REST, FREE], ids=["rest", "free"])
@pytest.mark.parametrize("name", CLOCKS)
def test_bounded_outputs_change_as_predicted(name: str, goals: tuple[hovi.State, ...]) -> None:
    """Torques at the points and rows of limits on q, v and a; and pull is the adjoint of push."""
    clock, first = CLOCKS[name]
    rng, lengths = np.random.default_rng(4), np.array(first)
    limits = as_limits(two_link(), {"base": "none", "q": 9, "v": 20, "a": 400, "tau": 50})
    problem = problem_of(goals, limits)
    rows = LimitRows(GRID, limits, None, problem.free_ends, (0, 1))
    bounded = BoundedAction(problem, limits, rows=rows)
    objective = TimedBoundedAction(bounded, price_of(clock, len(lengths)), lengths)
    x, model = away_from_cubic(objective, rng)
    step = 1e-4 * rng.normal(size=len(model.gradient))
    moved = [objective.outputs(objective.retract(x, e * step, model)).y for e in (1.0, -1.0)]
    predicted = objective.push(step, model)
    assert np.abs(predicted).max() > 1e-5
    np.testing.assert_allclose((moved[0] - moved[1]) / 2.0, predicted, rtol=0, atol=1e-9)
    forces = rng.normal(size=len(objective.bounds.lower))
    work = np.vdot(objective.bounds.weights * forces, predicted)
    whole = objective.pull(forces, model) @ step
    assert whole == pytest.approx(work, rel=1e-9)


@pytest.mark.parametrize("name", ["between seams", "all segments"])
def test_equations_between_seams_do_not_depend_on_lengths(name: str) -> None:
    """A value kept while seams are passed at a speed: the moments after steps, and derivatives.

    Of the action with multipliers of the moments and of what is asked at the seams.
    """
    clock, first = CLOCKS[name]
    rng, lengths = np.random.default_rng(5), np.array(first)
    limits = as_limits(two_link(), {"base": "none", "q": 9, "v": 90, "a": 4000, "tau": 500})
    problem = problem_of(FREE, limits, 'position["tip", "x"]')
    known = Multipliers.zero(BoundedAction(problem, limits).action.equations)
    moments, seams = known.conditions[0], known.conditions[1:]
    for each in (moments, *seams):
        each[:] = rng.normal(size=len(each))
    rows = LimitRows(GRID, limits, None, problem.free_ends, (0, 1))
    bounded = BoundedAction(problem, limits, multipliers=known, rows=rows)
    bounded.tolerances = 1e-9, 1e-9
    equations = bounded.action.equations
    for group, mu in zip(equations.at_nodes, seams, strict=True):
        # rates at nodes inside a part go like 1 / L, which is 0 at a solution alone
        inside = [each.where.node not in (2, 5) for each in group.given]
        mu.reshape(len(inside), -1)[inside] = 0.0
    objective = TimedBoundedAction(bounded, price_of(clock, len(lengths)), lengths)
    x, model = away_from_cubic(objective, rng)
    hessian, inner = hessian_of(model), model.inner
    assert isinstance(inner, EquationModel)
    assert solves_jointly(problem, clock, lengths, near=True)
    assert np.abs(model.back).max() > 1e-3

    def after(step: Array) -> tuple[float, Array]:
        moved = objective.retract(x, step, model)
        return objective.outputs(moved).value, objective.residual(moved)[: len(moments)]

    for alone in (False, True):
        step = 1e-3 * rng.normal(size=len(model.gradient))
        if alone:
            step[: -len(lengths)] = 0.0
        (up, c), (down, d), (wide, _), (low, _) = (after(e * step) for e in (1.0, -1.0, 2.0, -2.0))
        slope = (8.0 * (up - down) - (wide - low)) / 12.0
        assert slope == pytest.approx(model.gradient @ step, rel=1e-7)
        bend = (16.0 * (up + down) - (wide + low) - 30.0 * after(0.0 * step)[0]) / 12.0
        assert bend == pytest.approx(step @ hessian @ step, rel=1e-5)
        kept = inner.kkt.jacobian_product(step[: -len(lengths)])[: len(moments)]
        np.testing.assert_allclose((c - d) / 2.0, kept, rtol=0, atol=1e-7)
