"""Guesses moved out of obstacles keep their ends and their distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import hovi
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.seams import Seam
from hovi.planning.search.job import Job
from hovi.planning.solver.near.approaches import free_ones
from hovi.planning.solver.near.push_out import pushed_out
from hovi.planning.solver.solver import guess_path

LEAST = 0.02


def job_of(goal: hovi.State | hovi.FrameGoal) -> Job:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    grid = hovi.Grid.uniform(2.0, 8, hovi.schemes.galerkin(2))
    return Job(task.scene, grid, hovi.State([0.0, -1.2, 1.2, -0.5, 0.3, 0.1]), goal)


def test_a_motion_through_a_ball_goes_around_it() -> None:
    problem = job_of(hovi.State([1.8, -1.0, 1.4, -0.5, 0.3, 0.1])).problem()
    path = guess_path(problem, "cubic")
    middle = problem.trajectory(path).configurations(np.array([1.0]))
    tip = problem.robot.frame_position("tool0", middle)[0]
    distances = Distances(problem.robot, Clearance([hovi.Sphere(tip, 0.05)]))
    t = np.linspace(0.0, 2.0, 2001)
    assert distances.values(problem.trajectory(path).configurations(t)).min() < -0.02
    moved = pushed_out(problem, path, distances, LEAST)
    assert moved is not None
    q = problem.trajectory(moved).configurations(t)
    assert distances.values(q).min() > LEAST - 5e-3  # it is looked at 32 times
    for node in (0, -1):
        np.testing.assert_allclose(moved.q[node], path.q[node], atol=1e-12)
        np.testing.assert_allclose(moved.v[node], path.v[node], atol=1e-12)


def test_a_goal_of_a_frame_stays_met() -> None:
    end = [1.8, -1.0, 1.4, -0.5, 0.3, 0.1]
    known = job_of(hovi.State(end)).problem()
    position = known.robot.frame_position("tool0", np.array([end]))[0]
    problem = job_of(hovi.FrameGoal("tool0", position=position)).problem()
    path = guess_path(known, "cubic")
    middle = known.trajectory(path).configurations(np.array([1.2]))
    tip = known.robot.frame_position("tool0", middle)[0]
    distances = Distances(known.robot, Clearance([hovi.Sphere(tip, 0.05)]))
    moved = pushed_out(problem, path, distances, LEAST)
    assert moved is not None
    reached = known.robot.frame_position("tool0", moved.q[-1:])[0]
    np.testing.assert_allclose(reached, position, atol=5e-3)


def test_a_motion_that_cannot_leave_is_given_up() -> None:
    problem = job_of(hovi.State([0.1, -1.2, 1.2, -0.5, 0.3, 0.1])).problem()
    path = guess_path(problem, "cubic")
    around = hovi.Box((4.0, 4.0, 4.0), [0.0, 0.0, 0.0])
    distances = Distances(problem.robot, Clearance([around]))
    assert pushed_out(problem, path, distances, LEAST) is None


@pytest.mark.parametrize("free", [(), ("all",)])
def test_what_seams_give_stays(free: Sequence[str]) -> None:
    robot = hovi.load_robot("ur5")
    ends = [[0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [0.9, -1.2, 1.2, -0.5, 0.3, 0.1]]
    ends.append([1.8, -1.2, 1.2, -0.5, 0.3, 0.1])
    scene = hovi.Scene(robot, [])
    grids = [hovi.Grid.uniform(1.0, 8, hovi.schemes.galerkin(2)) for _ in range(2)]
    parts = [hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid) for grid in grids]
    seam = Seam(1.0, hovi.State(ends[1], free_velocity=free))
    known = hovi.State(ends[0]), hovi.State(ends[2])
    problem = hovi.TrajectoryProblem.of_segments(parts, *known, via=(seam,))
    path = guess_path(problem, "cubic")
    at = robot.frame_position("tool0", problem.trajectory(path).configurations([0.55]))[0]
    distances = Distances(robot, Clearance([hovi.Sphere(at, 0.05)]))
    moved = pushed_out(problem, path, distances, LEAST)
    assert moved is not None
    np.testing.assert_allclose(moved.q[8], ends[1], atol=1e-12)
    if not free:
        np.testing.assert_allclose(moved.v[8], 0.0, atol=1e-12)
    q = problem.trajectory(moved).configurations(np.linspace(0.0, 2.0, 2001))
    assert distances.values(q).min() > LEAST - 5e-3
    beside = problem.trajectory(moved).configurations(np.array([0.99, 1.01]))
    assert np.abs(beside - np.array(ends[1])).max() < 0.1  # no jump at the seam
    assert not free_ones(problem, 16 * 4 + 1)[8 * 4]
    assert free_ones(problem, 16 * 4 + 1).sum() == 16 * 4 + 1 - 3
