"""samples.zarr.zip has the samples of samples.parquet, and the same bytes however it was made."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hovi.cli.application import main
from hovi.study.storage import tables
from hovi.study.study import Study
from samples.studies import digest, reaches

pytest.importorskip("pyarrow")
pytest.importorskip("pandas")
zarr = pytest.importorskip("zarr")

NAME = "samples.zarr.zip"
ARRAYS = ("t", "q", "v", "a", "tau")


@pytest.fixture(scope="module")
def sampled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sampled")
    assert reaches(samples=7, sample_format="zarr").run(folder, 1).complete
    return folder


def read(folder: Path) -> dict[str, Any]:
    with zarr.storage.ZipStore(folder / NAME, mode="r") as store:
        group = zarr.open_group(store, mode="r")
        return {name: group[name][:] for name in group.array_keys()}


def test_arrays_are_the_samples_of_the_motions(sampled: Path) -> None:
    arrays, plans = read(sampled), Study.load(sampled)
    assert arrays["cell"].tolist() == plans["cell"].tolist()
    assert [key.decode() for key in arrays["key"]] == plans["key"].tolist()
    for i in (0, 11, 23):
        motion = Study.motion(sampled, plans["key"][i])
        assert arrays["t"][i].tolist() == np.linspace(0.0, motion.duration, 7).tolist()
        own = motion.sample(arrays["t"][i])
        for name in ARRAYS[1:]:
            assert np.array_equal(arrays[name][i], getattr(own, name))


def test_the_other_format_has_the_same_samples_and_plans_nothing_again(
    sampled: Path, tmp_path: Path
) -> None:
    study = reaches(samples=7)
    assert study.run(tmp_path, 1).new == 24
    assert reaches(samples=7, sample_format="zarr").run(tmp_path, 1).new == 0
    rows = tables.read_table(tmp_path / "samples.parquet").to_pandas()
    arrays = read(tmp_path)
    for name in ARRAYS:
        columns = np.stack(rows[name].to_numpy())
        assert np.array_equal(columns.reshape(arrays[name].shape), arrays[name])


@pytest.mark.parametrize("rows", [21, 50_000])
def test_the_bytes_do_not_depend_on_workers_and_interruptions(
    sampled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: int
) -> None:
    def stop(state: Any) -> None:
        if state.done >= 5:
            raise KeyboardInterrupt

    monkeypatch.setattr(tables, "SAMPLED_ROWS", rows)
    study = reaches(samples=7, sample_format="zarr")
    assert study.run(tmp_path, 2, progress=stop).interrupted
    assert len(read(tmp_path)["cell"]) < 24
    assert study.run(tmp_path, 2).complete
    if rows == tables.SAMPLED_ROWS == 50_000:
        assert digest(tmp_path, NAME) == digest(sampled, NAME)
    for name, values in read(sampled).items():
        assert np.array_equal(read(tmp_path)[name], values)


def test_another_number_of_samples_is_that_of_all_motions(tmp_path: Path) -> None:
    fields = [{"field": "goal.q", "values": [[0.3, 0.7], [0.2, 0.1]]}]
    for samples, new in ((9, 2), (4, 2), (4, 0)):
        study = Study("two_link_reach", fields, samples=samples, sample_format="zarr")
        assert study.run(tmp_path, 1).new == new
        assert read(tmp_path)["q"].shape == (2, samples, 2)


def test_failures_have_no_samples_and_robots_of_fewer_joints_end_in_nan(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text("""
robot = "ur5"
duration = 1.5
limits = "none"
start = { q = [0.0] }
goal = { q = [0.0] }
[scheme]
name = "galerkin-2"
intervals = 12
""")
    locked = [["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"], ["wrist_3_joint"]]
    values = [
        [joints, [0.0] * (6 - len(joints)), [0.3] * count]
        for joints, count in zip(locked, (3, 5), strict=True)
    ]
    values.append([locked[0], [0.0] * 3, [0.3] * 4])
    vary = [{"fields": ["locked", "start.q", "goal.q"], "values": values}]
    out = tmp_path / "out"
    Study(tmp_path / "scene.toml", vary, samples=5, sample_format="zarr").run(out, 1)
    assert Study.load(out)["status"].tolist() == ["minimum", "minimum", "refused"]
    arrays = read(out)
    assert arrays["cell"].tolist() == [0, 1]
    for name in ("q", "v", "a", "tau"):
        assert np.isfinite(arrays[name]).all(axis=1).tolist() == [
            [True] * 3 + [False] * 2,
            [True] * 5,
        ]
        assert np.isnan(arrays[name][0, :, 3:]).all()


def test_without_minima_there_are_empty_arrays(tmp_path: Path) -> None:
    refused = [{"field": "goal.q", "values": [[0.3, 0.7, 1.0]]}]
    Study("two_link_reach", refused, samples=5, sample_format="zarr").run(tmp_path, 1)
    assert {name: len(values) for name, values in read(tmp_path).items()} == dict.fromkeys(
        ("cell", "key", *ARRAYS), 0
    )


def test_a_full_disk_leaves_the_file_that_was_there(sampled: Path, tmp_path: Path) -> None:
    """The largest size of a file stands for the size of a disk."""
    program = f"""
import resource, sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from hovi.errors import StudyError
from samples.studies import reaches
study = reaches(samples=7, sample_format="zarr")
resource.setrlimit(resource.RLIMIT_FSIZE, (13_000, 13_000))
try:
    study.run(sys.argv[1], 1)
except StudyError as full:
    print(full)
"""
    out = shutil.copytree(sampled, tmp_path / "out")
    assert (out / NAME).stat().st_size > 13_000 > (out / "plans.parquet").stat().st_size
    run = subprocess.run([sys.executable, "-c", program, out], capture_output=True, text=True)
    assert f"{NAME} cannot be written: File too large" in run.stdout
    assert digest(out, NAME) == digest(sampled, NAME)
    assert not [each for each in out.iterdir() if each.suffix == ".tmp"]


def test_the_option_of_the_command_is_that_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "study.toml"
    file.write_text('scene = "two_link_reach"\n[output]\nsample_format = "zar"\n')
    command = ["study", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]
    assert main(command) == 2
    assert '"parquet" or "zarr"' in capsys.readouterr().err
    file.write_text('scene = "two_link_reach"\n[output]\nsample_format = "zarr"\n')
    assert main([*command, "--sample-format", "hdf5"]) == 2
    assert "sample_format" in capsys.readouterr().err.splitlines()[-1]
    assert main([*command, "--sample", "6"]) == 0
    assert read(tmp_path / "out")["tau"].shape == (1, 6, 2)
