"""Rows of distances of a floating body, and their derivatives in charts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.planning.solver.near.expanded_rows import ExpandedRows
from hovi.system.deadline import OutOfTimeError
from samples.floating_arm import BALL, flight, floating

Array = npt.NDArray[np.float64]
MARGIN = 0.01


def rows_along() -> tuple[TrajectoryProblem, ClearanceRows, DiscretePath]:
    """A flight through the ball, and rows of its pairs at many instants."""
    robot = floating()
    scene, (start, goal) = hovi.Scene(robot, [hovi.effects.Gravity()]), flight(robot)
    grid = hovi.Grid.uniform(1.5, 5, hovi.schemes.by_name("galerkin-2"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    ends = hovi.State(start), hovi.State(goal)
    problem = TrajectoryProblem(ld, *ends, clearance=hovi.Clearance([BALL]))
    assert problem.distances is not None
    rows, path = ClearanceRows(problem, problem.distances, MARGIN), problem.guess("cubic")
    rows.extend(problem, path, 0.3)
    assert rows.size > 10
    return problem, rows, path


def expanded(rows: ClearanceRows, path: DiscretePath, force: Array) -> ExpandedRows:
    return rows.expanded(path, force, "nodal")


def test_rows_change_and_bend_in_charts_as_differences_do() -> None:
    """Of sum force y in random steps of the columns, to second order."""
    problem, rows, path = rows_along()
    objective, random = ActionObjective(problem), np.random.default_rng(0)
    force = random.normal(size=rows.size)
    model = objective.model(path, None, None)
    step = random.normal(size=model.gradient.shape)
    columns = model.gather(step)

    def value(share: float) -> float:
        return float(force @ rows.values(objective.moved(path, share * columns)))

    here, h = expanded(rows, path, force), 1e-3
    gradient = np.zeros_like(columns)
    hessian = np.zeros((len(columns), *columns.shape[1:2] * 2, *columns.shape[2:] * 2))
    here.pull(force, gradient)
    here.add_squares(force, np.zeros(rows.size), hessian)
    slope = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)
    assert float(force @ here.push(columns)) == pytest.approx(slope, rel=1e-6)
    assert float(np.vdot(gradient, columns)) == pytest.approx(slope, rel=1e-6)
    bend = (value(h) - 2 * value(0.0) + value(-h)) / h**2
    square = np.einsum("kia,kijab,kjb->", columns, hessian, columns, optimize=True)
    assert float(square) == pytest.approx(bend, rel=1e-3)


def test_squares_of_rows_are_added() -> None:
    problem, rows, path = rows_along()
    objective, random = ActionObjective(problem), np.random.default_rng(1)
    model = objective.model(path, None, None)
    columns = model.gather(random.normal(size=model.gradient.shape))
    weights, none = random.uniform(size=rows.size), np.zeros(rows.size)
    here = expanded(rows, path, none)
    hessian = np.zeros((len(columns), *columns.shape[1:2] * 2, *columns.shape[2:] * 2))
    here.add_squares(none, weights, hessian)
    square = np.einsum("kia,kijab,kjb->", columns, hessian, columns, optimize=True)
    assert float(square) == pytest.approx(float(weights @ here.push(columns) ** 2), rel=1e-12)


def test_rows_that_time_runs_out_on_can_be_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are added with their places among the outputs, before anything is measured."""
    problem, _, path = rows_along()
    assert problem.distances is not None
    rows = ClearanceRows(problem, problem.distances, MARGIN)

    def late(*_: object) -> Array:
        raise OutOfTimeError

    with monkeypatch.context() as patched:
        patched.setattr(ClearanceRows, "values", late)
        with pytest.raises(OutOfTimeError):
            rows.extend(problem, path, 0.3)
    assert len(rows.order) == rows.size > 10
    assert rows.thinned(path, 0.3)[0].size > 0
