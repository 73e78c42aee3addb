"""The action with rows of distances keeps its outputs when rows are added, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.grid import DiscretePath
from hovi.optimize.criteria import Criteria
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.methods.feasibility import solved_from
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.planning.solver.near.cleared_action import ClearedAction
from planning.solver.near.test_clearance_rows import problem_of, wavy

LIMITS = {"base": "none", "q": 3.0, "v": 2.0, "tau": 200.0}


def action_of(problem: TrajectoryProblem, path: DiscretePath, ahead: float) -> ClearedAction:
    limits = as_limits(problem.robot, LIMITS)
    assert problem.distances is not None
    near = ClearanceRows(problem, problem.distances, 0.05)
    near.extend(problem, path, ahead)
    rows = LimitRows(problem.grid, limits, problem.coordinates.curved_space)
    return ClearedAction(problem, limits, None, None, None, rows, near)


def test_outputs_that_remain_keep_their_values_in_order() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    action = action_of(problem, path, 0.0)
    for level in (0.5, 1.0, 2.0):
        before = action.outputs(path).y
        found = action.refine(path, level)
        assert found is not None
        after, old = action.outputs(path).y, len(found.kept)
        np.testing.assert_allclose(after[:old], before[found.kept], atol=1e-14)
        assert len(after) == old + len(found.origin) == len(action.bounds.lower)
        assert (np.diff(found.kept) > 0).all()
    numbers = np.arange(float(len(after)))
    np.testing.assert_array_equal(action._ordered(action.plain(numbers)), numbers)


def test_the_gradient_is_that_of_the_action_and_the_forces() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    action = action_of(problem, path, 0.1)
    action.refine(path, 0.3)
    count = len(action.bounds.lower)
    rho, none = np.random.default_rng(0).normal(size=count), np.zeros(count)
    model = action.model(path, none, rho, none)
    step, h = 1e-3 * model.random_vector(4), 1e-3
    weighted = action.bounds.weights * rho
    sides = [action.outputs(action.retract(path, s * step, model)) for s in (h, -h)]
    values = [each.value + float(weighted @ each.y) for each in sides]
    slope = (values[0] - values[1]) / (2 * h)
    assert float(np.vdot(model.gradient, step)) == pytest.approx(slope, rel=1e-4)
    pushed = action.push(step, model)
    change = (sides[0].y - sides[1].y) / (2 * h)
    np.testing.assert_allclose(pushed, change, atol=1e-6 * max(1.0, np.abs(change).max()))
    force = np.random.default_rng(1).normal(size=count)
    pulled = float(np.vdot(action.pull(force, model), step))
    assert pulled == pytest.approx(float((action.bounds.weights * force) @ pushed), rel=1e-9)


def test_a_model_without_concavity_lacks_the_negative_curvature_of_distances_alone() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    action = action_of(problem, path, 0.1)
    count = len(action.bounds.lower)
    none, pushed_away = np.zeros(count), np.zeros(count)
    pushed_away[-action.near.size :] = -1e6
    model = action.model(path, none, none, pushed_away)
    assert model.factor(0.0) is None
    gradient, hessian = model.gradient, model.intervals.hessian.copy()
    near = action._near
    convex = action.model_without_concavity(path)
    assert convex is not None
    assert near is not None
    np.testing.assert_array_equal(convex.gradient, gradient)
    values, vectors = np.linalg.eigh(near.curvature)
    negative = (vectors * np.minimum(values, 0.0)[:, None]) @ vectors.transpose(0, 2, 1)
    near.add_at_instants(negative, convex.intervals.hessian)  # what it lacks
    size = np.abs(hessian).max()
    np.testing.assert_allclose(convex.intervals.hessian, hessian, atol=1e-12 * size)
    pushed_away[-action.near.size :] = 0.0
    action.model(path, none, none, pushed_away)
    assert action.model_without_concavity(path) is None


def test_rows_that_are_watched_refuse_a_step_into_a_pair_before_there_are_any() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    assert problem.distances is not None
    none = ClearanceRows(problem, problem.distances, 10.0)  # all pairs are too close
    limits = as_limits(problem.robot, LIMITS)
    rows = LimitRows(problem.grid, limits, problem.coordinates.curved_space)
    action = ClearedAction(problem, limits, None, None, None, rows, none)
    assert np.isfinite(action.outputs(path).value)
    assert action.refine_at_once(path) is None
    none.watchful = True
    assert np.isinf(action.outputs(path).value)
    found = action.refine_at_once(path)
    assert found is not None
    assert len(found.origin) == none.size > 0


def test_outputs_after_a_refinement_are_those_of_a_new_action() -> None:
    """At paths that were measured before it, too."""
    problem = problem_of("ur5")
    path = wavy(problem)
    action = action_of(problem, path, 0.0)
    assert action.rows is not None
    size = action.rows.size
    action.outputs(path)
    assert action.refine(path, 1e-3) is not None
    assert action.rows.size > size
    near = action.near.copied()
    fresh = ClearedAction(problem, action.limits, None, None, None, action.rows.copied(), near)
    for x in (path, wavy(problem)):
        found, expected = action.outputs(x), fresh.outputs(x)
        np.testing.assert_allclose(action.plain(found.y), fresh.plain(expected.y), atol=1e-12)
        assert found.value == pytest.approx(expected.value, rel=1e-12)


def test_rows_of_parts_are_taken_with_their_intervals_and_values() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    near = action_of(problem, path, 0.1).near
    both = ClearanceRows(problem, near.distances, near.least)
    first = near.thinned(path, 0.0)[0]
    both.take([(0, near), (0, first)])
    assert both.size == near.size + first.size > near.size
    np.testing.assert_allclose(both.values(path)[: near.size], near.values(path), atol=1e-12)
    shifted = ClearanceRows(problem, near.distances, near.least)
    early = np.flatnonzero(near.intervals < problem.grid.intervals - 2)
    part = near.copied()
    some = near.intervals[early], near.positions[early], near.pairs[early]
    part._set(problem, *some, near.rounding[early])
    shifted.take([(2, part)])
    np.testing.assert_array_equal(shifted.intervals, part.intervals + 2)


def test_only_solves_on_a_central_path_begin_with_a_wide_trust_region() -> None:
    problem = problem_of("ur5")
    path, limits = wavy(problem), as_limits(problem.robot, LIMITS)
    search = BoundedSearch(problem, limits, Criteria(max_iterations=1), None, path, lazy=True)
    search.solve(path)
    solved_from(search, path)
    search.solve_at_level(path, 1e-2)
    solved_from(search, path)
    narrow, wide = ClearedAction.radii[1], BoundedAction.radii[1]
    assert wide > 10 * narrow
    assert [step.radius for step in search.history] == [narrow, narrow, wide, narrow]
