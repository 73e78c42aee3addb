"""Which files of a folder are opened, as the kernel reports it (inotify)."""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_LIBC = ctypes.CDLL(None, use_errno=True)
_IN_OPEN = 0x20
_EVENT = struct.Struct("iIII")


@contextmanager
def opened_files(folder: Path) -> Iterator[set[str]]:
    """The names of the files in `folder` that are opened in the block, filled in at its end."""
    names: set[str] = set()
    watch = _LIBC.inotify_init1(os.O_NONBLOCK)
    assert watch >= 0, os.strerror(ctypes.get_errno())
    try:
        assert _LIBC.inotify_add_watch(watch, os.fsencode(folder), _IN_OPEN) >= 0
        yield names
        names.update(_events(watch))
    finally:
        os.close(watch)


def _events(watch: int) -> Iterator[str]:
    while True:
        try:
            data = os.read(watch, 2**16)
        except BlockingIOError:
            return
        while data:
            *_, length = _EVENT.unpack_from(data)
            name, data = data[_EVENT.size : _EVENT.size + length], data[_EVENT.size + length :]
            yield os.fsdecode(name.rstrip(b"\0"))
