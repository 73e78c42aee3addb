"""Motions that a search falls back on."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi import Solution, Status, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.schemes import galerkin


def test_a_minimum_that_no_limit_touches_is_one_within_them(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 12, galerkin(2)))
    ends = hovi.State([0.0, 0.0]), hovi.State([0.5, 0.4])
    free = solve(TrajectoryProblem(ld, *ends))
    limits = as_limits(two_link, {"base": "none", "v": 40.0, "tau": 500.0})
    problem = TrajectoryProblem(ld, *ends, limits)
    for guess in ("cubic", free.trajectory):
        found = solve(problem, guess)
        assert found.success, found.message
        assert found.n_neg == 0
        assert found.cost == pytest.approx(free.cost, rel=1e-9)
    assert found.nit <= 2


@pytest.fixture(scope="module")
def limited(two_link: hovi.Robot) -> Solution:
    """A motion that velocities and torques hold."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 24, galerkin(2)))
    limits = as_limits(two_link, {"base": "none", "v": 1.6, "tau": 60.0})
    ends = hovi.State([0.0, 0.0]), hovi.State([1.2, 0.8])
    found = solve(TrajectoryProblem(ld, *ends, limits))
    assert found.success, found.message
    v = np.abs(found.trajectory.sample(np.linspace(0.0, 1.0, 200)).v)
    assert (v > 1.6 * (1 - 1e-3)).sum() >= 5
    return found


def test_a_small_move_of_the_goal_takes_a_few_whole_steps(limited: Solution) -> None:
    again = limited.replan(goal=hovi.State([1.204, 0.797]))
    assert again.success, again.message
    problem = again.problem
    assert problem is not None
    assert problem.limits is not None
    assert closeness(again.trajectory, problem.limits).min() >= -problem.limits.tolerance
    cold = solve(problem)
    assert again.cost == pytest.approx(cold.cost, rel=2e-5)
    assert again.nit <= 8 < cold.nit


def test_a_goal_that_moves_far_is_reached_all_the_same(limited: Solution) -> None:
    again = limited.replan(goal=hovi.State([0.9, 1.1]))
    cold = solve(again.problem)  # type: ignore[arg-type]
    assert again.success, again.message
    assert again.cost == pytest.approx(cold.cost, rel=2e-5)


def weak_pendulum(torque: float, duration: float) -> TrajectoryProblem:
    """A swing from hanging at rest to nearly upright, within a torque."""
    robot = hovi.load_robot(pin.buildModelFromXML(hovi.chain(1)))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(duration, 24, galerkin(2)))
    limits = as_limits(robot, {"base": "none", "tau": torque})
    return TrajectoryProblem(ld, hovi.State([-np.pi / 2]), hovi.State([1.394]), limits=limits)


@pytest.mark.parametrize(("torque", "duration"), [(1.5, 1.0), (0.8, 1.5)])
def test_a_violation_with_one_least_value_ends_the_search(torque: float, duration: float) -> None:
    """After fewer steps than a solve that is given more torque takes twice."""
    found = solve(weak_pendulum(torque, duration))
    assert found.status is Status.INFEASIBLE
    assert "the torque of joint 'joint1' reaches" in found.message
    assert found.nit < 120


def test_a_swing_up_is_found_past_motions_of_least_violation_that_lift_it_directly() -> None:
    """The failed solve and the guess both lead to such a motion, the perturbed guess does not."""
    found = solve(weak_pendulum(1.5016, 3.673))
    assert found.status is Status.MINIMUM
    swings = np.sign(found.trajectory.v[1:-1, 0])
    assert (np.diff(swings) != 0).sum() >= 2
