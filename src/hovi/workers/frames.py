"""Messages between a pool and its workers: pickles, each after its length in eight bytes."""

from __future__ import annotations

import os
import pickle
from typing import Any

_HEADER = 8
_MAX_READ = 1 << 20


class ClosedPipeError(Exception):
    """The process at the other end is gone."""


def send(descriptor: int, *parts: object) -> None:
    """Write a message of some parts. Raises ClosedPipeError."""
    payload = pickle.dumps(parts)
    rest = memoryview(len(payload).to_bytes(_HEADER, "big") + payload)
    try:
        while rest:
            rest = rest[os.write(descriptor, rest) :]
    except BrokenPipeError:
        raise ClosedPipeError from None


class Receiver:
    """The messages that arrive at a pipe."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._bytes = descriptor, bytearray()

    def read(self) -> None:
        """Take what has arrived, waiting for at least one byte. Raises ClosedPipeError."""
        arrived = os.read(self._descriptor, _MAX_READ)
        if not arrived:
            raise ClosedPipeError
        self._bytes += arrived

    def message(self) -> tuple[Any, ...] | None:
        """The next complete message, of which no byte is kept; None if there is none yet."""
        end = _HEADER + int.from_bytes(self._bytes[:_HEADER], "big")
        if len(self._bytes) < _HEADER or len(self._bytes) < end:
            return None
        parts: tuple[Any, ...] = pickle.loads(self._bytes[_HEADER:end])
        del self._bytes[:end]
        return parts
