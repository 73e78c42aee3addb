"""Ctrl-C ends the whole public call during which it is pressed.

Many loops solve repeatedly and decide by the outcome what to solve next. An interrupted solve
returns its best point so far; the interrupt is recorded until the outermost call returns, so that
no further solve starts.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

from hovi.system.dataclass import dataclass

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass()
class _Call:
    """State of the outermost call in progress."""

    interrupted: bool = False


_outermost: ContextVar[_Call | None] = ContextVar("hovi_outermost_call", default=None)


def interruptible(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A decorator: an interrupt stays recorded until the outermost decorated call returns."""

    @functools.wraps(function)
    def recording(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if _outermost.get() is not None:
            return function(*args, **kwargs)
        token = _outermost.set(_Call())
        try:
            return function(*args, **kwargs)
        finally:
            _outermost.reset(token)

    return recording


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
    """Raise KeyboardInterrupt if an interrupt was recorded."""
    if interrupted():
        raise KeyboardInterrupt
