"""Ctrl-C, or what cancels a call, ends the whole public call during which it comes.

Many loops solve repeatedly and decide by the outcome what to solve next. An interrupted solve
returns its best point so far; the interrupt is recorded until the outermost call returns, so that
no further solve starts. What cancels a call, as from another thread, is asked wherever a time limit
is looked at, and becomes the same KeyboardInterrupt there, once.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

from hovi.system.dataclass import dataclass

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass()
class _Call:
    """State of the outermost call in progress.

    cancelled: whether it is to end; asked until it is. interrupted: whether that, or Ctrl-C, came.
    """

    interrupted: bool = False
    cancelled: Callable[[], bool] | None = None


_outermost: ContextVar[_Call | None] = ContextVar("hovi_outermost_call", default=None)


def interruptible(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator: an interrupt stays recorded until the outermost decorated call returns."""

    @functools.wraps(function)
    def recording(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if _outermost.get() is not None:
            return function(*args, **kwargs)
        with _as_outermost(_Call()):
            return function(*args, **kwargs)

    return recording


@contextmanager
def cancelled_by(cancelled: Callable[[], bool]) -> Iterator[None]:
    """The calls of the block end once a function returns True, which any thread may let it do.

    They are a call of their own: outside of it nothing is interrupted by that.
    """
    with _as_outermost(_Call(cancelled=cancelled)):
        yield


@contextmanager
def _as_outermost(call: _Call) -> Iterator[None]:
    token = _outermost.set(call)
    try:
        yield
    finally:
        _outermost.reset(token)


def record_interrupt() -> None:
    """Record an interrupt, to be called where KeyboardInterrupt is caught.

    Has no effect outside of an `interruptible` call.
    """
    call = _outermost.get()
    if call is not None:
        call.interrupted = True


def interrupted() -> bool:
    """Whether an interrupt was recorded during the call in progress."""
    call = _outermost.get()
    return call is not None and call.interrupted


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt if an interrupt was recorded, or comes now by what cancels."""
    raise_if_cancelled()
    if interrupted():
        raise KeyboardInterrupt


def raise_if_cancelled() -> None:
    """Raise KeyboardInterrupt, and record it, where the call in progress is first seen to end."""
    call = _outermost.get()
    if call is None or call.interrupted or call.cancelled is None:
        return
    if call.cancelled():
        call.interrupted = True
        raise KeyboardInterrupt
