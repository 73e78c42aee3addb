"""Only regular files of acceptable size are read; outputs go where a path leads, and stay there."""

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
from hovi.system.files import make_folders, require_file, whole_file

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


def written(path: Path) -> None:
    with whole_file(path) as stream:
        stream.write(b"new")


@pytest.mark.parametrize("exists", [True, False])
@pytest.mark.parametrize("relative", [True, False])
def test_an_output_that_is_a_link_goes_to_the_file_to_which_it_leads(
    exists: bool, relative: bool, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    file, link = tmp_path / "elsewhere" / "file", tmp_path / "link"
    link.symlink_to("elsewhere/file" if relative else file)
    if exists:
        file.write_bytes(b"old")
    written(link)
    assert link.is_symlink()
    assert file.read_bytes() == b"new"
    assert [each.name for each in tmp_path.iterdir()].count(".link") == 0
    assert len(list(file.parent.iterdir())) == 1


def test_a_link_that_leads_to_itself_or_to_no_folder_is_refused(tmp_path: Path) -> None:
    for target in ("link", "missing/file"):
        link = tmp_path / "link"
        link.unlink(missing_ok=True)
        link.symlink_to(target)
        with pytest.raises(OSError, match=r"leads to itself|No such file"):
            written(link)
        assert str(link.readlink()) == target
        assert len(list(tmp_path.iterdir())) == 1


def test_a_replaced_file_keeps_its_permissions(tmp_path: Path) -> None:
    path = tmp_path / "private"
    path.write_bytes(b"old")
    path.chmod(0o600)
    written(path)
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode & 0o777 == 0o600


def test_permissions_that_the_writer_gives_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "library"
    path.write_bytes(b"old")
    path.chmod(0o666)
    with whole_file(path) as stream:
        os.fchmod(stream.fileno(), 0o600)
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_file_and_its_name_are_on_the_disk_when_it_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[str, bool]] = []

    def fsync(descriptor: int) -> None:
        at = Path(f"/proc/self/fd/{descriptor}").stat()
        known = {path.stat().st_ino: path.name for path in (tmp_path, *tmp_path.iterdir())}
        synced.append((known.get(at.st_ino, "unnamed"), (tmp_path / "file").exists()))

    monkeypatch.setattr(os, "fsync", fsync)
    written(tmp_path / "file")
    assert synced == [("unnamed", False), (tmp_path.name, True)]


def test_new_folders_are_synced_to_those_above(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    monkeypatch.setattr(
        os, "fsync", lambda number: synced.append(str(Path(f"/proc/self/fd/{number}").readlink()))
    )
    make_folders(tmp_path / "a" / "b")
    assert synced == [str(tmp_path), str(tmp_path / "a")]
    make_folders(tmp_path / "a" / "b")
    assert len(synced) == 2
