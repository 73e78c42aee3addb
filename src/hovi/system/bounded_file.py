"""Files of strangers: regular ones of a sane size. A pipe would never end, nor would /dev/zero."""

from __future__ import annotations

import os
import stat
from pathlib import Path


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
