"""The formats of `hovi export`: names, file name extensions, and errors."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, InputError
from hovi.exchange.formats import FORMATS, ExportFormat, export_format
from hovi.exchange.libraries import library
from samples.cubic_motion import Cubic, cubic_motion

each_format = pytest.mark.parametrize("chosen", FORMATS, ids=lambda each: each.name)
FILM = ("video", "gif")
MODULES = {
    "parquet": "pyarrow",
    "mcap": "mcap",
    "rerun": "rerun",
    "video": "imageio_ffmpeg",
    "gif": "PIL",
}


RATES = {"franka": 1000.0}
"""Of formats with one rate alone; 20 for the others."""


@pytest.fixture(scope="module")
def motion(arm_scene: hovi.Scene) -> Trajectory:
    return cubic_motion(arm_scene, duration=0.4, schemes=["galerkin-2"] * 3)[0]


@pytest.fixture(scope="module")
def motions(motion: Trajectory, ur5: hovi.Robot, panda: hovi.Robot) -> dict[str, Trajectory]:
    """A motion for each format: those of programs are of their arms, at rest at both ends."""

    def resting(robot: hovi.Robot) -> Trajectory:
        cubic = Cubic.resting(0.5 * np.ones(robot.nv), 0.5001 * np.ones(robot.nv), 2.0)
        return cubic_motion(hovi.Scene(robot), 2.0, ["galerkin-2"] * 3, cubic=cubic)[0]

    arms = {"urscript": resting(ur5), "franka": resting(panda)}
    return {each.name: arms.get(each.name, motion) for each in FORMATS}


def require_library(chosen: ExportFormat) -> None:
    if chosen.name in MODULES:
        pytest.importorskip(MODULES[chosen.name])


def test_names_and_suffixes_are_distinct() -> None:
    suffixes = [suffix for each in FORMATS if each.has_suffix for suffix in each.suffixes]
    assert len(set(suffixes)) == len(suffixes)
    assert {suffix for each in FORMATS for suffix in each.suffixes} == set(suffixes)
    assert len({each.name for each in FORMATS}) == len(FORMATS)


@each_format
def test_a_format_is_found_by_its_name(chosen: ExportFormat) -> None:
    assert export_format(chosen.name) is chosen


@each_format
def test_a_motion_has_a_method_for_every_format(
    chosen: ExportFormat, motions: dict[str, Trajectory], tmp_path: Path
) -> None:
    require_library(chosen)
    motion, rate = motions[chosen.name], RATES.get(chosen.name, 20.0)
    if chosen.name in FILM:
        assert hasattr(motion, f"to_{chosen.name}")  # filmed by the tests of films
        return
    for suffix in chosen.suffixes:
        path = tmp_path / f"motion{suffix}"
        getattr(motion, f"to_{chosen.name.replace('-', '_')}")(path, rate)
        again = tmp_path / f"again{suffix}"
        hovi.export(motion, again, chosen.name, rate=rate)
        assert path.stat().st_size == pytest.approx(again.stat().st_size, rel=0.02)


@each_format
@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan, np.inf, 1e300])
def test_an_invalid_rate_raises_and_writes_nothing(
    chosen: ExportFormat, rate: float, motions: dict[str, Trajectory], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"positive number of samples per second|choose a lower"):
        chosen.write(motions[chosen.name], tmp_path / f"motion{chosen.suffix}", rate)
    assert not list(tmp_path.iterdir())


@each_format
def test_an_unwritable_path_raises(
    chosen: ExportFormat, motions: dict[str, Trajectory], tmp_path: Path
) -> None:
    require_library(chosen)
    path, rate = tmp_path / "no" / f"motion{chosen.suffix}", RATES.get(chosen.name, 10.0)
    with pytest.raises(DisplayError, match="cannot write"):
        chosen.write(motions[chosen.name], path, rate)


def test_an_unknown_format_raises_with_a_suggestion(motion: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no export format 'cvs': did you mean 'csv'"):
        export_format("cvs")
    with pytest.raises(InputError, match=r"extension of no export format: did you mean '\.csv'"):
        hovi.export(motion, tmp_path / "motion.cvs")
    with pytest.raises(InputError, match=r"must end in \.yaml or \.yml or \.json, not 'm\.csv'"):
        hovi.export(motion, tmp_path / "m.csv", "joint-trajectory")
    with pytest.raises(InputError, match="`efforts` is for the format 'joint-trajectory'"):
        hovi.export(motion, tmp_path / "m.csv", efforts=True)


def test_a_missing_library_is_named_with_the_command_that_installs_it(
    motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(DisplayError, match=r"needs the package pyarrow: run pip install 'hovi\[ex"):
        hovi.export(motion, tmp_path / "motion.parquet")
    assert not list(tmp_path.iterdir())
    assert library("json", "json", "this").loads("1") == 1
