"""Starts and goals at their margin to an obstacle or a link, to a few micrometres, are planned."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.planning.clearance.distances import Distances

Array = npt.NDArray[np.float64]

START = np.array([0.0, -1.2, 1.2, -0.5, 0.3, 0.1])
GOAL = np.array([0.9, -0.9, 0.8, -0.2, 0.5, 0.6])
MARGIN, RADIUS = 0.01, 0.05
OPTIONS = {"self_collision": False, "intervals": 16}


@pytest.fixture(scope="module")
def scene(ur5: hovi.Robot) -> hovi.Scene:
    return hovi.Scene(ur5, [hovi.effects.Gravity()])


def ball(scene: hovi.Scene, q: Array, direction: list[float], gap: float) -> hovi.Sphere:
    """A ball beside the tool, a gap beyond the margin away from the arm at a configuration."""
    tip = scene.robot.frame_position("tool0", q)
    u = np.array(direction) / np.linalg.norm(direction)
    near, far = 0.0, 0.5
    for _ in range(60):
        middle = 0.5 * (near + far)
        at = hovi.Sphere(tip + middle * u, RADIUS, name="ball")
        closer = distance(scene, q, at) < MARGIN + gap
        near, far = (middle, far) if closer else (near, middle)
    return hovi.Sphere(tip + far * u, RADIUS, name="ball")


def distance(scene: hovi.Scene, q: Array, at: hovi.Sphere) -> float:
    return float(Distances(scene.robot, hovi.Clearance([at])).values(np.atleast_2d(q)).min())


@pytest.mark.parametrize("direction", [[1.0, 0.0, 0.3], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
@pytest.mark.parametrize("gap", [-5e-6, -1e-7, 0.0, 1e-7, 5e-6])
def test_a_start_at_the_margin_is_planned(
    scene: hovi.Scene, direction: list[float], gap: float
) -> None:
    at = ball(scene, START, direction, gap)
    found = hovi.plan(scene, START, GOAL, 1.5, obstacles=[at], **OPTIONS)
    assert found.success == found.usable
    assert found.usable, found.message
    q = found.trajectory.sample(np.linspace(0.0, 1.5, 2000)).q
    assert distance(scene, q, at) >= MARGIN + min(gap, 0.0) - 1e-8
    assert ("nearer than the margin at an end" in found.message) == (gap < 0)


def test_a_goal_at_the_margin_is_planned(scene: hovi.Scene) -> None:
    at = ball(scene, START, [0.0, -1.0, 0.0], -2e-6)
    found = hovi.plan(scene, GOAL, START, 1.5, obstacles=[at], **OPTIONS)
    assert found.usable, found.message
    again = found.replan(GOAL + 0.01)
    assert again.usable, again.message


def test_a_start_that_is_nearer_is_refused_with_figures_that_differ(scene: hovi.Scene) -> None:
    at = ball(scene, START, [0.0, -1.0, 0.0], -2e-5)
    found = hovi.plan(scene, START, GOAL, 1.5, obstacles=[at], **OPTIONS)
    assert found.status == "infeasible"
    numbers = re.search(
        r"are ([0-9.e-]+) m apart, less than the margin of ([0-9.e-]+) m", found.message
    )
    assert numbers is not None, found.message
    assert float(numbers[1]) < float(numbers[2])
