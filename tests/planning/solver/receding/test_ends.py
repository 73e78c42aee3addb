"""Starts at limits."""

from __future__ import annotations

import numpy as np
import pytest

import hovi
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.solver.receding.ends import ROOM, first_state, inside_limits
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin


def problem_of(robot: Robot, limits: object) -> hovi.TrajectoryProblem:
    grid = Grid.uniform(1.0, 4, galerkin(2))
    ld = hovi.DiscreteLagrangian(Scene(robot, []).effort_lagrangian(), grid)
    bounds = None if limits is None else hovi.as_limits(robot, limits)
    return hovi.TrajectoryProblem(ld, State([0.0, 0.0]), State([0.5, 0.5]), limits=bounds)


LIMITS = {"base": "none", "q": {"shoulder": [-1.0, 1.0]}, "v": 2.0, "tolerance": 1e-6}


@pytest.mark.parametrize("beyond", [-0.9 * ROOM, 0.0, 9e-7])
def test_a_start_at_a_limit_gets_room(two_link: Robot, beyond: float) -> None:
    """In units of the ranges, 2 rad and 4 rad/s; the elbow has no limit of its position."""
    state = State([1.0 + 2.0 * beyond, 1.0], [-2.0 - 4.0 * beyond, 0.3])
    moved = inside_limits(state, problem_of(two_link, LIMITS))
    np.testing.assert_allclose(moved.q, [1.0 - 2.0 * ROOM, 1.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(moved.v, [-2.0 + 4.0 * ROOM, 0.3], rtol=0, atol=1e-12)


@pytest.mark.parametrize("beyond", [-1e-3, -2 * ROOM, 2e-6, 0.1])
def test_a_start_elsewhere_stays_where_it_is(two_link: Robot, beyond: float) -> None:
    state = State([1.0 + 2.0 * beyond, 1.0], [-2.0 - 4.0 * beyond, 0.3])
    moved = inside_limits(state, problem_of(two_link, LIMITS))
    np.testing.assert_array_equal(moved.q, np.asarray(state.q))
    np.testing.assert_array_equal(moved.v, np.asarray(state.v))
    assert inside_limits(state, problem_of(two_link, None)) is state


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_the_first_state_of_a_path_has_all_its_derivatives(order: int) -> None:
    ends = [State([0.2], *([[0.3]] if order > 1 else [])), State([1.0])]
    if order > 2:
        jerk = {"jerk": [0.5]} if order > 3 else {}
        ends[0] = State([0.2], [0.3], a=[0.4], **jerk)
    grid = Grid.uniform(1.0, 3, galerkin(1, derivatives=order))
    problem = hovi.TrajectoryProblem(hovi.DiscreteLagrangian(hovi.spline(1, order), grid), *ends)
    state = first_state(problem.guess("cubic"))
    for key in ("q", "v", "a", "jerk")[:order]:
        np.testing.assert_allclose(getattr(state, key), getattr(ends[0], key), atol=1e-12)
    assert order > 3 or state.jerk is None
