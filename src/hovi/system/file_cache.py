"""Files in the user's cache folder: what takes long to compute, for the next process.

A file is read only where nobody else could have written it, and nothing depends on its being there:
without a home folder, on a full disk or in a folder of somebody else's, nothing is cached.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from hovi.system.cache_home import cache_home
from hovi.system.files import whole_file
from hovi.system.private_folder import UnsafeFolderError, is_private_file, private_folder

MAX_BYTES = 64_000_000
"""Largest file that is read."""


def read_cached(kind: str, name: str) -> bytes | None:
    """The content of hovi/kind/name in the cache folder; None if there is none to trust."""
    try:
        file = _folder(kind) / name
        with os.fdopen(os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as stream:
            if not is_private_file(stream.fileno()):
                return None
            content = stream.read(MAX_BYTES + 1)
    except (UnsafeFolderError, OSError, RuntimeError):
        return None
    return content if len(content) <= MAX_BYTES else None


def write_cached(kind: str, name: str, content: bytes) -> None:
    """Put hovi/kind/name into the cache folder in one step, if it can be written at all.

    The file may not be on the disk yet: readers have to notice one that a crash left damaged.
    """
    with suppress(UnsafeFolderError, OSError, RuntimeError):
        file = _folder(kind) / name
        with whole_file(file, durable=False) as stream:
            os.fchmod(stream.fileno(), 0o600)
            stream.write(content)


def _folder(kind: str) -> Path:
    return private_folder(cache_home(), ("hovi", kind))
