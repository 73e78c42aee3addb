"""Guesses along paths: their spline, their timing, their depth in obstacles."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import hovi
from hovi.discrete.grid import Grid
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.paths.free_space import FreeSpace
from hovi.planning.paths.path_guess import (
    DRAWS,
    depth_of,
    fast_path,
    motion_along,
    natural_slopes,
    on_spline,
)
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot

T = 1.7
FAST = [2.0, 0.5]
"""Velocity limits of both joints, in [rad/s]."""
POINTS = np.array([[0.0, 0.0], [0.1, 0.5], [0.2, 0.9], [0.4, 0.2], [0.5, 0.0]])
"""A path in coordinates of a free space."""


def problem_of(robot: Robot, *obstacles: Obstacle, order: int = 2) -> TrajectoryProblem:
    """From (0, 0) to (1, 0), a turn of the whole arm."""
    effects = [hovi.effects.JerkCost(0.1)] if order == 3 else []
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), *effects])
    scheme = hovi.schemes.of_order(hovi.schemes.by_name("galerkin-2"), order)
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(T, 12, scheme))
    limits = as_limits(robot, {"base": "none", "v": FAST})
    ends = hovi.State([0.0, 0.0]), hovi.State([1.0, 0.0])
    return TrajectoryProblem(ld, *ends, limits, clearance=hovi.Clearance(obstacles))


def ball(at: float = 0.5, radius: float = 0.2) -> hovi.Sphere:
    """On the forearm's way, at an angle of the arm."""
    return hovi.Sphere([2.0 * np.cos(at), 0.0, 2.0 * np.sin(at)], radius)


def test_the_spline_is_the_natural_one() -> None:
    u = np.array([0.0, 0.1, 0.35, 0.8, 1.0])
    known = CubicSpline(u, POINTS, bc_type="natural")
    slopes = natural_slopes(u, POINTS)
    np.testing.assert_allclose(slopes, known(u, 1), atol=1e-12)
    at = np.linspace(0.0, 1.0, 57)
    for k, found in enumerate(on_spline(u, POINTS, slopes, at)):
        np.testing.assert_allclose(found, known(at, k), atol=1e-10)


@pytest.mark.parametrize("order", [2, 3])
def test_rates_are_derivatives_and_vanish_at_the_ends(two_link: Robot, order: int) -> None:
    space = FreeSpace.of(problem_of(two_link, ball(), order=order), np.zeros(2))
    assert space is not None
    curve, t, e = motion_along(space, POINTS, T), np.linspace(0.11, T - 0.17, 9), 1e-5
    jet = curve(t)
    assert len(jet) == order + 1
    for k in range(order):
        slope = (curve(t + e)[k] - curve(t - e)[k]) / (2 * e)
        np.testing.assert_allclose(jet[k + 1], slope, atol=1e-6 * max(1.0, np.abs(slope).max()))
    q, v, a = curve(np.array([0.0, T]))[:3]
    np.testing.assert_allclose(q, POINTS[[0, -1]] * FAST, atol=1e-12)
    assert np.abs(v).max() < 1e-12
    assert np.abs(a).max() < 1e-9


def test_parts_take_the_time_that_their_slowest_joint_needs(two_link: Robot) -> None:
    """Of a path of two straight parts, the second twice as long for a joint at full speed."""
    space = FreeSpace.of(problem_of(two_link, ball()), np.zeros(2))
    assert space is not None
    points = np.array([[0.0, 0.0], [0.3, 0.1], [0.4, 0.7]])
    t = np.linspace(0.0, T, 20_001)
    q = motion_along(space, points, T)(t)[0]
    s = t[np.argmin(np.abs(q - points[1] * FAST).sum(axis=1))] / T
    assert 10 * s**3 - 15 * s**4 + 6 * s**5 == pytest.approx(1 / 3, abs=1e-3)


def test_a_guess_along_a_path_has_the_ends_of_the_problem(two_link: Robot) -> None:
    problem = problem_of(two_link, ball())
    space = FreeSpace.of(problem, np.zeros(2))
    assert space is not None
    points = np.array([[0.0, 0.0], [0.2, 1.0], [0.5, 0.0]])
    guess = problem.path(motion_along(space, points, T))
    np.testing.assert_array_equal(guess.q[[0, -1]], [[0.0, 0.0], [1.0, 0.0]])


def test_depth_is_by_how_much_the_margin_is_missed(two_link: Robot) -> None:
    """The forearm, of radius 0.035 m, passes through the middle of a ball."""
    problem = problem_of(two_link, ball(radius=0.2))
    margin = problem.clearance.margin  # type: ignore[union-attr]
    depth = depth_of(problem, problem.guess("cubic"))
    assert depth == pytest.approx(0.2 + 0.035 + margin, abs=1e-3)
    free = problem_of(two_link, ball(at=2.5))
    assert depth_of(free, free.guess("cubic")) < 0


def test_straight_motions_are_looked_at_all_along(two_link: Robot) -> None:
    space = FreeSpace.of(problem_of(two_link, ball(radius=0.02)), np.zeros(2))
    assert space is not None
    past, before = np.array([0.5, 0.0]), np.array([0.2, 0.0])
    assert not space.is_free_between(np.zeros(2), past)
    assert space.is_free_between(np.zeros(2), before)
    folded = np.array([0.0, 4.0])
    assert space.is_free_between(folded, folded + past)


@pytest.mark.parametrize("kind", ["moving", "passive", "nothing"])
def test_problems_for_which_paths_say_too_little_have_no_space(two_link: Robot, kind: str) -> None:
    moving = hovi.Sphere(
        [2.0, 0.0, 1.0], 0.1, path={"times": [0, 1], "positions": [[0, 0, 0], [0, 0, 1]]}
    )
    if kind == "passive":
        scene = hovi.Scene(two_link, [], passive=["elbow"])
        grid = Grid.uniform(T, 12, hovi.schemes.by_name("galerkin-2"))
        ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
        ends = hovi.State([0.0, 0.0]), hovi.State([1.0, 0.0])
        problem = TrajectoryProblem(ld, *ends, clearance=hovi.Clearance([ball()]))
    else:
        problem = problem_of(two_link, *([moving] if kind == "moving" else []))
    assert FreeSpace.of(problem, np.zeros(2)) is None
    assert depth_of(problem, problem.guess("cubic")) == -np.inf


class Paths:
    """Answers with given paths, and counts how many it was asked for."""

    def __init__(self, *paths: np.ndarray) -> None:
        self.paths, self.asked = paths, list[int]()

    def path(self, space: object, start: np.ndarray, goal: np.ndarray, seed: int) -> np.ndarray:
        self.asked.append(seed)
        return self.paths[len(self.asked) - 1]


LONG, LESS, SHORT = (np.array([[0.0, 0.0], [x, x], [0.5, 0.0]]) for x in (2.0, 1.0, 0.5))
"""Paths that take 4, 2 and 1 s at the largest velocities."""
STRAIGHT_ON = np.array([[0.0, 0.0], [0.25, 0.25], [0.5, 0.0]])
"""A path that takes no longer than the straight one."""


@pytest.mark.parametrize(
    ("paths", "duration", "taken", "asked"),
    [
        ((LESS, LONG, SHORT, LONG), 4.0, LESS, 1),  # fits
        ((LONG, LESS, SHORT, LONG), 4.0, LESS, 2),
        ((LONG, LESS, LONG, LONG, SHORT), 0.1, LESS, 4),  # the shortest of four
        ((LESS, 0.9 * LESS, LONG, LONG), 0.1, LESS, 4),  # not much shorter
        ((LONG, STRAIGHT_ON, LESS, LONG), 0.1, STRAIGHT_ON, 2),  # none is shorter
    ],
)
def test_the_first_path_is_taken_that_is_fast_enough(
    two_link: Robot, paths: tuple[np.ndarray, ...], duration: float, taken: np.ndarray, asked: int
) -> None:
    source, ends = Paths(*paths), (np.zeros(2), np.array([0.5, 0.0]))
    space = FreeSpace.of(problem_of(two_link, ball()), np.zeros(2))
    assert space is not None
    found = fast_path(source, space, ends, range(3, 23, 5)[:DRAWS], duration)  # type: ignore[arg-type]
    np.testing.assert_array_equal(found, taken)
    assert source.asked == [3, 8, 13, 18][:asked]
