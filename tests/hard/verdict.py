"""The verdict on an untrusted input: refused, accepted, or a fault of the library."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from hovi.errors import HoviError, HoviWarning

Loaded = TypeVar("Loaded")

MAX_SENTENCE_LENGTH = 1_500


class Verdict(StrEnum):
    """The result of loading an input; all but refused and accepted are faults."""

    REFUSED = "refused"
    ACCEPTED = "accepted"
    SILENT = "silently accepted"
    UNCLEAR = "refused without a sentence"
    CRASH = "crash"
    HANG = "hang"


@dataclass(frozen=True)
class Mutant:
    """A mutated input.

    content: of the file.
    reason: why it must be refused; "" if unknown.
    """

    content: bytes
    reason: str = ""


def judge(
    load: Callable[[], Loaded], error_in: Callable[[Loaded], str], reason: str
) -> tuple[Verdict, str]:
    """Load an input; returns the verdict and a sentence.

    load: loads the input. error_in: the error in a loaded object, or "".
    reason: see Mutant.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of Python or NumPy: a value that was not checked
            warnings.simplefilter("ignore", HoviWarning)  # a word, and no failure
            problem = error_in(load()) or reason
    except HoviError as error:
        sentence = str(error)
        clear = 0 < len(sentence) <= MAX_SENTENCE_LENGTH and "\n" not in sentence
        return (Verdict.REFUSED if clear else Verdict.UNCLEAR), sentence
    except (Exception, RecursionError) as error:
        return Verdict.CRASH, f"{type(error).__name__}: {error}"
    return (Verdict.SILENT, problem) if problem else (Verdict.ACCEPTED, "")
