"""What workers write as they go: a file of lines each, and a file of what lines refer to.

A line is one JSON object after its CRC-32 in eight hexadecimal digits. It is written by one call
after the bytes that it refers to, so a process that is killed leaves lines that are whole, and at
most one that is not, which readers pass over. Every process writes to files of its own.
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

    def store(self, content: bytes) -> Stored:
        """Add bytes. Raises StorageError."""
        if self._bytes < 0:
            self._bytes = self._open(BYTES)
        return Stored(self.name, self._append(self._bytes, content), len(content))

    def add(self, entry: dict[str, Any]) -> None:
        """Add a line. Raises StorageError."""
        if self._lines < 0:
            self._lines = self._open(LINES)
        text = json.dumps(entry, allow_nan=False, separators=(",", ":")).encode()
        self._append(self._lines, b"%08x %s\n" % (zlib.crc32(text), text))

    def close(self) -> None:
        """Close the files."""
        for descriptor in (self._lines, self._bytes):
            if descriptor >= 0:
                os.close(descriptor)
        self._lines = self._bytes = -1

    def _open(self, suffix: str) -> int:
        path = self.folder / FOLDER / f"{self.name}{suffix}"
        try:
            return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as refused:
            raise StorageError(str(refused)) from refused

    def _append(self, descriptor: int, content: bytes) -> int:
        """Write all bytes or none; returns where they begin."""
        end = os.fstat(descriptor).st_size
        rest = memoryview(content)
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
