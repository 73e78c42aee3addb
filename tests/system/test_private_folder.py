"""A folder is private if nobody else can change it or any folder on the way to it."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hovi.system.private_folder import UnsafeFolderError, is_private_file, private_folder

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")


@pytest.fixture
def above(tmp_path: Path) -> Path:
    return tmp_path / "a" / "b"


def test_missing_folders_are_created_for_this_user_only(above: Path) -> None:
    previous = os.umask(0)
    try:
        folder = private_folder(above, ("c", "d"))
    finally:
        os.umask(previous)
    assert folder == above / "c" / "d"
    for each in (folder, folder.parent, above, above.parent):
        assert stat.S_IMODE(each.stat().st_mode) == 0o700


def test_a_folder_that_is_there_is_kept(above: Path) -> None:
    folder = private_folder(above, ("c",))
    (folder / "file").touch()
    above.chmod(0o755)
    assert private_folder(above, ("c",)) == folder
    assert (folder / "file").exists()


@pytest.mark.parametrize("mode", [0o720, 0o702, 0o777])
def test_no_folder_on_the_way_may_be_written_to_by_others(above: Path, mode: int) -> None:
    folder = private_folder(above, ("c", "d"))
    for each in (folder, folder.parent, above, above.parent, above.parent.parent):
        before = stat.S_IMODE(each.stat().st_mode)
        each.chmod(mode)
        with pytest.raises(UnsafeFolderError) as caught:
            private_folder(above, ("c", "d"))
        assert (caught.value.folder, caught.value.fault) == (
            str(each),
            "may be written to by others",
        )
        each.chmod(before)


def test_only_folders_above_may_be_shared_with_the_sticky_bit(above: Path) -> None:
    folder = private_folder(above, ("c",))
    above.chmod(0o1777)
    assert private_folder(above, ("c",)) == folder
    folder.chmod(0o1777)
    with pytest.raises(UnsafeFolderError, match="others"):
        private_folder(above, ("c",))


@needs_root
def test_no_folder_on_the_way_may_belong_to_somebody_else(above: Path) -> None:
    folder = private_folder(above, ("c", "d"))
    for each in (folder, folder.parent, above, above.parent):
        os.chown(each, 12345, -1)
        with pytest.raises(UnsafeFolderError) as caught:
            private_folder(above, ("c", "d"))
        assert (caught.value.folder, caught.value.fault) == (str(each), "belongs to another user")
        os.chown(each, 0, -1)


@pytest.fixture
def of_root() -> Iterator[Path]:
    """A folder of root with one of another user in it, "home"."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "home").mkdir()
        os.chown(folder / "home", 12345, 12345)
        yield folder


@contextmanager
def as_another_user() -> Iterator[None]:
    """This thread takes the identity of the other user."""
    os.seteuid(12345)
    try:
        yield
    finally:
        os.seteuid(0)


@needs_root
def test_folders_above_may_be_the_administrators(of_root: Path) -> None:
    with as_another_user():
        made = private_folder(of_root / "home", ("c",))
    assert made.stat().st_uid == 12345


@needs_root
def test_own_folders_may_not_be_the_administrators(of_root: Path) -> None:
    os.chown(of_root / "home", 0, 0)
    refused = pytest.raises(UnsafeFolderError, match="home belongs to another user")
    with as_another_user(), refused:
        private_folder(of_root, ("home",))


@needs_root
def test_a_folder_that_may_be_entered_but_not_read_is_no_obstacle(of_root: Path) -> None:
    of_root.chmod(0o711)
    with as_another_user():
        assert private_folder(of_root / "home", ("c",)).exists()


CHROOT = """
import os, sys
from pathlib import Path
from hovi.system.private_folder import UnsafeFolderError, private_folder
os.chroot(sys.argv[1])
os.seteuid(int(sys.argv[2]))
try:
    print(private_folder(Path(sys.argv[3]), ("c",)))
except UnsafeFolderError as error:
    print(error)
"""


def answer_under(root: Path, user: int, above: str) -> str:
    """What a user gets who sees this folder as the root."""
    command = [sys.executable, "-c", CHROOT, str(root), str(user), above]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@needs_root
def test_the_root_is_checked_too(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    assert answer_under(tmp_path, 0, "/") == "/c"
    tmp_path.chmod(0o777)
    assert answer_under(tmp_path, 0, "/") == "/ may be written to by others"


@needs_root
def test_the_owner_of_the_root_and_root_itself_are_administrators(tmp_path: Path) -> None:
    home = tmp_path / "a" / "b" / "home"
    home.mkdir(parents=True)
    for folder, owner in ((tmp_path, 777), (tmp_path / "a", 0), (home.parent, 777), (home, 12345)):
        folder.chmod(0o755)
        os.chown(folder, owner, -1)
    assert answer_under(tmp_path, 12345, "/a/b/home") == "/a/b/home/c"


# Symbolic links


@pytest.mark.parametrize("target", ["elsewhere", "./x/../elsewhere", "{}/elsewhere"])
def test_links_above_are_followed_to_folders_that_are_checked(above: Path, target: str) -> None:
    top = above.parent.parent
    (top / "elsewhere").mkdir(mode=0o755)
    (top / "x").mkdir()
    (top / "a").symlink_to(target.format(top))
    folder = private_folder(above, ("c",))
    assert folder == top / "elsewhere" / "b" / "c"
    (top / "elsewhere").chmod(0o777)
    with pytest.raises(UnsafeFolderError, match="elsewhere may be written"):
        private_folder(above, ("c",))


def test_links_below_are_refused(above: Path) -> None:
    above.mkdir(parents=True)
    (above / "c").symlink_to(above.parent)
    with pytest.raises(UnsafeFolderError, match="c is a symbolic link"):
        private_folder(above, ("c",))


@needs_root
def test_links_of_somebody_else_are_refused(above: Path) -> None:
    above.mkdir(parents=True)
    above.chmod(0o1777)
    (above / "link").symlink_to(above.parent)
    os.chown(above / "link", 12345, -1, follow_symlinks=False)
    with pytest.raises(UnsafeFolderError, match="link is a symbolic link of another user"):
        private_folder(above / "link", ("c",))


def test_a_circle_of_links_is_refused(tmp_path: Path) -> None:
    (tmp_path / "one").symlink_to("two")
    (tmp_path / "two").symlink_to("one")
    with pytest.raises(UnsafeFolderError, match="without an end"):
        private_folder(tmp_path / "one", ("c",))


@pytest.mark.parametrize("kind", ["file", "pipe"])
def test_anything_else_in_the_way_is_refused(above: Path, kind: str) -> None:
    above.mkdir(parents=True)
    if kind == "file":
        (above / "c").touch()
    else:
        os.mkfifo(above / "c")
    with pytest.raises(OSError, match="Not a directory"):
        private_folder(above, ("c",))


def test_no_descriptor_stays_open(above: Path) -> None:
    above.mkdir(parents=True)
    (above / "link").symlink_to("c")
    before = list(Path("/proc/self/fd").iterdir())
    for _ in range(20):
        private_folder(above, ("c", "d"))
        with pytest.raises(UnsafeFolderError):
            private_folder(above, ("link",))
    assert list(Path("/proc/self/fd").iterdir()) == before


# Files


@pytest.mark.parametrize(("mode", "private"), [(0o600, True), (0o644, True), (0o664, False)])
def test_a_file_is_private_if_others_cannot_write_to_it(
    tmp_path: Path, mode: int, private: bool
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "file").chmod(mode)
    with (tmp_path / "file").open() as stream:
        assert is_private_file(stream.fileno()) == private


def test_a_pipe_is_no_private_file() -> None:
    ends = os.pipe()
    assert not is_private_file(ends[0])
    for end in ends:
        os.close(end)
