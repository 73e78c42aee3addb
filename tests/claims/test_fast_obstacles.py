"""No success passes an obstacle that crosses the arm's way within a millisecond or less.

Distances by Coal on the given collision meshes, at instants that are dense where it moves.
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

import hovi

ROBOT = hovi.load_robot("ur5")
SCENE = hovi.Scene(ROBOT, [hovi.effects.Gravity()])
START = [0.0, -1.2, 1.0, -0.6, -0.8, 0.2]
GOAL = [0.9, -0.9, 1.3, -0.9, -0.5, 0.6]
T, MARGIN = 1.5, 0.01
SLACK = 2e-6
"""What distances may be short of the margin, in [m]."""


def planned(obstacles: list[Any], **options: Any) -> hovi.Solution:
    given = {"limits": "none", "self_collision": False, "margin": MARGIN, "time_limit": 10.0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return hovi.plan(SCENE, START, GOAL, T, obstacles=obstacles, **given | options)


FREE = planned([])


def tip_at(t: float) -> np.ndarray:
    """Where the tool of the motion without obstacles is."""
    data = ROBOT.model.createData()
    pin.framesForwardKinematics(ROBOT.model, data, FREE.trajectory.sample([t]).q[0])
    return data.oMf[ROBOT.model.getFrameId("tool0")].translation.copy()


def flying_ball(at: float, width: float, side: np.ndarray, radius: float) -> tuple[Any, Any]:
    """A ball that passes the tool's way between at - width and at + width, and where it is."""
    times, middle = np.array([at - width, at + width]), tip_at(at)
    ends = np.array([middle + side, middle - side])
    path = {"times": times.tolist(), "positions": ends.tolist()}
    ball = hovi.Sphere([0.0, 0.0, 0.0], radius, name="ball", path=path)
    return ball, lambda t: np.array([np.interp(t, times, ends[:, i]) for i in range(3)])


def least_distance(motion: hovi.Trajectory, where: Any, radius: float, t: np.ndarray) -> float:
    """The least distance of the ball from a moving link's mesh at times t."""
    geometry = ROBOT.collision
    data, places = ROBOT.model.createData(), geometry.createData()
    sphere, least = coal.Sphere(radius), np.inf
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    for time, q in zip(t, motion.sample(t).q, strict=True):
        pin.updateGeometryPlacements(ROBOT.model, data, geometry, places, q)
        center = where(time)
        for item, place in zip(geometry.geometryObjects, places.oMg, strict=True):
            if item.parentJoint == 0 or np.linalg.norm(place.translation - center) > 1.0:
                continue
            result.clear()
            at = coal.Transform3s(place.rotation, place.translation)
            ball_at = coal.Transform3s(np.eye(3), center)
            distance = coal.distance(item.geometry, at, sphere, ball_at, request, result)
            least = min(least, distance)
    return float(least)


def assert_clear(found: hovi.Solution, where: Any, at: float, width: float, radius: float) -> None:
    if not found.success:
        assert found.message
        return
    crossing = np.linspace(at - width, at + width, 801)
    t = np.unique(np.clip(np.concatenate([np.linspace(0.0, T, 61), crossing]), 0.0, T))
    assert least_distance(found.trajectory, where, radius, t) >= MARGIN - SLACK


@pytest.mark.parametrize(
    ("at", "width"),
    [(0.7123, 1e-3), (0.9, 1e-4), pytest.param(0.5, 1e-5, marks=pytest.mark.long)],
)
def test_a_ball_that_crosses_the_way_is_avoided_or_said(at: float, width: float) -> None:
    ball, where = flying_ball(at, width, np.array([0.0, 0.0, 2.0]), 0.03)
    assert least_distance(FREE.trajectory, where, 0.03, np.array([at])) < MARGIN
    found = planned([ball])
    assert_clear(found, where, at, width, 0.03)
    assert not found.success or found.cost > FREE.cost


@pytest.mark.parametrize("at", [0.3371, 0.7423])
def test_margins_see_a_ball_that_passes_between_two_samples(at: float) -> None:
    ball, where = flying_ball(at, 2e-4, np.array([0.0, 2.0, 0.0]), 1.2)
    assert FREE.problem is not None
    problem = dataclasses.replace(FREE.problem, clearance=hovi.Clearance([ball]))
    margins = dataclasses.replace(FREE, problem=problem).margins()
    least = least_distance(FREE.trajectory, where, 1.2, np.array([at]))
    assert margins.distance is not None
    assert margins.distance <= least + SLACK


def test_margins_of_a_motion_that_cannot_avoid_it_see_the_ball() -> None:
    """It is as large as the arm."""
    ball, where = flying_ball(0.7123, 2e-4, np.array([0.0, 2.0, 0.0]), 1.2)
    found = planned([ball], intervals=12, max_iterations=3, continuation=False)
    assert least_distance(found.trajectory, where, 1.2, np.array([0.7123])) < 0.0
    assert found.margins().distance < 0.0
    assert not found.usable
    assert not found.success


@pytest.mark.long
@pytest.mark.parametrize("seed", range(16))
def test_no_success_is_passed_too_closely(seed: int) -> None:
    random = np.random.default_rng(seed)
    at, width = float(random.uniform(0.3, 1.2)), float(10 ** random.uniform(-5, -1.5))
    side, radius = random.normal(size=3), float(random.uniform(0.02, 0.1))
    side *= random.uniform(0.5, 3.0) / np.linalg.norm(side)
    ball, where = flying_ball(at, width, side, radius)
    limits = "urdf" if seed % 2 else "none"
    assert_clear(planned([ball], limits=limits), where, at, width, radius)
