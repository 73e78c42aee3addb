"""Files read and written safely.

Written whole or not at all: bytes without a name first, then one atomic rename. Read only if they
are regular files of a sane size: a pipe would never end, nor would /dev/zero.
"""

from __future__ import annotations

import contextlib
import math
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

_DESCRIPTORS = Path("/proc/self/fd")


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file that takes the name `path` only if the block ends without an exception.

    The bytes go to a file in the same folder that has no name until they are all on the disk, so
    that a process killed at any moment leaves nothing behind; where the file system cannot do
    that, to a hidden neighbour, which is removed if anything fails, Ctrl-C included. What was at
    `path` before stays as it was until then.

    path: the file to write; an existing regular file is replaced.
    Raises OSError as the operating system does, and when `path` is a folder or a device.
    """
    target = Path(path)
    if target.exists() and not target.is_file():
        # A rename onto /dev/null by root would replace the device itself.
        raise OSError("it exists and is not a regular file")
    neighbour = target.with_name(f".{target.name[:100]}.{secrets.token_hex(6)}.tmp")
    try:
        with _open(neighbour) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            if not neighbour.exists():
                _give_name(stream, neighbour)
        neighbour.replace(target)  # a link could not take the place of a file
    finally:
        neighbour.unlink(missing_ok=True)


def _open(neighbour: Path) -> BinaryIO:
    """A new file without a name in the folder of `neighbour`, or else `neighbour` itself."""
    if hasattr(os, "O_TMPFILE") and _DESCRIPTORS.is_dir():
        with contextlib.suppress(OSError):
            unnamed = os.open(neighbour.parent, os.O_TMPFILE | os.O_WRONLY, 0o666)
            return os.fdopen(unnamed, "wb")
    return neighbour.open("xb")


def _give_name(stream: BinaryIO, name: Path) -> None:
    folder = os.open(_DESCRIPTORS, os.O_RDONLY)
    try:
        # Python follows the symbolic link to the file only when a folder is given.
        os.link(str(stream.fileno()), name, src_dir_fd=folder)
    finally:
        os.close(folder)


def reason(error: OSError) -> str:
    """Why the operating system refused, without its number and without the path."""
    return error.strerror or str(error)


def require_file(path: str | os.PathLike[str], most_bytes: int) -> None:
    """Raise OSError, its reason in words, unless `path` is a regular file that is not too large.

    most_bytes: size up to which a file is read.
    """
    try:
        found = Path(path).stat()
    except ValueError as error:  # a NUL in the name
        raise FileNotFoundError("no such file") from error
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError("that is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise OSError("it is not a regular file")
    if found.st_size > most_bytes:
        raise OSError(
            f"it has {found.st_size / 1e6:.1f} MB, and at most {most_bytes / 1e6:.1f} MB are read"
        )


def finite(value: Any) -> Any:
    """The value, with null for every number in it that is not finite."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
