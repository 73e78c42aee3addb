"""What workers write as they go: a file of lines each, and a file of what lines refer to.

A line is one JSON object after its CRC-32 in eight hexadecimal digits. It is written by one call
after the bytes that it refers to are on the disk, so a process that is killed and a machine that
loses its power leave lines that are whole, and at most one that is not, which readers pass over.
Every process writes to files of its own.
"""

from __future__ import annotations

import json
import os
import secrets
import socket
import zlib
from dataclasses import field
from pathlib import Path
from typing import Any, Self

from hovi.system.dataclass import dataclass
from hovi.system.files import sync_folder

FOLDER = "journal"
"""Of the lines and of what they refer to, in a study's folder."""
LINES, BYTES = ".lines", ".bytes"
_CRC = 8


class StorageError(Exception):
    """A journal could not be written, as where a disk is full, or not be read."""


@dataclass(frozen=True)
class Stored:
    """Where bytes are: the name of a file of FOLDER, without suffix, with offset and length."""

    file: str
    offset: int
    length: int

    def to_list(self) -> list[Any]:
        """As JSON."""
        return [self.file, self.offset, self.length]

    @classmethod
    def from_list(cls, data: Any) -> Self:
        """From JSON. Raises ValueError for anything else, names with folders among them."""
        file, offset, length = data
        if not isinstance(file, str) or Path(file).name != file:
            raise ValueError("no name of a journal")
        return cls(file, int(offset), int(length))

    def read(self, folder: Path) -> bytes:
        """The bytes. Raises OSError, ValueError if there are fewer."""
        with (folder / FOLDER / f"{self.file}{BYTES}").open("rb") as stream:
            stream.seek(self.offset)
            found = stream.read(self.length)
        if len(found) != self.length:
            raise ValueError("a journal is cut off")
        return found


@dataclass(eq=False)
class JournalWriter:
    """Adds to a journal of this process. folder: of the study."""

    folder: Path
    name: str = field(default_factory=lambda: _new_name())
    _lines: int = -1
    _bytes: int = -1
    _unsynced: set[int] = field(default_factory=set)

    def store(self, content: bytes) -> Stored:
        """Add bytes. Raises StorageError."""
        if self._bytes < 0:
            self._bytes = self._open(BYTES)
        return Stored(self.name, self._append(self._bytes, content), len(content))

    def add(self, entry: dict[str, Any]) -> None:
        """Add a line, which is on the disk after the next `sync`. Raises StorageError."""
        self._sync(self._bytes)
        if self._lines < 0:
            self._lines = self._open(LINES)
        text = json.dumps(entry, allow_nan=False, separators=(",", ":")).encode()
        self._append(self._lines, b"%08x %s\n" % (zlib.crc32(text), text))

    def sync(self) -> None:
        """Wait until all that was added is on the disk. Raises StorageError."""
        for descriptor in (self._bytes, self._lines):
            self._sync(descriptor)

    def _sync(self, descriptor: int) -> None:
        if descriptor in self._unsynced:
            try:
                os.fsync(descriptor)
            except OSError as refused:
                raise StorageError(str(refused)) from refused
            self._unsynced.remove(descriptor)

    def close(self) -> None:
        """Close the files."""
        for descriptor in (self._lines, self._bytes):
            if descriptor >= 0:
                os.close(descriptor)
        self._lines = self._bytes = -1

    def _open(self, suffix: str) -> int:
        path = self.folder / FOLDER / f"{self.name}{suffix}"
        try:
            opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as refused:
            raise StorageError(str(refused)) from refused
        sync_folder(path.parent)
        return opened

    def _append(self, descriptor: int, content: bytes) -> int:
        """Write all bytes or none; returns where they begin."""
        end = os.fstat(descriptor).st_size
        rest = memoryview(content)
        self._unsynced.add(descriptor)
        try:
            while rest:
                rest = rest[os.write(descriptor, rest) :]
        except OSError as refused:
            os.ftruncate(descriptor, end)
            raise StorageError(str(refused)) from refused
        return end


def entry_of(line: bytes) -> dict[str, Any] | None:
    """The entry of a line of a journal; None if the line is not whole."""
    text = line[_CRC + 1 : -1]
    if not line.endswith(b"\n") or line[:_CRC] != b"%08x" % zlib.crc32(text):
        return None
    try:
        entry = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return entry if isinstance(entry, dict) else None


def _new_name() -> str:
    host = "".join(c if c.isalnum() or c in "-_" else "-" for c in socket.gethostname())[:40]
    return f"{host}-{os.getpid()}-{secrets.token_hex(4)}"
