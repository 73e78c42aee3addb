"""Ctrl-C that was heard during a call stays heard until the call returns.

Many loops solve, look at how that ended, and solve again. Each solve that is interrupted keeps the
best that it has, and what it was a part of has to end as well: once one was interrupted no other
begins.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@dataclass
class _Call:
    """The outermost call that is under way."""

    interrupted: bool = False


_outermost: ContextVar[_Call | None] = ContextVar("hovi_outermost_call", default=None)


def interruptible(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """The function, which remembers an interrupt until it or the call around it returns."""

    @functools.wraps(function)
    def remembering(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if _outermost.get() is not None:
            return function(*args, **kwargs)
        token = _outermost.set(_Call())
        try:
            return function(*args, **kwargs)
        finally:
            _outermost.reset(token)

    return remembering


def record_interrupt() -> None:
    """An interrupt came; for whoever catches KeyboardInterrupt. Nothing outside of a call."""
    call = _outermost.get()
    if call is not None:
        call.interrupted = True


def interrupted() -> bool:
    """Whether one came during the call that is under way."""
    call = _outermost.get()
    return call is not None and call.interrupted


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt again where one came."""
    if interrupted():
        raise KeyboardInterrupt
