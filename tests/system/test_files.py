"""Nothing is read from what is not a regular file of a sane size."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError
from hovi.planning.task_file.reading import load_task
from hovi.robot.loading import load_robot
from hovi.robot.srdf import read_srdf_file
from hovi.system.files import require_file

READERS: tuple[Callable[[Path], object], ...] = (
    load_robot,
    read_srdf_file,
    load_task,
    Trajectory.load,
)


def test_a_file_up_to_the_limit_passes(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"x" * 1000)
    require_file(path, 1000)
    with pytest.raises(OSError, match=r"it has 0\.0 MB, and at most 0\.0 MB are read"):
        require_file(path, 999)


@pytest.mark.parametrize("read", READERS)
def test_a_pipe_is_refused_and_not_waited_for(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    pipe = tmp_path / "robot.urdf"
    os.mkfifo(pipe)
    with pytest.raises(HoviError, match="it is not a regular file"):
        read(pipe)


@pytest.mark.parametrize("read", READERS)
def test_a_device_without_end_is_refused(read: Callable[[Path], object]) -> None:
    with pytest.raises(HoviError, match="it is not a regular file"):
        read(Path("/dev/zero"))


@pytest.mark.parametrize("read", READERS)
def test_an_impossible_name_is_no_file(read: Callable[[Path], object]) -> None:
    with pytest.raises(HoviError, match=r"no such|there is no"):
        read(Path("a\0b.urdf"))


@pytest.mark.parametrize("read", READERS)
def test_a_huge_file_is_refused_unread(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    with path.open("wb") as stream:
        stream.truncate(2**34)  # of zeros that take no room
    with pytest.raises(HoviError, match=r"it has 17179\.9 MB, and at most"):
        read(path)
