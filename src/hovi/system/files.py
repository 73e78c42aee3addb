"""Files read and written safely.

Writing is atomic: the bytes go to an unnamed file first, which one rename puts in place. Only
regular files up to a maximum size are read: reading a pipe or /dev/zero would never end.
"""

from __future__ import annotations

import contextlib
import math
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

_DESCRIPTORS = Path("/proc/self/fd")


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str], durable: bool = True) -> Iterator[BinaryIO]:
    """A binary file that replaces `path` only if the block ends without an exception.

    The bytes go to an unnamed file in the same folder until all of them are on the disk, so a
    process that is killed leaves nothing behind. Where the file system has no unnamed files, they
    go to a hidden temporary file, which is removed if anything fails, Ctrl-C included. An existing
    file at `path` is unchanged until then. When the block has ended, the file and its name are on
    the disk.

    path: the file to write; an existing regular file is replaced and keeps its permissions. Of a
        symbolic link, the file to which it leads is written, and the link stays.
    durable: whether the block ends only once file and name are on the disk, which takes some ms;
        otherwise a crash of the system may leave an empty or damaged file.
    Raises OSError as the operating system does, and when `path` is a folder or a device, or no
    path at all.
    """
    target = _written(Path(path))
    temporary = target.with_name(f".{target.name[:50]}.{os.urandom(6).hex()}.tmp")  # 255 bytes
    try:
        with _open(temporary) as stream:
            if target.exists():  # before the block, which may give it others
                os.fchmod(stream.fileno(), stat.S_IMODE(target.stat().st_mode))
            yield stream
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
            if not temporary.exists():
                _link(stream, temporary)
        temporary.replace(target)  # a hard link cannot replace an existing file
        if durable:
            sync_folder(target.parent)
    finally:
        temporary.unlink(missing_ok=True)


def make_folders(folder: Path) -> None:
    """Create a folder and those above it that do not exist. Raises OSError.

    `Path.mkdir` calls itself for each missing folder, and so fails for a thousand of them.
    """
    missing = [each for each in (folder, *folder.parents) if not each.is_dir()]
    for each in reversed(missing):
        each.mkdir(exist_ok=True)
        sync_folder(each.parent)


def sync_folder(folder: Path) -> None:
    """Wait until the names of a folder's files are on the disk, where the system can do that."""
    with contextlib.suppress(OSError):  # of file systems whose folders cannot be synced
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _written(path: Path) -> Path:
    """The file that is written at a path, which is another one where the path is a link.

    Raises OSError unless it is a regular file or none yet. In a folder of everybody's, such as
    /tmp, Linux does not follow another user's link: `exists` raises PermissionError.
    """
    _require_name(path)
    if path.exists() and not path.is_file():
        # As root, a rename onto /dev/null would replace the device itself.
        raise OSError("it exists and is not a regular file")
    if not path.is_symlink():
        return path
    file = Path(os.path.realpath(path))
    if file.is_symlink():
        raise OSError("it is a symbolic link that leads to itself")
    return file


def _require_name(path: Path) -> None:
    """Raise OSError for a text that Python cannot hand to the operating system as a path."""
    try:
        is_name = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:  # half of a pair of surrogates
        is_name = False
    if not is_name:
        raise OSError("no file can have that name")


def _open(temporary: Path) -> BinaryIO:
    """A new unnamed file in the folder of `temporary`, or else `temporary` itself."""
    if hasattr(os, "O_TMPFILE") and _DESCRIPTORS.is_dir():
        with contextlib.suppress(OSError):
            unnamed = os.open(temporary.parent, os.O_TMPFILE | os.O_WRONLY, 0o666)
            return os.fdopen(unnamed, "wb")
    return temporary.open("xb")


def _link(stream: BinaryIO, name: Path) -> None:
    folder = os.open(_DESCRIPTORS, os.O_RDONLY)
    try:
        # Python follows the symbolic link to the file only when a folder is given.
        os.link(str(stream.fileno()), name, src_dir_fd=folder)
    finally:
        os.close(folder)


def reason(error: OSError) -> str:
    """The reason that the operating system gives, without error number and path."""
    return error.strerror or str(error)


def require_file(path: str | os.PathLike[str], max_bytes: int) -> None:
    """Raise OSError, with the reason, unless `path` is a regular file of acceptable size.

    max_bytes: largest size that is read.
    """
    try:
        found = Path(path).stat()
    except ValueError as error:  # a NUL in the name
        raise FileNotFoundError("no such file") from error
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError("that is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise OSError("it is not a regular file")
    if found.st_size > max_bytes:
        raise OSError(
            f"it has {found.st_size / 1e6:.1f} MB, and at most {max_bytes / 1e6:.1f} MB are read"
        )


def names_file(path: Path) -> bool:
    """Whether there is a regular file at a path, which may be no path that the system knows."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that is too long, among others
        return False


def finite(value: Any) -> Any:
    """A JSON value with None in place of every number that is not finite."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
