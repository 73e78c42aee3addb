"""Near guesses: how near they are, and turns of continuous joints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.accuracy.guess_motion import MAX_DISTANCE, RESOLVED_FRACTION, guess_curve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve, cubic, with_bump, with_turns
from hovi.discrete.state import State
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from samples.manifold_robots import chain

T = 2.0
TIMES = np.linspace(0.0, T, 5001)
START, GOAL = [0.4, -0.3], [1.1, 0.9]


def problem_of(scene: Scene) -> TrajectoryProblem:
    """From START to GOAL; angles of continuous joints are single numbers."""
    robot = scene.robot
    start, goal = (robot.integrate(robot.neutral(), np.array(x)) for x in (START, GOAL))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), Grid.uniform(T, 64, galerkin(4)))
    return TrajectoryProblem(ld, State(start), State(goal))


def near(problem: TrajectoryProblem, motion: Curve) -> Curve:
    return guess_curve("near", problem, problem.trajectory(problem.path(motion)))


def angles(scene: Scene, q: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Angles of two continuous joints at TIMES, without jumps, (M, 2)."""
    return np.unwrap(np.arctan2(q[:, 1::2], q[:, ::2]), axis=0)


@pytest.mark.parametrize("turns", [1, -2])
def test_the_near_guess_turns_as_often_as_the_motion(turns: int) -> None:
    scene = Scene(load_robot(chain([pin.JointModelRUBX(), pin.JointModelRUBY()])), [])
    problem = problem_of(scene)
    plain = cubic(scene.robot, problem.ends, T)
    motion = with_turns(plain, scene.robot, T, np.array([0.0, float(turns)]))
    q, v, _ = near(problem, motion)(TIMES)
    whole = np.subtract(GOAL, START) + np.array([0.0, 2 * np.pi * turns])
    angle = angles(scene, q)
    np.testing.assert_allclose(angle[-1] - angle[0], whole, atol=1e-9)
    np.testing.assert_allclose(np.trapezoid(v, TIMES, axis=0), whole, atol=1e-5)
    assert np.abs(np.diff(angle, axis=0)).max() <= 1.1 * np.abs(v).max() * (TIMES[1] - TIMES[0])


def test_the_near_guess_follows_a_motion_that_is_beyond_half_a_turn_on_its_way() -> None:
    scene = Scene(load_robot(chain([pin.JointModelRUBX(), pin.JointModelRUBY()])), [])
    problem = problem_of(scene)
    plain = cubic(scene.robot, problem.ends, T)

    def motion(t: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], ...]:
        q, v, a = plain(t)
        s, w = 4.0 * np.sin(np.pi * t / T) ** 2, np.pi / T
        x = np.stack([s, 0 * s], axis=1)
        dx, ddx = 0 * x, 0 * x
        dx[:, 0] = 4.0 * w * np.sin(2 * w * t)
        ddx[:, 0] = 8.0 * w**2 * np.cos(2 * w * t)
        return scene.robot.integrate(q, x), v + dx, a + ddx

    angle = angles(scene, near(problem, motion)(TIMES)[0])
    true = angles(scene, motion(TIMES)[0])
    assert np.abs(angle - true).max() == pytest.approx(MAX_DISTANCE, rel=1e-3)


@pytest.mark.parametrize("size", [0.1, 5.0])
def test_the_near_guess_is_a_tenth_away_and_at_most_the_largest_distance(
    arm_scene: Scene, size: float
) -> None:
    problem, robot = problem_of(arm_scene), arm_scene.robot
    plain = cubic(robot, problem.ends, T)
    bump = np.abs(with_bump(plain, robot, T, seed=2)(TIMES)[0] - plain(TIMES)[0]).max()

    def motion(t: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], ...]:
        (q0, v0, a0), (q1, v1, a1) = plain(t), with_bump(plain, robot, T, seed=2)(t)
        share = size / bump
        return q0 + share * (q1 - q0), v0 + share * (v1 - v0), a0 + share * (a1 - a0)

    q, v, a = near(problem, motion)(TIMES)
    away = np.abs(q - motion(TIMES)[0]).max()
    assert away == pytest.approx(min((1 - RESOLVED_FRACTION) * size, MAX_DISTANCE), rel=1e-3)
    np.testing.assert_allclose(np.gradient(q, TIMES, axis=0)[2:-2], v[2:-2], atol=1e-3 * size)
    np.testing.assert_allclose(np.gradient(v, TIMES, axis=0)[2:-2], a[2:-2], atol=1e-2 * size)
