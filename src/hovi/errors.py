"""The errors that hovi raises: one root, one class per door through which bad input comes.

Every message is one sentence or two: what was expected, what came, what to do.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

_LONGEST = 256  # characters that are compared: the time grows with their square
_MOST = 60  # names that are listed
_WORD = re.compile(r"\S{160,}|\s{160,}")


class HoviError(Exception):
    """Root of everything that hovi raises on purpose.

    Its sentence quotes what strangers wrote, so it stays on one line, holds no control characters
    and shortens words that nobody would read.
    """

    def __init__(self, sentence: str = "") -> None:
        super().__init__(_readable(sentence))


class InputError(HoviError):
    """An argument of a public function is missing, of the wrong shape, or not finite."""


class ChartError(InputError):
    """A motion turns an orientation too far within an interval for one chart."""


class ModelError(HoviError):
    """A robot model cannot be read, is not physical, or cannot be planned on."""


class SceneError(HoviError):
    """A scene or its file names something that does not exist or does not fit."""


class SchemeError(HoviError):
    """A scheme is unknown, or is not regular and so does not define a motion."""


class TrajectoryFileError(HoviError):
    """A trajectory file cannot be read or written."""


class UnmeasurableError(HoviError):
    """A method cannot solve a scene, or there is no motion to measure methods against."""


class DisplayError(HoviError):
    """A picture, a page or a viewer cannot be made."""


def expect(value: object, kind: type, hint: str) -> None:
    """Raise InputError for a value of another class; hint: what to give instead."""
    if not isinstance(value, kind):
        raise InputError(f"expected a {kind.__name__}, got a {type(value).__name__}; give {hint}.")


def nearest(name: str, valid: Iterable[str]) -> str:
    """The end of a sentence about an unknown name: the nearest valid names, or all of them.

    name: what came.
    valid: the names that would have been accepted.
    """
    names = sorted(valid)
    close = difflib.get_close_matches(name[:_LONGEST], names, n=3, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(c) for c in close) + "?"
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return "valid names are " + ", ".join(repr(n) for n in names[:_MOST]) + more + "."


def _readable(sentence: str) -> str:
    shorter = _WORD.sub(lambda word: f"{word[0][:80]}...{word[0][-40:]}", sentence)
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in shorter)
