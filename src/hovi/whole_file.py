"""Files written whole or not at all: a temporary neighbour, then one atomic rename."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A binary file that takes the name `path` only if the block ends without an exception.

    The bytes go to a hidden neighbour in the same folder (a rename is atomic only within one
    file system), which is removed if anything fails, Ctrl-C included. What was at `path` before
    stays as it was until then.

    path: the file to write; an existing regular file is replaced.
    Raises OSError as the operating system does, and when `path` is a folder or a device.
    """
    target = Path(path)
    if target.exists() and not target.is_file():
        # A rename onto /dev/null by root would replace the device itself.
        raise OSError("it exists and is not a regular file")
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(6)}.tmp")
    try:
        with temporary.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def reason(error: OSError) -> str:
    """Why the operating system refused, without its number and without the path."""
    return error.strerror or str(error)
