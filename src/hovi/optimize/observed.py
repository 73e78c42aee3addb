"""Between two steps of a solve: who observes sees the point, and what was stopped ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeAlias

from hovi.system.deadline import raise_if_late
from hovi.system.interruption import raise_if_interrupted

Observer: TypeAlias = Callable[[Any, Any], None]
"""Called with an objective and a point of it."""

_observer: ContextVar[Observer | None] = ContextVar("hovi_observer", default=None)


@contextmanager
def observed(observer: Observer) -> Iterator[None]:
    """Every solve of the block is observed, but for those that the observer starts itself."""

    def alone(objective: Any, x: Any) -> None:
        token = _observer.set(None)
        try:
            observer(objective, x)
        finally:
            _observer.reset(token)

    token = _observer.set(alone)
    try:
        yield
    finally:
        _observer.reset(token)


def between_steps(objective: Any, x: Any) -> None:
    """To be called between two steps, with the current point x of an objective.

    Raises KeyboardInterrupt or OutOfTimeError where the solve is to end.
    """
    raise_if_interrupted()
    raise_if_late()
    observer = _observer.get()
    if observer is not None:
        observer(objective, x)
