"""Recordings of Rerun, read back by its own reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError
from samples.cubic_motion import cubic_motion

pytest.importorskip("rerun")
reader: Any = pytest.importorskip("rerun.chunk")


def columns(path: Path) -> dict[str, dict[str, Any]]:
    """The columns of every entity of a recording; times in [s]."""
    found: dict[str, dict[str, Any]] = {}
    for chunk in reader.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        table = found.setdefault(chunk.entity_path, {})
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if name == "motion":
                table[name] = column.cast("int64").to_numpy() * 1e-9
            elif ":" in name:
                table[name.rpartition(":")[2]] = column.to_pylist()
    return found


@pytest.fixture(scope="module")
def motion(ur5: hovi.Robot) -> hovi.Trajectory:
    scene = hovi.Scene(ur5, [hovi.effects.Gravity()])
    return cubic_motion(scene, duration=0.7, schemes=["galerkin-2"] * 3)[0]


def test_curves_are_the_samples(motion: hovi.Trajectory, tmp_path: Path) -> None:
    motion.to_rerun(tmp_path / "motion.rrd", 20.0)
    found = columns(tmp_path / "motion.rrd")
    times = np.append(np.arange(14) / 20.0, motion.duration)
    kinds = ("position", "velocity", "acceleration", "effort")
    for kind, wanted in zip(kinds, motion.sample(times), strict=True):
        for name, curve in zip(motion.coordinate_names, wanted.T, strict=True):
            table = found[f"/joints/{name}/{kind}"]
            assert np.diff(table["motion"]).min() > 0
            np.testing.assert_allclose(table["motion"], times, rtol=0, atol=1.1e-9)
            np.testing.assert_array_equal(np.ravel(table["scalars"]), curve)


def test_links_are_where_they_belong_in_single_precision(
    motion: hovi.Trajectory, ur5: hovi.Robot, tmp_path: Path
) -> None:
    motion.to_rerun(tmp_path / "motion.rrd", 20.0)
    found = columns(tmp_path / "motion.rrd")
    last = motion.configurations(motion.duration)[0]
    for link in ("tool0", "forearm_link"):
        table = found[f"/robot/{link}"]
        pose = ur5.frame_pose(link, last)
        np.testing.assert_allclose(np.ravel(table["translation"][-1]), pose[:3, 3], atol=1e-6)
        turn = pin.Quaternion(np.ravel(table["quaternion"][-1]).astype(float)).matrix()
        np.testing.assert_allclose(turn, pose[:3, :3], atol=1e-6)
    strips = found["/robot/bars"]["strips"]
    assert len(strips) == 15
    ends = np.array(strips[-1]).reshape(-1, 3)
    tool = ur5.frame_position("tool0", last[None])[0]
    assert np.abs(ends - tool).sum(axis=1).min() < 1e-5


def test_times_closer_than_a_nanosecond_are_refused(tmp_path: Path) -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    motion = cubic_motion(scene, duration=2e-7, schemes=["galerkin-2"] * 3)[0]
    with pytest.raises(InputError, match="same time in nanoseconds"):
        motion.to_rerun(tmp_path / "motion.rrd", 3e9)
