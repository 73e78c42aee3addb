"""The point of a tool at an offset from the flange, as a frame like any other."""

from __future__ import annotations

import pickle
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.errors import HoviError

Array = npt.NDArray[np.float64]

OFFSET, RPY = [0.03, -0.02, 0.15], [0.3, -0.2, 0.5]
TCP = {"tcp": {"frame": "tool0", "position": OFFSET, "rpy": RPY}}
BEGIN = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])


@cache
def robot() -> hovi.Robot:
    return hovi.load_robot("ur5", tools=TCP)


def placed(q: Array) -> Array:
    """The tool's pose by Pinocchio: its own in that of the flange, of the robot without tools."""
    model = hovi.load_robot("ur5").model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    own = pin.SE3(pin.rpy.rpyToMatrix(np.array(RPY)), np.array(OFFSET))
    return np.array((data.oMf[model.getFrameId("tool0")] * own).homogeneous)


def test_its_pose_is_that_of_the_flange_times_its_own() -> None:
    for q in (BEGIN, BEGIN + 0.4):
        assert np.abs(robot().frame_pose("tcp", q) - placed(q)).max() < 1e-14


@pytest.mark.parametrize("parts", [["position"], ["position", "rotation"]])
def test_goals_and_what_is_kept_name_it(parts: list[str]) -> None:
    scene = hovi.Scene(robot(), [hovi.effects.Gravity()])
    there = placed(BEGIN)
    there[:3, 3] += [0.0, 0.2, 0.05]
    given: dict[str, Any] = {"position": there[:3, 3], "rotation": there[:3, :3]}
    goal = hovi.FrameGoal("tcp", **{part: given[part] for part in parts})
    line = hovi.conditions.OnLine("tcp")
    found = hovi.plan(scene, BEGIN, goal, 1.5, keep=[line], self_collision=False)
    assert found.success, found.message
    p = np.array([placed(q)[:3, 3] for q in found.trajectory.sample(np.linspace(0, 1.5, 301)).q])
    d = there[:3, 3] - p[0]
    away = (p - p[0]) - np.outer((p - p[0]) @ d, d) / (d @ d)
    assert np.abs(p[-1] - there[:3, 3]).max() < 1e-7
    assert np.linalg.norm(away, axis=1).max() < 2e-5


def test_it_goes_with_motions_and_to_other_processes(tmp_path: Path) -> None:
    scene = hovi.Scene(robot(), [hovi.effects.Gravity()])
    found = hovi.plan(scene, BEGIN, BEGIN + 0.1, 1.0, self_collision=False)
    found.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    for other in (again.robot, pickle.loads(pickle.dumps(robot()))):
        assert other is not None
        assert np.abs(other.frame_pose("tcp", BEGIN) - placed(BEGIN)).max() < 1e-14


@pytest.mark.parametrize("options", [{"locked": ["wrist_3_joint"]}, {"free_flyer": True}])
def test_it_stays_where_joints_are_locked_or_the_base_floats(options: dict[str, Any]) -> None:
    other = hovi.load_robot("ur5", tools=TCP, **options)
    q = BEGIN[:5] if "locked" in options else np.concatenate([[0, 0, 0, 0, 0, 0, 1], BEGIN])
    assert np.abs(other.frame_pose("tcp", q) - placed(BEGIN)).max() < 1e-12


def test_a_pinocchio_model_takes_tools() -> None:
    other = hovi.load_robot(hovi.load_robot("ur5").model, tools=TCP)
    assert np.abs(other.frame_pose("tcp", BEGIN) - placed(BEGIN)).max() < 1e-14


def test_a_file_has_tools(tmp_path: Path) -> None:
    text = hovi.example("ur5_reach").read_text()
    path = tmp_path / "scene.toml"
    path.write_text(
        text[: text.index("[goal]")] + '[goal]\nframe = "tcp"\nposition = [0.45, 0.25, 0.25]\n'
        "[effects.gravity]\n[tools.tcp]\n"
        f'frame = "tool0"\nposition = {OFFSET}\nrpy = {RPY}\n'
    )
    task = hovi.load_task(path)
    saved = hovi.save_task(task, tmp_path / "again.toml")
    for each in (task, hovi.load_task(saved)):
        assert np.abs(each.scene.robot.frame_pose("tcp", BEGIN) - placed(BEGIN)).max() < 1e-12


@pytest.mark.parametrize(
    ("tools", "said"),
    [
        ([1], "tools must map up to 100 names to tables"),
        ({"tcp": 1}, "needs the `frame`"),
        ({"tcp": {"frame": "toool0"}}, "did you mean 'tool0'"),
        ({"tool0": {"frame": "tool0"}}, "has a frame 'tool0' already"),
        ({"tcp": {"frame": "tool0", "positon": [0, 0, 0]}}, "did you mean 'position'"),
        ({"tcp": {"frame": "tool0", "position": [0, 0]}}, "three finite numbers"),
        ({"tcp": {"frame": "tool0", "rpy": [0, 0, "x"]}}, "rpy of tool 'tcp'"),
    ],
)
def test_what_is_no_tool_is_refused(tools: Any, said: str) -> None:
    with pytest.raises(HoviError, match=said) as wrong:
        hovi.load_robot("ur5", tools=tools)
    assert str(wrong.value).count(". ") == 0
