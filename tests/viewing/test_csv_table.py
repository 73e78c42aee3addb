from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.errors import DisplayError, InputError
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.viewing.csv_table import write_csv
from samples.cubic_motion import cubic_motion


@pytest.fixture(scope="module")
def motion(two_link: Robot) -> Trajectory:
    return cubic_motion(Scene(two_link, [Gravity(9.8)]))[0]


def read(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array([[float(x) for x in row] for row in rows])


def test_columns_are_named_by_coordinate(motion: Trajectory, tmp_path: Path) -> None:
    write_csv(motion, tmp_path / "motion.csv", rate=10)
    header, _ = read(tmp_path / "motion.csv")
    kinds = ("q", "v", "a", "tau")
    assert header == ["t", *(f"{k}_{j}" for k in kinds for j in ("shoulder", "elbow"))]


@pytest.mark.parametrize("rate", [1000.0, 10.0, 7.3, 0.1])
def test_numbers_round_trip_exactly(motion: Trajectory, tmp_path: Path, rate: float) -> None:
    write_csv(motion, tmp_path / "motion.csv", rate)
    _, table = read(tmp_path / "motion.csv")
    t = table[:, 0]
    np.testing.assert_array_equal(table[:, 1:], np.column_stack(motion.sample(t)))
    np.testing.assert_array_equal(t[:-1], np.arange(len(t) - 1) / rate)
    assert t[-1] == motion.duration
    assert len(t) == int(np.ceil(2.0 * rate)) + 1


def test_the_last_row_is_at_the_final_time(two_link: Robot, tmp_path: Path) -> None:
    trajectory, _ = cubic_motion(Scene(two_link), duration=0.3, schemes=["galerkin-2"] * 3)
    write_csv(trajectory, tmp_path / "motion.csv", rate=100)
    t = read(tmp_path / "motion.csv")[1][:, 0]
    assert t[-1] == trajectory.duration
    assert np.diff(t).min() > 0.005


@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf, 1e12])
def test_an_invalid_rate_raises(motion: Trajectory, tmp_path: Path, rate: float) -> None:
    with pytest.raises(InputError, match="rate"):
        write_csv(motion, tmp_path / "motion.csv", rate)
    assert not list(tmp_path.iterdir())


def test_an_interrupted_export_leaves_the_old_file(
    motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "motion.csv"
    path.write_text("before")
    monkeypatch.setattr("hovi.viewing.csv_table._ROWS_PER_BATCH", 10)
    calls = []

    def fail_late(trajectory: Trajectory, t: np.ndarray) -> object:
        calls.append(t)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return sample(trajectory, t)

    sample = Trajectory.sample
    monkeypatch.setattr(Trajectory, "sample", fail_late)
    with pytest.raises(KeyboardInterrupt):
        write_csv(motion, path)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_an_unwritable_path_raises(motion: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(DisplayError, match="No such file or directory"):
        write_csv(motion, tmp_path / "no" / "motion.csv")
