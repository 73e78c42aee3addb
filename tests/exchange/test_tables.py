"""NumPy archives, Parquet tables and JointTrajectory messages, read back by their own readers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange.joint_motion import joint_motion
from hovi.exchange.joint_trajectory import joint_trajectory
from samples.cubic_motion import cubic_motion


@pytest.fixture(scope="module")
def motion(ur5: hovi.Robot) -> Trajectory:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    return cubic_motion(scene, duration=0.7, schemes=["galerkin-2"] * 3)[0]


@pytest.fixture(scope="module")
def turning() -> Trajectory:
    """A Kinova, whose first joint goes three times around."""
    robot = hovi.load_robot("kinova")
    grid = hovi.Grid.uniform(2.0, 12, hovi.schemes.galerkin(1))
    N, n = grid.intervals, robot.nv
    angle, v = np.linspace(0.0, 6 * np.pi, N + 1), np.zeros((N + 1, n))
    q = np.tile(robot.neutral(), (N + 1, 1))
    q[:, 0], q[:, 1], v[:, 0] = np.cos(angle), np.sin(angle), 3 * np.pi
    path = hovi.DiscretePath(q, v, np.zeros((N, 2, n)), np.zeros((N, 1, n)))
    return Trajectory(grid, path, np.zeros((N + 1, 2, n)), hovi.Scene(robot))


def read_messages(motion: Trajectory, folder: Path, **options: Any) -> list[dict[str, Any]]:
    motion.to_joint_trajectory(folder / "motion.yaml", 50.0, **options)
    motion.to_joint_trajectory(folder / "motion.json", 50.0, **options)
    one = yaml.safe_load((folder / "motion.yaml").read_text())
    return [one, json.loads((folder / "motion.json").read_text())]


def test_a_numpy_archive_has_the_samples_without_a_pickle(
    motion: Trajectory, tmp_path: Path
) -> None:
    motion.to_numpy(tmp_path / "motion.npz", 100.0)
    with np.load(tmp_path / "motion.npz", allow_pickle=False) as read:
        assert np.diff(read["t"]).min() > 0
        assert read["t"][-1] == motion.duration
        for name, wanted in zip(("q", "v", "a", "tau"), motion.sample(read["t"]), strict=True):
            np.testing.assert_array_equal(read[name], wanted)
        assert tuple(read["names"]) == motion.coordinate_names == tuple(read["q_names"])


def test_a_parquet_table_has_the_samples(motion: Trajectory, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    motion.to_parquet(tmp_path / "motion.parquet", 100.0)
    table = parquet.read_table(tmp_path / "motion.parquet")
    t = table["t"].to_numpy()
    assert np.diff(t).min() > 0
    wanted = np.column_stack([t, *motion.sample(t)])
    np.testing.assert_array_equal(np.column_stack([c.to_numpy() for c in table.columns]), wanted)
    assert table.column_names[1] == "q_shoulder_pan_joint"
    assert float(table.schema.metadata[b"duration"]) == motion.duration


def test_messages_have_the_samples_in_yaml_and_json(motion: Trajectory, tmp_path: Path) -> None:
    for message in read_messages(motion, tmp_path):
        assert message["joint_names"] == list(motion.coordinate_names)
        points = message["points"]
        stamps = [p["time_from_start"] for p in points]
        t = np.array([s["sec"] + 1e-9 * s["nanosec"] for s in stamps])
        assert np.diff(t).min() > 0
        assert all(0 <= s["nanosec"] < 10**9 for s in stamps)
        assert abs(t[-1] - motion.duration) < 1e-9
        exact = np.append(np.arange(len(t) - 1) / 50.0, motion.duration)
        for name, wanted in zip(
            ("positions", "velocities", "accelerations"), motion.sample(exact), strict=False
        ):
            np.testing.assert_array_equal([p[name] for p in points], wanted)
        assert all(p["effort"] == [] for p in points)


def test_efforts_are_written_where_they_are_asked_for(motion: Trajectory, tmp_path: Path) -> None:
    t = np.append(np.arange(35) / 50.0, motion.duration)
    for message in read_messages(motion, tmp_path, efforts=True):
        np.testing.assert_array_equal(
            [p["effort"] for p in message["points"]], motion.sample(t).tau
        )


def test_tiny_and_huge_numbers_are_numbers_in_yaml(motion: Trajectory) -> None:
    from hovi.exchange.joint_trajectory import _number

    for x in (1e-5, -3e-300, 1e22, 5e-324, 0.1, -0.0, 1.7976931348623157e308, 123456789.0):
        read = yaml.safe_load(_number(x))
        assert isinstance(read, float)
        assert read == x


def test_angles_of_continuous_joints_go_on(turning: Trajectory) -> None:
    found = joint_motion(turning, 100.0)
    first = found.q[:, 0]
    np.testing.assert_allclose(first, 3 * np.pi * found.times, atol=1e-9)
    assert joint_trajectory(turning)["joint_names"] == list(found.names)


def test_joints_that_mimic_others_are_left_to_the_controller() -> None:
    robot = hovi.load_robot("panda", mimic=True)
    motion = cubic_motion(hovi.Scene(robot))[0]
    names = joint_trajectory(motion)["joint_names"]
    assert "panda_finger_joint1" in names
    assert "panda_finger_joint2" not in names


def test_a_base_is_refused_in_a_joint_trajectory() -> None:
    robot = hovi.load_robot(hovi.example("spacecraft_arm.urdf"), free_flyer=True)
    grid = hovi.Grid.uniform(1.0, 2, hovi.schemes.galerkin(0))
    still = np.tile(robot.neutral(), (3, 1)), np.zeros((3, 9)), np.zeros((2, 2, 9))
    path = hovi.DiscretePath(*still, np.zeros((2, 0, 9)))
    motion = Trajectory(grid, path, np.zeros((3, 2, 9)), hovi.Scene(robot))
    with pytest.raises(InputError, match="'root_joint' has several coordinates"):
        joint_trajectory(motion)
    assert joint_motion(motion, 10.0).names == ("yaw", "pitch", "elbow")
    assert joint_motion(motion, 10.0).others == ("root_joint",)


def test_points_closer_than_a_nanosecond_are_refused(arm_scene: hovi.Scene) -> None:
    motion = cubic_motion(arm_scene, duration=2e-7, schemes=["galerkin-2"] * 3)[0]
    with pytest.raises(InputError, match="same time in nanoseconds"):
        joint_trajectory(motion, 3e9)
