"""Penalties of violated limits, against finite differences and outputs computed one by one."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.optimize.criteria import Criteria
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.penalized_action import PenalizedAction, least_violation
from hovi.planning.solver.solver import guess_path
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

LIMITS = {"base": "none", "q": [[-1.2, 0.1], [0.1, 0.5]], "v": [[-0.1, 1.0], [-2.0, 2.0]]}
PENALTY = 30.0


@pytest.fixture
def bounded(arm_scene: Scene) -> BoundedAction:
    """A reach that violates bounds of both joints, below and above."""
    grid = Grid(np.array([0.3, 0.2, 0.1, 0.4]), (galerkin(1),) * 4)
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, State([-1.5, 0.0]), State([0.3, 0.7], [0.5, -0.4]))
    return BoundedAction(problem, as_limits(arm_scene.robot, LIMITS))


@pytest.fixture
def path(bounded: BoundedAction) -> DiscretePath:
    return guess_path(bounded.problem, "cubic")


def outside(bounded: BoundedAction, path: DiscretePath) -> np.ndarray:
    """How far each of q and v at the points is outside its bounds, as a share of its range."""
    (q, v, _), *_ = bounded.ld.jets(path)
    columns = []
    for name, values in (("q", q), ("v", v)):
        sides = np.broadcast_to(np.array(LIMITS[name]), (2, 2))
        for joint, (low, high) in enumerate(sides):
            x = values[:, joint]
            beyond = np.where(x > high, x - high, np.where(x < low, x - low, 0.0))
            columns.append(beyond / (high - low))
    return np.stack(columns, axis=1)


def test_the_violation_is_the_largest_share_outside(
    bounded: BoundedAction, path: DiscretePath
) -> None:
    beyond = outside(bounded, path)
    assert (beyond > 0.01).any()
    assert (beyond < -0.01).any()
    found = PenalizedAction(bounded, PENALTY).violation(path)
    assert found == pytest.approx(np.abs(beyond).max(), rel=1e-12)


def test_the_value_is_the_action_and_the_squares_outside(
    bounded: BoundedAction, path: DiscretePath
) -> None:
    squares = np.sum(bounded.bounds.weights * outside(bounded, path).ravel() ** 2)
    expected = bounded.ld.action(path) + PENALTY / 2 * squares
    assert PenalizedAction(bounded, PENALTY).value(path) == pytest.approx(expected, rel=1e-13)


def test_the_model_is_that_of_the_value(bounded: BoundedAction, path: DiscretePath) -> None:
    penalized = PenalizedAction(bounded, PENALTY)
    model = penalized.model(path, None, None)
    step = model.random_vector(3)
    h = 1e-4

    def value(share: float) -> float:
        return penalized.value(penalized.retract(path, share * step, model))

    slope = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)
    assert float(np.vdot(model.gradient, step)) == pytest.approx(slope, rel=1e-6)
    bend = (value(h) - 2 * value(0.0) + value(-h)) / h**2
    local = model.gather(step)
    square = np.einsum("kia,kijab,kjb->", local, model.intervals.hessian, local)
    assert float(square) == pytest.approx(bend, rel=1e-4)


def test_motions_within_the_bounds_have_no_penalty(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 3, galerkin(1)))
    problem = TrajectoryProblem(ld, State([-0.5, 0.2]), State([-0.5, 0.2]))
    penalized = PenalizedAction(BoundedAction(problem, as_limits(arm_scene.robot, LIMITS)), PENALTY)
    still = guess_path(problem, "cubic")
    assert penalized.violation(still) == 0.0
    assert penalized.value(still) == pytest.approx(ld.action(still), rel=1e-14)


def test_the_least_violation_of_a_mean_velocity_above_its_bound(arm_scene: Scene) -> None:
    """A joint that moves by 1.2 rad in 1 s, at up to 1 rad/s, exceeds that by 0.2 on average.

    So the integral of the squares, as shares of the range of 2 rad/s, is at least 0.01.
    """
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 16, galerkin(2)))
    problem = TrajectoryProblem(ld, State([-1.2, 0.2], [1.2, 0.0]), State([0.0, 0.2], [1.2, 0.0]))
    limited = BoundedAction(problem, as_limits(arm_scene.robot, {"base": "none", "v": 1.0}))
    found = least_violation(limited, guess_path(problem, "cubic"), 1.0, Criteria())
    assert found.least
    assert 0.01 <= found.squares <= 0.0115
    assert found.value == pytest.approx(ld.action(found.path), rel=1e-12)
    assert found.violation == PenalizedAction(limited, 1.0).violation(found.path)


def test_bounds_that_a_motion_can_meet_have_no_least_violation(arm_scene: Scene) -> None:
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), Grid.uniform(1.0, 16, galerkin(2)))
    problem = TrajectoryProblem(ld, State([-1.2, 0.2]), State([0.0, 0.2]))
    limited = BoundedAction(problem, as_limits(arm_scene.robot, {"base": "none", "v": 1.4}))
    guess = guess_path(problem, "cubic")
    assert PenalizedAction(limited, 1.0).violation(guess) > 0.1
    found = least_violation(limited, guess, 1.0, Criteria())
    assert not found.least
    assert found.violation < 1e-3
