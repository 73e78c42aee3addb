"""Closest approaches between the samples, and their sentences, against where an arm points."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.path_on_grid import path_on_grid
from hovi.discrete.trajectory import Trajectory
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.clearance_violation import (
    approach_along,
    approach_sentence,
    distance_in_words,
    near_pairs,
)
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.obstacles import Sphere
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]
START, GOAL, T = np.array([-1.2, 0.4]), np.array([0.9, 0.4]), 1.7
PASSING = [0.17, 0.33, 0.481, 0.643, 0.79]
"""Shares of the duration at which the middle of the tip passes a ball."""


def turning(scene: hovi.Scene) -> Trajectory:
    """The shoulder turns at a constant rate, on intervals of unequal length."""
    grid = Grid(np.array([0.2, 0.5, 0.3, 0.7]), (galerkin(2),) * 4)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    rate = (GOAL - START) / T

    def curve(t: Array) -> tuple[Array, Array, Array]:
        q = START + t[:, None] * rate
        return q, np.broadcast_to(rate, q.shape).copy(), np.zeros_like(q)

    problem = TrajectoryProblem(ld, hovi.State(START, rate), hovi.State(GOAL, rate))
    return problem.trajectory(path_on_grid(curve, grid, problem.ends, scene.robot))


def tip(scene: hovi.Scene, q: Array) -> Array:
    """The origin of the tip's frame."""
    return np.asarray(scene.robot.frame_position("tip", q[None])[0])


@pytest.mark.parametrize("share", PASSING)
@pytest.mark.parametrize("radius", [0.05, 0.4])
def test_a_ball_is_closest_when_the_arm_points_at_it(
    arm_scene: hovi.Scene, share: float, radius: float
) -> None:
    """Beyond the tip, on the ray from the shoulder, which turns: there the distance is least."""
    motion = turning(arm_scene)
    q = START + share * (GOAL - START)
    ball = Sphere(1.15 * tip(arm_scene, q), radius, name="ball")
    distances = Distances(arm_scene.robot, Clearance((ball,), 0.05))
    found = approach_along(motion, distances, 1.0)
    k, pair = found.worst()
    t = float(motion.t[k] + found.at[k, pair] * motion.grid.steps[k])
    assert t == pytest.approx(share * T, abs=2e-4)
    least = float(distances.values(q[None]).min())
    assert found.distance[k, pair] == pytest.approx(least, abs=1e-7)
    assert (found.distance >= least - 1e-7).all()
    sentence = approach_sentence(motion, distances, found, 0.05)
    said = re.search(r"(overlap by|are) (\S+) m .*at t = (\S+) s, the margin is 0.05 m", sentence)
    assert said is not None, sentence
    assert float(said[3]) == pytest.approx(t, rel=1e-2)
    assert float(said[2]) == pytest.approx(abs(least), rel=1e-2)
    assert (said[1] == "overlap by") == (least < 0)
    assert "'ball'" in sentence


def test_each_pair_has_its_approach_in_each_interval(arm_scene: hovi.Scene) -> None:
    motion = turning(arm_scene)
    balls = tuple(
        Sphere(1.2 * tip(arm_scene, START + share * (GOAL - START)), 0.05) for share in PASSING
    )
    distances = Distances(arm_scene.robot, Clearance(balls, 0.05))
    found = approach_along(motion, distances, 10.0)
    s = np.linspace(0.0, 1.0, 4001)
    for k in range(motion.grid.intervals):
        dense = distances.values(motion.configurations(motion.t[k] + s * motion.grid.steps[k]))
        np.testing.assert_allclose(found.distance[k], dense.min(axis=0), atol=1e-6)
        at = distances.values(
            motion.configurations(motion.t[k] + found.at[k] * motion.grid.steps[k])
        )
        np.testing.assert_allclose(np.diagonal(at), found.distance[k], atol=1e-12)


@pytest.mark.parametrize("share", PASSING)
def test_near_pairs_are_those_whose_closest_approach_is_below_a_distance(
    arm_scene: hovi.Scene, share: float
) -> None:
    """By a micrometre, which only samples around the closest approach show."""
    motion = turning(arm_scene)
    q = START + share * (GOAL - START)
    balls = [Sphere(factor * tip(arm_scene, q), 0.05) for factor in (1.15, 1.3, 5.0)]
    distances = Distances(arm_scene.robot, Clearance(balls, 0.05))
    t = share * T + np.linspace(-0.01, 0.01, 2001)
    closest = distances.values(motion.configurations(t)).min(axis=0)
    last = [k for k, pair in enumerate(distances.pairs) if pair.link == "tip"]
    assert len(last) == len(balls)
    for k in last:
        for change, found in ((1e-6, True), (-1e-6, False)):
            near = near_pairs(motion, distances, float(closest[k]) + change)
            assert (k in near) == found
            assert [n for n in last if n < k] == [n for n in near if n in last and n < k]


def test_beyond_reach_an_approach_is_a_lower_bound(arm_scene: hovi.Scene) -> None:
    motion = turning(arm_scene)
    balls = [Sphere(factor * tip(arm_scene, START), 0.05) for factor in (1.2, 3.0)]
    distances = Distances(arm_scene.robot, Clearance(balls, 0.05))
    exactly = approach_along(motion, distances, 0.05).distance
    found = approach_along(motion, distances, 0.05, 0.5).distance
    far = exactly > 0.5
    assert far.any()
    assert (found[far] > 0.5).all()
    assert (found <= exactly + 1e-12).all()
    np.testing.assert_allclose(found[~far], exactly[~far], atol=1e-12)


@pytest.mark.parametrize(
    ("distance", "words"),
    [
        (-0.02, "overlap by 0.02 m"),
        (-1.3e-17, "touch"),
        (1.3e-17, "touch"),
        (0.004, "are 0.004 m apart"),
    ],
)
def test_shapes_whose_distance_is_a_rounding_error_touch(distance: float, words: str) -> None:
    assert distance_in_words(distance) == words
