"""What a worker process does: it works off what its pool sends, until the pool is gone.

A thread waits for messages all the time. It ends the process at once when the pipe is closed,
however the pool's process ended, and even in the middle of work.
"""

from __future__ import annotations

import os
import pickle
import queue
import threading
from collections.abc import Callable
from typing import Any

from hovi.workers.frames import ClosedPipeError, Receiver, send

IDLE_SECONDS = 300.0
"""Time without work after which a worker ends."""


def serve() -> None:
    """Work until the pool is gone or sends nothing for a while.

    What the work prints goes nowhere: the answers have stdout's pipe for themselves.
    """
    answers = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    messages: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(messages,), daemon=True).start()
    desk = _Desk(answers)
    try:
        send(answers, "ready")
        while True:
            kind, *parts = messages.get(timeout=IDLE_SECONDS)
            if kind == "work":
                desk.take(*parts)
            else:
                desk.answer(*parts)
    except (ClosedPipeError, queue.Empty):
        os._exit(0)


def _receive(messages: queue.SimpleQueue[tuple[Any, ...]]) -> None:
    """Put all messages into a queue; ends the process when the pipe is closed."""
    receiver = Receiver(0)
    try:
        while True:
            receiver.read()
            while (message := receiver.message()) is not None:
                messages.put(message)
    except ClosedPipeError:
        os._exit(0)


class _Desk:
    """The work of a call, unpickled with its first item so that errors are answers, too."""

    def __init__(self, answers: int) -> None:
        self._answers, self._pickled = answers, b""
        self._work: Callable[[Any, float | None], Any] | None = None

    def take(self, pickled: bytes) -> None:
        """Work of a new call."""
        self._pickled, self._work = pickled, None

    def answer(self, item: bytes, left: float | None) -> None:
        """Send the result, or the exception that the work ended in."""
        try:
            if self._work is None:
                self._work = pickle.loads(self._pickled)
            assert self._work is not None
            answer = "done", pickle.dumps(self._work(pickle.loads(item), left))
        except MemoryError:
            answer = "lost", pickle.dumps("a worker process had not enough memory")
        except Exception as error:
            answer = "failed", pickle.dumps(_picklable(error))
        send(self._answers, *answer)


def _picklable(error: Exception) -> Exception:
    """The exception, or one with its text if it cannot be sent."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
