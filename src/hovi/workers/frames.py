"""Messages between a pool and its workers: pickles, each after its length in eight bytes."""

from __future__ import annotations

import os
import pickle
import select
from typing import Any

_HEADER = 8
_MAX_READ = 1 << 20
PATIENCE = 10.0
"""Time in [s] to wait at a full pipe for a process that reads nothing, as where it is stopped."""


class ClosedPipeError(Exception):
    """The process at the other end is gone, or reads nothing."""


def send(descriptor: int, *parts: object) -> None:
    """Write a message of some parts. Raises ClosedPipeError."""
    payload = pickle.dumps(parts)
    rest = memoryview(len(payload).to_bytes(_HEADER, "big") + payload)
    try:
        while rest:
            rest = rest[_written(descriptor, rest) :]
    except BrokenPipeError:
        raise ClosedPipeError from None


def _written(descriptor: int, rest: memoryview) -> int:
    """Write some bytes, and how many. Raises ClosedPipeError where there is no room for long."""
    try:
        return os.write(descriptor, rest)
    except BlockingIOError:
        room = select.poll()
        room.register(descriptor, select.POLLOUT)
        if not room.poll(1e3 * PATIENCE):
            raise ClosedPipeError from None
        return 0


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
