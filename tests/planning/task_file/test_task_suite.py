"""The suite of tasks: every file is a task whose start and goal are free."""

from __future__ import annotations

import sys
import tomllib
import warnings
from collections import Counter
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import HoviWarning
from hovi.robot.bundled_models import example_scenes, task_suite

TOP = Path(__file__).resolve().parents[3]
SUITE = task_suite()
ROBOTS = {"ur5", "panda", "kinova", "xarm7", "z1", "../../four_axis_arm.urdf", "tiago_no_hand"}
SHORT = 60.0
"""Time limit of a plan in the long test, in [s]."""


@cache
def benchmark(name: str) -> ModuleType:
    """A script of examples/benchmarks as a module."""
    folder = str(TOP / "examples" / "benchmarks")
    spec = spec_from_file_location(name, f"{folder}/{name}.py")
    assert spec is not None
    assert spec.loader is not None
    sys.modules[name] = module = module_from_spec(spec)
    sys.path.insert(0, folder)
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(folder)
    return module


def test_the_suite_has_forty_tasks_of_seven_robots() -> None:
    assert len(SUITE) == len({path.stem for path in SUITE}) == 40
    assert {tomllib.loads(path.read_text())["robot"] for path in SUITE} == ROBOTS
    assert max(Counter(path.parent for path in SUITE).values()) <= 15
    assert not {path.stem for path in SUITE} & set(example_scenes())


@pytest.mark.parametrize("path", SUITE, ids=lambda path: path.stem)
def test_a_task_says_why_and_leaves_all_settings_at_their_defaults(path: Path) -> None:
    text = path.read_text()
    assert text.startswith("# ")
    settings = {"scheme", "tolerance", "time_limit", "starts", "guess", "max_iterations"}
    assert not settings & set(tomllib.loads(text))
    assert hovi.example(path.stem) == path


@pytest.mark.parametrize("path", SUITE, ids=lambda path: path.stem)
def test_start_and_goal_of_a_task_are_free(path: Path) -> None:
    """By the robot's meshes, which Pinocchio and Coal place and measure alone."""
    task = hovi.load_task(path)
    ends = benchmark("tasks")._branches
    robot, options = task.scene.robot, task.options
    if options.grasped:
        robot = hovi.holding(robot, options.grasped)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", HoviWarning)
        start = ends(task, robot, task.start, None)[0]
        goal = ends(task, robot, task.goal, start)[0]
    files = benchmark("tasks").robot_files(path)
    world = benchmark("task_world").read_world(path, files)
    found, pair = benchmark("task_world").least_clearance(world, np.array([start, goal]))
    assert found >= world.margin, pair
    if isinstance(task.goal, hovi.FrameGoal):
        data = world.model.createData()
        pin.framesForwardKinematics(world.model, data, np.array(goal))
        at = data.oMf[world.model.getFrameId(task.goal.frame)].translation
        np.testing.assert_allclose(at, task.goal.position, atol=1e-8)


@pytest.mark.parametrize("name", ["ur5_over_fence", "kinova_around_globe"])
def test_the_least_clearance_is_that_of_all_samples(name: str) -> None:
    """Bounds on how far shapes move leave none out: against every pair at every sample."""
    path = hovi.example(name)
    task = hovi.load_task(path)
    robot = task.scene.robot
    start, goal = robot.neutral(), task.start.on(robot, "start")[0]  # type: ignore[union-attr]
    x = robot.difference(start, goal)
    q = np.array([robot.integrate(start, s * x) for s in np.linspace(0.0, 1.0, 300)])
    world = benchmark("task_world").read_world(path, benchmark("tasks").robot_files(path))
    found, _ = benchmark("task_world").least_clearance(world, q)
    data, placed = world.model.createData(), world.geometry.createData()
    least = np.inf
    for each in q:
        pin.computeDistances(world.model, data, world.geometry, placed, each)
        least = min(least, *(result.min_distance for result in placed.distanceResults))
    assert found == pytest.approx(least, abs=1e-9)


@pytest.mark.parametrize("name", ["tiago_shelf_to_table", "four_axis_into_crate"])
def test_a_way_past_obstacles_is_found(name: str) -> None:
    """Through none of which a straight guess leads: from several sides, or with more time first."""
    found = benchmark("tasks").planned(hovi.example(name), SHORT)
    assert found["success"], found
    assert found["clearance"] >= found["margin"] - 1e-6, found["pair"]


@pytest.mark.long
@pytest.mark.parametrize("path", SUITE, ids=lambda path: path.stem)
def test_a_minimum_keeps_its_margin_at_50000_times(path: Path) -> None:
    found = benchmark("tasks").planned(path, SHORT)
    assert found["status"] not in ("InputError", "ModelError", "SceneError", "UnreachableError")
    if found["success"]:
        assert found["clearance"] >= found["margin"] - 1e-6, found["pair"]
