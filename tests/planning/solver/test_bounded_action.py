"""The pointwise terms of limits, against finite differences."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import LinearAlgebra
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.solver import guess_path
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]
LIMITS = {"base": "none", "q": [[-4.0, 4.0], [-3.0, 3.0]], "v": 7.0, "tau": [9.0, 4.0]}


@pytest.fixture(params=["band", "tree"])
def limited(request: pytest.FixtureRequest, arm_scene: Scene) -> BoundedAction:
    """The reach of the arm on four intervals of unequal lengths, with limits on q, v and tau."""
    algebra: LinearAlgebra = request.param
    grid = Grid(np.array([0.3, 0.2, 0.1, 0.4]), (galerkin(1),) * 4)
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, State([-1.5, 0.0]), State([0.3, 0.7], [0.5, -0.4]))
    return BoundedAction(problem, as_limits(arm_scene.robot, LIMITS), algebra=algebra)


def test_outputs_are_measured_in_ranges_from_the_lower_bound(limited: BoundedAction) -> None:
    x = guess_path(limited.problem, "cubic")
    (q, v, a), *_ = limited.ld.jets(x)
    tau = limited.problem.scene.inverse_dynamics(q, v, a)
    y = limited.outputs(x).y.reshape(len(q), 6)
    np.testing.assert_allclose(y[:, :2], (q + np.array([4, 3])) / [8, 6], atol=1e-13)
    np.testing.assert_allclose(y[:, 2:4], (v + 7) / 14, atol=1e-13)
    np.testing.assert_allclose(y[:, 4:], (tau + np.array([9, 4])) / [18, 8], atol=1e-13)
    assert limited.outputs(x).value == pytest.approx(limited.ld.action(x), rel=1e-14)


def test_the_model_is_that_of_the_action_with_linear_and_square_terms(
    limited: BoundedAction,
) -> None:
    """phi(x) = action + sum weights (rho y + sigma (y - y0)^2 / 2), with multipliers rho."""
    random = np.random.default_rng(0)
    x = guess_path(limited.problem, "cubic")
    y0 = limited.outputs(x).y
    rho, sigma = random.standard_normal(y0.shape), random.uniform(0.0, 9.0, y0.shape)
    model = limited.model(x, sigma, rho, rho)
    step = model.random_vector(1)

    def phi(share: float) -> float:
        moved: DiscretePath = limited.retract(x, share * step, model)
        outputs = limited.outputs(moved)
        terms = rho * outputs.y + sigma * (outputs.y - y0) ** 2 / 2
        return outputs.value + float(np.sum(limited.bounds.weights * terms))

    h = 1e-4
    slope = (8 * (phi(h) - phi(-h)) - (phi(2 * h) - phi(-2 * h))) / (12 * h)
    assert float(np.vdot(model.gradient, step)) == pytest.approx(slope, rel=1e-7)
    curve = (16 * (phi(h) + phi(-h)) - (phi(2 * h) + phi(-2 * h)) - 30 * phi(0.0)) / (12 * h * h)
    local = model.gather(step)
    square = np.einsum("kia,kijab,kjb->", local, model.intervals.hessian, local)
    assert float(square) == pytest.approx(curve, rel=1e-5)


def test_pushed_steps_are_first_order_changes(limited: BoundedAction) -> None:
    x = guess_path(limited.problem, "cubic")
    zero = np.zeros_like(limited.outputs(x).y)
    model = limited.model(x, zero, zero, zero)
    step = model.random_vector(2)
    dy = limited.push(step, model)
    h = 1e-5
    up, down = (limited.outputs(limited.retract(x, s * h * step, model)) for s in (1, -1))
    np.testing.assert_allclose(dy, (up.y - down.y) / (2 * h), rtol=1e-6, atol=1e-6)
    slope = (up.value - down.value) / (2 * h)
    assert float(np.vdot(model.gradient, step)) == pytest.approx(slope, rel=1e-6)


def test_margins_tighten_the_bounds_of_their_interval(arm_scene: Scene) -> None:
    grid = Grid.uniform(1.0, 3, galerkin(0))
    ld = DiscreteLagrangian(arm_scene.effort_lagrangian(), grid)
    problem = TrajectoryProblem(ld, State([0.0, 0.0]), State([0.3, 0.7]))
    margins = np.zeros((2, 3, 4, 2))
    margins[1, 1, 1, 0] = 0.25  # the upper velocity bound of the shoulder, second interval
    limits = as_limits(arm_scene.robot, {"base": "none", "v": 2.0})
    bounds = BoundedAction(problem, limits, margins).bounds
    np.testing.assert_allclose(bounds.lower, 0.0)
    upper = bounds.upper.reshape(6, 2)
    np.testing.assert_allclose(upper[:, 1], 1.0)
    np.testing.assert_allclose(upper[:, 0], [1, 1, 0.75, 0.75, 1, 1])
