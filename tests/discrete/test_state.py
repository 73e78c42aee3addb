"""State: boundary data of a motion, and configurations that look like degrees."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from hovi import plan
from hovi.cli.application import main
from hovi.discrete.state import State, warn_of_degrees
from hovi.errors import HoviWarning
from hovi.flows.simulator import simulate
from hovi.planning.problem.goals import Via
from hovi.planning.task_file.reading import load_task
from hovi.robot.example_robots import BUILT_IN_CODE, example_names
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.slider import SLIDER


def test_ends_in_degrees_cause_a_warning(arm_scene: Scene) -> None:
    with pytest.warns(HoviWarning) as caught:
        plan(arm_scene, [0.0, 0.0], [90.0, -45.0], 1.0, intervals=4, max_iterations=1)
    assert [str(each.message) for each in caught] == [
        "shoulder is 90 rad in a given configuration (1 more joint too), which looks like degrees: "
        "90 degrees are 1.571 rad; configurations are in radians."
    ]


def test_a_via_point_in_degrees_causes_a_warning(arm_scene: Scene) -> None:
    via = [Via(0.5, State([0.1, -45.0]))]
    with pytest.warns(HoviWarning, match=r"elbow is -45 rad .* are -0\.7854 rad"):
        plan(arm_scene, [0, 0], [0.2, 0], 1.0, via=via, scheme="galerkin-1", max_iterations=1)


@pytest.mark.parametrize(
    "q", [[0, -90, 90, 0, 0, 0], [15.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, -270]], ids=str
)
def test_a_configuration_far_beyond_the_range_of_a_joint_causes_a_warning(
    q: list[float], ur5: Robot
) -> None:
    """At rest, too: start and goal are the same."""
    with pytest.warns(HoviWarning, match="looks like degrees"):
        warn_of_degrees(ur5, [np.array(q, float)] * 2)
    with pytest.warns(HoviWarning, match="looks like degrees"):
        simulate(Scene(ur5), q, 0.01, intervals=1)


@pytest.mark.parametrize(
    "turned",
    [
        *([0.0, x] for x in (np.pi, 2 * np.pi, -6 * np.pi, 8 * np.pi, 1000.0, 1e6)),
        *([x, x + 1.0] for x in (90.0, 180.0, 640.0)),  # wound up before
    ],
    ids=str,
)
def test_joints_without_a_range_may_turn_and_be_wound_up(
    turned: list[float], two_link: Robot
) -> None:
    warn_of_degrees(two_link, [np.array([0.3, x]) for x in turned])


def test_a_joint_may_be_a_turn_beyond_its_range(ur5: Robot) -> None:
    """Its limits say so, if they are imposed."""
    warn_of_degrees(ur5, [ur5.lower - 6.28, ur5.upper + 6.28])


def test_a_cart_may_be_90_metres_away(tmp_path: Path) -> None:
    (tmp_path / "slider.urdf").write_text(SLIDER)
    robot = load_robot(tmp_path / "slider.urdf")
    warn_of_degrees(robot, [np.zeros(2), np.array([90.0, 0.0])])
    with pytest.warns(HoviWarning, match="swing is 90 rad"):
        warn_of_degrees(robot, [np.zeros(2), np.array([0.0, 90.0])])


@pytest.mark.parametrize("name", [name for name in example_names() if name != "cassie"])
def test_no_pose_of_an_example_robot_looks_like_degrees(name: str) -> None:
    if name in BUILT_IN_CODE:
        pytest.skip("no file")
    robot = load_robot(name)
    poses = [robot.pose(pose) for pose in robot.poses]
    for pose in [robot.neutral(), *poses]:
        warn_of_degrees(robot, [robot.neutral(), pose])


def test_no_scene_of_the_models_looks_like_degrees(models: Path) -> None:
    scenes = sorted(models.glob("*.toml"))
    assert len(scenes) > 10
    for path in scenes:
        task = load_task(path)
        robot = task.scene.robot
        ends = [end for end in (task.start, task.goal) if isinstance(end, State)]
        warn_of_degrees(robot, [end.on(robot, "end")[0] for end in ends])


def test_the_command_warns_once(models: Path, tmp_path: Path, capsys) -> None:
    scene = (models / "two_link_reach.toml").read_text()
    lines = [line for line in scene.splitlines() if not line.startswith("q =")]
    assert len(lines) < len(scene.splitlines())
    text = "\n".join(lines).replace("[goal]", "[goal]\nq = [90.0, -45.0]")
    text = text.replace("[start]", "[start]\nq = [0.0, 0.0]")
    (tmp_path / "scene.toml").write_text(text)
    (tmp_path / "two_link.urdf").write_text((models / "two_link.urdf").read_text())
    main(["plan", str(tmp_path / "scene.toml"), "--starts", "2", "--time-limit", "2"])
    told = capsys.readouterr().err
    assert told.count("warning: shoulder is 90 rad") == 1


def test_a_motion_of_many_turns_does_not_look_like_degrees(arm_scene: Scene) -> None:
    goal = np.array([-np.pi / 2 + 12 * np.pi, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_degrees(arm_scene.robot, [np.array([-np.pi / 2, 0.0]), goal])
    with pytest.warns(HoviWarning, match="looks like degrees"):
        warn_of_degrees(arm_scene.robot, [np.array([-90.0, 0.0]), np.array([45.5, 0.0])])
