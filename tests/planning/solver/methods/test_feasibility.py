"""Motions that a search falls back on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.optimize.bounded_objective import BoundedOutcome
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.planning.problem.limit_violation import excess_along
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.continuation import may_help
from hovi.planning.solver.limits.restored_motion import unlimited_minimum
from hovi.planning.solver.methods import feasibility
from hovi.planning.solver.methods.bounded_search import BoundedSearch
from hovi.planning.solver.methods.feasibility import follow
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.schemes import galerkin


def test_a_minimum_that_no_limit_touches_is_one_within_them(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 12, galerkin(2)))
    ends = hovi.State([0.0, 0.0]), hovi.State([0.5, 0.4])
    free = solve_on_grid(TrajectoryProblem(ld, *ends))
    limits = as_limits(two_link, {"base": "none", "v": 40.0, "tau": 500.0})
    problem = TrajectoryProblem(ld, *ends, limits)
    search = BoundedSearch(problem, limits, Criteria(), None, free.trajectory.path)
    found = unlimited_minimum(search, free.trajectory.path)
    assert found.why is Reason.STATIONARY
    assert found.feasible
    assert found.outputs.value == free.cost
    assert search.negative_eigenvalues(found) == 0
    assert not found.barrier.multipliers.any()
    assert np.array_equal(found.x.q, free.trajectory.q)


@pytest.fixture(scope="module")
def limited(two_link: hovi.Robot) -> Solution:
    """A motion that velocities and torques hold."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 24, galerkin(2)))
    limits = as_limits(two_link, {"base": "none", "v": 1.6, "tau": 60.0})
    ends = hovi.State([0.0, 0.0]), hovi.State([1.2, 0.8])
    found = solve_on_grid(TrajectoryProblem(ld, *ends, limits))
    assert found.success, found.message
    assert found.central is not None
    assert found.central.barrier is not None
    held = found.central.barrier.zl + found.central.barrier.zu > 1e-2 * found.cost
    assert held.sum() >= 5
    return found


def unused(*_: object) -> None:
    raise AssertionError("the solution is to be followed")


@pytest.mark.parametrize("name", ["_solved_warm", "_solved_from_level"])
def test_a_small_move_of_the_goal_takes_a_few_whole_steps(
    limited: Solution, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feasibility, name, unused)
    again = limited.replan(goal=hovi.State([1.204, 0.797]))
    assert again.success, again.message
    problem = again.problem
    assert problem is not None
    assert problem.limits is not None
    assert excess_along(again.trajectory, problem.limits).worst <= problem.limits.tolerance
    cold = solve_on_grid(problem, near=False)
    assert again.cost == pytest.approx(cold.cost, rel=2e-5)
    assert again.nit < cold.nit


def test_a_goal_that_moves_far_is_reached_all_the_same(limited: Solution) -> None:
    again = limited.replan(goal=hovi.State([0.9, 1.1]))
    cold = solve_on_grid(again.problem, near=False)  # type: ignore[arg-type]
    assert again.success, again.message
    assert again.cost == pytest.approx(cold.cost, rel=2e-5)


def test_a_solve_nearby_that_takes_long_goes_on_unless_it_is_outside_of_bounds(
    limited: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else there is one from the guess, which takes fewer steps than another minimum is away."""
    begun, whole = [], feasibility._solved_at_all

    def counted(*given: Any) -> Any:
        begun.append(given)
        return whole(*given)

    monkeypatch.setattr(feasibility, "_solved_at_all", counted)
    assert limited.replan(goal=hovi.State([0.9, 1.1])).success
    assert not begun
    monkeypatch.setattr(feasibility, "WARM_STEPS", 1)
    assert limited.replan(goal=hovi.State([0.9, 1.1])).success
    assert not begun
    monkeypatch.setattr(BoundedOutcome, "feasible", False)
    limited.replan(goal=hovi.State([0.9, 1.1]))
    assert begun


def test_a_central_path_is_followed_to_a_nearby_problem_only(limited: Solution) -> None:
    problem, central = limited.problem, limited.central
    assert problem is not None
    assert central is not None
    near = problem.between(problem.start, hovi.State([1.204, 0.797]))
    found = follow(near, central, 1e-7)
    assert found is not None
    cold = solve_on_grid(near, near=False)
    assert near.ld.action(found.last) == pytest.approx(cold.cost, rel=2e-5)
    np.testing.assert_allclose(found.last.q[-1], [1.204, 0.797], atol=1e-12)
    far = problem.between(problem.start, hovi.State([-0.5, 1.5]))
    assert follow(far, central, 1e-7) is None


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
    found = solve_on_grid(weak_pendulum(torque, duration))
    assert found.status is Status.INFEASIBLE
    assert found.locally_infeasible
    assert "the torque of joint 'joint1' reaches" in found.message
    assert not may_help(found)
    assert found.nit < 120


def test_a_swing_up_is_found_past_motions_of_least_violation_that_lift_it_directly() -> None:
    """The failed solve and the guess both lead to such a motion, the perturbed guess does not."""
    found = solve_on_grid(weak_pendulum(1.5016, 3.673))
    assert found.status is Status.MINIMUM
    assert not found.locally_infeasible
    swings = np.sign(found.trajectory.v[1:-1, 0])
    assert (np.diff(swings) != 0).sum() >= 2
