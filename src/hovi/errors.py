"""The errors that hovi raises: one root, one class per kind of invalid input.

Every message says in one or two sentences what was expected, what was found and what to do.
"""

from __future__ import annotations

import difflib
import os
import re
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

_MAX_COMPARED = 256  # characters of a name; the time of a comparison grows with their square
_MAX_LISTED = 60  # names in a message
_BETWEEN = ("contextlib", "functools")  # modules that call hovi for hovi
_RECORDED: ContextVar[tuple[list[str], ...]] = ContextVar("_RECORDED", default=())
_LONG_RUN = re.compile(r"\S{160,}|\s{160,}")
_FIRST, _LAST = 1_000, 400  # characters of a long message that are kept


class HoviError(Exception):
    """Root of everything that hovi raises on purpose.

    Messages may quote untrusted input, so control characters are escaped, line breaks included, and
    very long words and messages are shortened.
    """

    def __init__(self, sentence: str = "") -> None:
        super().__init__(_sanitized(sentence))


class InputError(HoviError):
    """An argument of a public function is missing, of the wrong shape, or not finite."""


class ChartError(InputError):
    """An orientation turns too far within one interval for its chart."""


class UnreachableError(HoviError):
    """No configuration reaches a goal; `q` is the one that comes nearest to it, shape (nq,)."""

    def __init__(self, sentence: str = "", q: Any = None) -> None:
        super().__init__(sentence)
        self.q = q

    def __reduce__(self) -> tuple[type[UnreachableError], tuple[str, Any]]:
        """Pickled with its configuration."""
        return type(self), (str(self), self.q)


class ModelError(HoviError):
    """A robot model cannot be read, is not physical, or does not support planning."""


class SceneError(HoviError):
    """A scene or its file names something that does not exist or is inconsistent."""


class SchemeError(HoviError):
    """A scheme is unknown, or is not regular and so does not determine a motion."""


class TrajectoryFileError(HoviError):
    """A trajectory file cannot be read or written."""


class StudyError(HoviError):
    """The folder of a study cannot be read or written, or does not fit the study."""


class UnmeasurableError(HoviError):
    """A method cannot solve a scene, or there is no reference motion to compare methods with."""


class CancelledError(HoviError):
    """A plan was cancelled before it had a motion."""


class DisplayError(HoviError):
    """A figure, a page or a viewer cannot be created."""


def shows_all_frames() -> bool:
    """Whether errors keep all frames of hovi in their tracebacks, for people who work on hovi.

    Otherwise one is left, that of the public function, below the line that calls it.
    """
    return os.environ.get("HOVI_TRACEBACK") == "full"


class HoviWarning(UserWarning):
    """Something that is accepted, but is probably not what was meant."""


def warn(sentence: str, category: type[Warning] = HoviWarning) -> None:
    """Warn of something at the line that called hovi, however deep the call is in hovi."""
    for each in _RECORDED.get() if category is HoviWarning else ():
        each.append(sentence)
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and _is_own(frame.f_globals.get("__name__")):
        frame, level = frame.f_back, level + 1
    warnings.warn(sentence, category, stacklevel=level)


@contextmanager
def recorded_warnings() -> Iterator[list[str]]:
    """The sentences that hovi warns of in the block, whatever the filters of warnings show."""
    sentences: list[str] = []
    token = _RECORDED.set((*_RECORDED.get(), sentences))
    try:
        yield sentences
    finally:
        _RECORDED.reset(token)


def _is_own(module: object) -> bool:
    """Whether a frame's module is hovi's, or the standard library's between two of hovi's."""
    return isinstance(module, str) and module.split(".")[0] in ("hovi", *_BETWEEN)


def expect(value: object, kind: type, hint: str) -> None:
    """Raise InputError unless `value` is an instance of `kind`; hint: what to pass instead."""
    if not isinstance(value, kind):
        raise InputError(f"expected a {kind.__name__}, got a {type(value).__name__}; give {hint}.")


def nearest(name: str, valid: Iterable[str]) -> str:
    """The end of a message about an unknown name: the closest valid names, or all of them.

    name: the unknown name.
    valid: the accepted names.
    """
    names = sorted(valid)
    close = difflib.get_close_matches(name[:_MAX_COMPARED], names, n=3, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(c) for c in close) + "?"
    return f"valid names are {some_of(map(repr, names), _MAX_LISTED)}."


def some_of(names: Iterable[str], most: int = 4) -> str:
    """The first names, and how many more there are: "a, b, c, d and 3 more"."""
    found = list(names)
    more = f" and {len(found) - most} more" if len(found) > most else ""
    return ", ".join(found[:most]) + more


def reason(error: BaseException) -> str:
    """The last line of what an error of other code says, or its kind, without a period."""
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return lines[-1].removesuffix(".")


def _sanitized(sentence: str) -> str:
    shorter = _LONG_RUN.sub(lambda word: f"{word[0][:80]}...{word[0][-40:]}", sentence)
    printable = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in shorter)
    if len(printable) <= _FIRST + _LAST:
        return printable
    return f"{printable[:_FIRST]} ... {printable[-_LAST:]}"
