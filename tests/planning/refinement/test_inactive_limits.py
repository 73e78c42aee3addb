"""Which motions are refined without their limits: minima far from all of them, and no others."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from hovi import Solution, Status
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.obstacles import Sphere
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.inactive_limits import far_from_limits, without_limits
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_Q

FAR_AWAY = Sphere([0.0, 2.8, 0.0], 0.1)


def reached(scene: Scene, limits: Any, **more: Any) -> Solution:
    """The reach of the arm within limits."""
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(1.0, 12, galerkin(2)))
    bounds = None if limits is None else as_limits(scene.robot, {"base": "none", **limits})
    return solve_on_grid(TrajectoryProblem(ld, State(HANG), State(REACH_Q), bounds, **more))


@pytest.fixture(scope="module")
def peak(arm_scene: Scene) -> float:
    """The largest speed of a joint without limits, in [rad/s]."""
    motion = reached(arm_scene, None).trajectory
    return float(np.abs(motion.sample(np.linspace(0.0, 1.0, 2001)).v).max())


def test_limits_that_are_far_away_are_inactive(arm_scene: Scene, peak: float) -> None:
    far = reached(arm_scene, {"v": 1.5 * peak})
    assert far_from_limits(far)
    alone = without_limits(far)
    assert alone.problem is not None
    assert not alone.problem.limited


def test_a_limit_that_the_motion_touches_is_active(arm_scene: Scene, peak: float) -> None:
    near = reached(arm_scene, {"v": 0.9 * peak})
    assert near.success
    assert not far_from_limits(near)


def test_a_motion_without_limits_has_none_to_leave_out(arm_scene: Scene) -> None:
    assert not far_from_limits(reached(arm_scene, None))


def test_a_motion_among_obstacles_keeps_its_limits(arm_scene: Scene, peak: float) -> None:
    """However far away the obstacles are."""
    clearance = Clearance([FAR_AWAY], 0.05)
    found = reached(arm_scene, {"v": 1.5 * peak}, clearance=clearance)
    assert found.success
    assert not far_from_limits(found)


@pytest.mark.parametrize("status", [s for s in Status if s is not Status.MINIMUM])
def test_a_motion_that_is_no_minimum_keeps_its_limits(
    arm_scene: Scene, peak: float, status: Status
) -> None:
    found = reached(arm_scene, {"v": 1.5 * peak})
    assert not far_from_limits(dataclasses.replace(found, success=False, status=status))
