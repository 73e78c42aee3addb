"""The formats of `hovi export`: names, file name extensions, and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, InputError
from hovi.exchange.formats import FORMATS, ExportFormat, export_format

each_format = pytest.mark.parametrize("chosen", FORMATS, ids=lambda each: each.name)


@pytest.fixture(scope="module")
def motion(arm_scene: hovi.Scene) -> Trajectory:
    return hovi.plan(arm_scene, [-np.pi / 2, 0.0], [0.3, 0.7], 1.0, limits="none").trajectory


def test_names_and_suffixes_are_distinct() -> None:
    assert len({each.name for each in FORMATS}) == len({each.suffix for each in FORMATS})
    assert len({each.name for each in FORMATS}) == len(FORMATS)


@each_format
def test_a_format_is_found_by_its_name(chosen: ExportFormat) -> None:
    assert export_format(chosen.name) is chosen


@each_format
def test_a_motion_is_written(chosen: ExportFormat, motion: Trajectory, tmp_path: Path) -> None:
    path = tmp_path / f"motion{chosen.suffix}"
    chosen.write(motion, path, 100.0)
    assert path.stat().st_size > 0


@each_format
@pytest.mark.parametrize("rate", [0.0, -1.0, np.nan])
def test_an_invalid_rate_raises_and_writes_nothing(
    chosen: ExportFormat, rate: float, motion: Trajectory, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="positive number of samples per second"):
        chosen.write(motion, tmp_path / f"motion{chosen.suffix}", rate)
    assert not list(tmp_path.iterdir())


@each_format
def test_an_unwritable_path_raises(
    chosen: ExportFormat, motion: Trajectory, tmp_path: Path
) -> None:
    with pytest.raises(DisplayError, match="cannot write"):
        chosen.write(motion, tmp_path / "no" / f"motion{chosen.suffix}", 100.0)


def test_an_unknown_format_raises_with_a_suggestion() -> None:
    with pytest.raises(InputError, match="there is no export format 'cvs': did you mean 'csv'"):
        export_format("cvs")
