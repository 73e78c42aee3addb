"""Only regular files of acceptable size are read."""

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


def test_files_up_to_the_limit_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"x" * 1000)
    require_file(path, 1000)
    with pytest.raises(OSError, match=r"it has 0\.0 MB, and at most 0\.0 MB are read"):
        require_file(path, 999)


@pytest.mark.parametrize("read", READERS)
def test_a_pipe_is_refused_without_blocking(read: Callable[[Path], object], tmp_path: Path) -> None:
    pipe = tmp_path / "robot.urdf"
    os.mkfifo(pipe)
    with pytest.raises(HoviError, match="it is not a regular file"):
        read(pipe)


@pytest.mark.parametrize("read", READERS)
def test_an_endless_device_is_refused(read: Callable[[Path], object]) -> None:
    with pytest.raises(HoviError, match="it is not a regular file"):
        read(Path("/dev/zero"))


@pytest.mark.parametrize("read", READERS)
def test_a_name_with_a_nul_byte_is_not_found(read: Callable[[Path], object]) -> None:
    with pytest.raises(HoviError, match=r"no such|there is no"):
        read(Path("a\0b.urdf"))


@pytest.mark.parametrize("read", READERS)
def test_a_huge_file_is_refused_without_reading_it(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    path = tmp_path / "robot.urdf"
    with path.open("wb") as stream:
        stream.truncate(2**34)  # sparse
    with pytest.raises(HoviError, match=r"it has 17179\.9 MB, and at most"):
        read(path)
