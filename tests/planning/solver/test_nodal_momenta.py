"""Momenta at the nodes, which are accumulated along a motion."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi import Solution, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q, REACH_V


def problem_of(scene: Scene, intervals: int) -> TrajectoryProblem:
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, intervals, galerkin(3)))
    return TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V))


def reach(scene: Scene, intervals: int) -> Solution:
    return solve(problem_of(scene, intervals))


@pytest.mark.parametrize("gravity", [True, False])
def test_they_match_a_coarser_motion_to_rounding(
    arm_scene: Scene, two_link: Robot, gravity: bool
) -> None:
    scene = arm_scene if gravity else Scene(two_link)
    fine, coarse = reach(scene, 1000), reach(scene, 125)
    p, expected = fine.trajectory.momenta[::8], coarse.trajectory.momenta
    for row in (0, 1):
        size = np.abs(expected[:, row]).max()
        np.testing.assert_allclose(p[:, row], expected[:, row], rtol=0, atol=2e-12 * size)


def test_they_match_evaluated_momenta_to_rounding(arm_scene: Scene) -> None:
    found = reach(arm_scene, 1000)
    assert found.problem is not None
    evaluated = found.problem.ld.momenta(found.trajectory.path)
    gap = np.abs(found.trajectory.momenta - evaluated).max()
    assert 0 < gap < 1e-10 * np.abs(evaluated).max()


def test_momenta_that_jump_are_evaluated(arm_scene: Scene) -> None:
    """Those of a motion that is not stationary yet."""
    found = solve(problem_of(arm_scene, 16), max_iterations=1)
    assert found.problem is not None
    D, p = found.problem.ld.derivatives(found.trajectory.path), found.trajectory.momenta
    assert np.abs(D[1:, :2] + D[:-1, 2:]).max() > 1e-3 * np.abs(D).max()
    np.testing.assert_array_equal(p[:-1], -D[:, :2])
    np.testing.assert_array_equal(p[-1], D[-1, 2:])


def test_nan_is_propagated(arm_scene: Scene) -> None:
    problem = problem_of(arm_scene, 4)
    path = problem.guess("cubic")
    far = dataclasses.replace(path, inner=np.full_like(path.inner, 1e200))
    with np.errstate(over="ignore", invalid="ignore"):
        found = solve(problem, far)
    assert found.status == "diverged"
    assert np.isnan(found.trajectory.momenta).all()
