"""What became of an input that somebody else made: refused, accepted, or a fault of ours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from hovi.errors import HoviError

Loaded = TypeVar("Loaded")

LONGEST_SENTENCE = 1_500


class Verdict(StrEnum):
    """Refused and accepted are as it should be; the others are faults."""

    REFUSED = "refused"
    ACCEPTED = "accepted"
    SILENT = "silently accepted"
    UNCLEAR = "refused without a sentence"
    CRASH = "crash"
    HANG = "hang"


@dataclass(frozen=True)
class Mutant:
    """An input.

    content: of the file.
    poison: why it has to be refused; "" where nobody knows.
    """

    content: bytes
    poison: str = ""


def judge(
    load: Callable[[], Loaded], objection: Callable[[Loaded], str], poison: str
) -> tuple[Verdict, str]:
    """Load an input and say what became of it.

    load: what a user calls. objection: what is wrong with something that was loaded, or "".
    poison: as in Mutant.
    """
    try:
        problem = objection(load()) or poison
    except HoviError as refused:
        sentence = str(refused)
        clear = 0 < len(sentence) <= LONGEST_SENTENCE and "\n" not in sentence
        return (Verdict.REFUSED if clear else Verdict.UNCLEAR), sentence
    except (Exception, RecursionError) as error:
        return Verdict.CRASH, f"{type(error).__name__}: {error}"
    return (Verdict.SILENT, problem) if problem else (Verdict.ACCEPTED, "")
