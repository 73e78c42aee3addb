from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.nodal_momenta import accumulated_momenta
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.paper_arm import HANG, REACH_Q, REACH_V


def reach(scene: Scene, intervals: int) -> Solution:
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, intervals, galerkin(3)))
    return solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q, REACH_V)))


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


def test_momenta_that_jump_are_evaluated() -> None:
    D = np.random.default_rng(0).normal(size=(5, 4, 3))
    p = accumulated_momenta(D)
    np.testing.assert_array_equal(p[:-1], -D[:, :2])
    np.testing.assert_array_equal(p[-1], D[-1, 2:])


def test_nan_is_propagated() -> None:
    assert np.isnan(accumulated_momenta(np.full((3, 4, 2), np.nan))).all()
