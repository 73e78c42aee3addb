"""Paths by OMPL in a process of its own, and what happens where that process fails."""

from __future__ import annotations

import time
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.paths import ompl_paths
from hovi.planning.paths.free_space import FreeSpace
from hovi.planning.paths.ompl_paths import OmplProcess
from hovi.planning.paths.path_guess import depth_of, path_guesses
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.system.deadline import Deadline, OutOfTimeError
from planning.paths.test_path_guess import ball, problem_of

needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="needs the extra `obstacles`")


def space_of(robot: Robot, *obstacles: Obstacle) -> tuple[FreeSpace, np.ndarray]:
    """The space of a problem with obstacles, and the coordinates of its goal."""
    space = FreeSpace.of(problem_of(robot, *obstacles), np.zeros(2))
    assert space is not None
    return space, space.x_between(np.zeros(2), np.array([1.0, 0.0]))


@needs_ompl
def test_a_path_leads_around_the_obstacle_and_a_seed_repeats_it(two_link: Robot) -> None:
    space, goal = space_of(two_link, ball())
    found = []
    for seed in (0, 0, 1):
        with OmplProcess() as ompl:
            points = ompl.path(space, np.zeros(2), goal, seed)
        assert points is not None
        found.append(points)
        np.testing.assert_allclose(points[[0, -1]], [np.zeros(2), goal], atol=1e-12)
        dense = np.concatenate([np.linspace(a, b, 50) for a, b in pairwise(points)])
        assert space.depth(space.q(dense)) < 0.005
    np.testing.assert_array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


@needs_ompl
def test_guesses_along_paths_are_free_where_the_direct_one_is_deep(two_link: Robot) -> None:
    problem = problem_of(two_link, ball())
    direct = problem.guess("cubic")
    guesses = list(path_guesses(problem, direct, 3, 0))
    assert len(guesses) == 3
    assert depth_of(problem, direct) > 0.1
    assert max(depth_of(problem, guess) for guess in guesses) < 0.01


@needs_ompl
def test_a_goal_that_is_enclosed_has_no_path(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Balls at both sides of the goal, which hold the upper arm."""
    monkeypatch.setattr(ompl_paths, "MAX_MOTIONS", 300)
    walls = [hovi.Sphere([np.cos(x), 0.0, np.sin(x)], 0.1, name=f"{x}") for x in (0.8, 1.2)]
    space, goal = space_of(two_link, *walls)
    with OmplProcess() as ompl:
        assert ompl.path(space, np.zeros(2), goal, 0) is None


@needs_ompl
def test_the_time_limit_ends_a_path(two_link: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Questions are answered so slowly that only the deadline can be what ended it."""
    space, goal = space_of(two_link, ball())
    answer = FreeSpace.is_free_between

    def slow(self: FreeSpace, x: np.ndarray, y: np.ndarray) -> bool:
        time.sleep(0.5)
        return answer(self, x, y)

    monkeypatch.setattr(FreeSpace, "is_free_between", slow)
    with pytest.raises(OutOfTimeError), Deadline(1.0).in_force(), OmplProcess() as ompl:
        ompl.path(space, np.zeros(2), goal, 0)


@pytest.mark.parametrize(
    "program",
    [
        "import os; os.abort()",
        "import sys; sys.stdin.readline(); print('no JSON', flush=True)",
        "import sys; sys.stdin.readline(); print('[1]', flush=True)",
        "import time; time.sleep(60)",
        "import sys; sys.stdin.readline(); print('{\"from\": [0]}', flush=True)",
    ],
)
def test_a_process_that_fails_gives_no_path(
    two_link: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    script = tmp_path / "failing"
    script.write_text(program)
    monkeypatch.setattr(ompl_paths, "_WORKER", script)
    monkeypatch.setattr(ompl_paths, "MAX_SILENCE", 0.5)
    space, goal = space_of(two_link, ball())
    with OmplProcess() as ompl:
        assert ompl.path(space, np.zeros(2), goal, 0) is None


@needs_ompl
def test_a_path_passes_its_via_points(two_link: Robot) -> None:
    """Of a frame, found by inverse kinematics, with the elbow folded before the ball."""
    problem, time = problem_of(two_link, ball()), 0.6
    via = hovi.Via(time, hovi.FrameGoal("tip", position=[1.2, 0.0, 0.2]))
    grid = problem.grid.with_nodes([time])
    ld = hovi.DiscreteLagrangian(problem.scene.effort_lagrangian(), grid)
    ends, clearance = (problem.start, problem.goal), problem.clearance
    passing = TrajectoryProblem(ld, *ends, problem.limits, via=[via], clearance=clearance)
    (guess,) = path_guesses(passing, passing.guess("cubic"), 1, 0)
    at = two_link.frame_position("tip", guess.q[grid.node_at(time)][None])[0]
    np.testing.assert_allclose(at, [1.2, 0.0, 0.2], atol=1e-8)
    assert depth_of(passing, guess) < 0.01
