"""What the tolerance of limits adds to the cost's error, against solves with shifted limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi import Solution
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.limit_sensitivity import SHIFT, cost_of_tolerance, limit_prices
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid

HANG, GOAL = [-np.pi / 2, 0.0], [0.3, 0.7]


def limited(scene: Scene, limits: dict[str, object]) -> Solution:
    return hovi.plan(scene, HANG, GOAL, 1.0, limits=limits, intervals=24)


def limited_by(
    scene: Scene, bounds: dict[str, object]
) -> tuple[Solution, TrajectoryProblem, Limits]:
    """The motion within some bounds alone, its problem, and the limits of that."""
    found = limited(scene, {"base": "none", **bounds})
    assert found.problem is not None
    assert found.problem.limits is not None
    return found, found.problem, found.problem.limits


@pytest.mark.parametrize(
    "bounds", [{"v": 3.0}, {"tau": 8.0}, {"q": [[-1.6, 0.31], [-0.4, 0.71]]}, {"a": 20.0}]
)
def test_the_cost_of_the_tolerance_is_the_change_with_a_shift_of_all_limits(
    arm_scene: Scene, bounds: dict[str, object]
) -> None:
    found, problem, limits = limited_by(arm_scene, bounds)
    shift = 100 * SHIFT * limits.tolerance
    costs = []
    for margin in (shift, 2 * shift):
        tighter = dataclasses.replace(problem, limits=limits.with_margin(margin))
        costs.append(solve_on_grid(tighter, found.trajectory).cost)
    change = (costs[1] - costs[0]) / found.cost
    assert change > 1e-5
    assert 100 * cost_of_tolerance(found) == pytest.approx(change, rel=0.2)


@pytest.mark.parametrize("bounds", [{"v": 3.0}, {"tau": 8.0}])
def test_the_price_of_a_bound_is_the_change_with_a_shift_of_that_bound(
    arm_scene: Scene, bounds: dict[str, object]
) -> None:
    found, problem, limits = limited_by(arm_scene, bounds)
    prices = limit_prices(found)
    column = int(prices.max(axis=0).argmax())
    side = int(prices[:, column].argmax())
    kind, joint = divmod(column, 2)  # of q, v, a, tau
    shift, costs = 1e-4, []
    for share in (1.0, 2.0):
        lower, upper = limits.lower.copy(), limits.upper.copy()
        step = share * shift * (upper - lower)[kind, joint]
        if side == 0:
            lower[kind, joint] += step
        else:
            upper[kind, joint] -= step
        shifted = dataclasses.replace(limits, lower=lower, upper=upper)
        tighter = dataclasses.replace(problem, limits=shifted)
        costs.append(solve_on_grid(tighter, found.trajectory).cost)
    change = (costs[1] - costs[0]) / shift / found.cost
    assert change > 0.01
    assert prices[side, column] == pytest.approx(change, rel=0.1)
    assert prices[1 - side, column] < 0.2 * prices[side, column]  # the motion is mostly one way


def test_limits_that_are_not_reached_add_nothing(arm_scene: Scene) -> None:
    found = limited(arm_scene, {"base": "none", "v": 50.0})
    assert cost_of_tolerance(found) < 1e-9


def test_a_tolerance_below_the_cost_of_that_of_limits_is_not_reached(arm_scene: Scene) -> None:
    limits = {"base": "none", "v": 3.0}
    found = hovi.plan(arm_scene, HANG, GOAL, 1.0, limits=limits, tolerance=1e-6)
    assert found.accuracy is not None
    assert not found.accuracy.reached
    assert found.accuracy.error >= cost_of_tolerance(found) > 1e-6
    assert "the tolerance of limits allows no smaller error" in found.message


def test_a_motion_that_costs_nothing_has_no_error_under_limits(two_link: Robot) -> None:
    """At rest without gravity."""
    ld = DiscreteLagrangian(Scene(two_link).effort_lagrangian(), Grid.uniform(1.0, 4, galerkin(2)))
    limits = as_limits(two_link, {"base": "none", "v": 1.0, "tau": 1.0})
    still = solve_on_grid(TrajectoryProblem(ld, State([0.3, 0.1]), State([0.3, 0.1]), limits))
    assert still.success
    assert cost_of_tolerance(dataclasses.replace(still, cost=0.0)) == 0.0
