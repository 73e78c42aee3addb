"""Cautions: what a plan says of its motion beyond its numbers, kept in the motion's metadata.

Each is a sentence under a word, such as that the grid is coarse. Whatever shows a motion, or writes
it for another program, shows them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hovi.errors import warn
from hovi.system.dataclass import dataclass

CAUTIONS = "cautions"
"""Key of the metadata: a list of pairs, a word and a sentence."""
_EARLIER = "caution"
"""That of earlier versions of hovi: the sentences against executing the motion, as one text."""
STATUS, COLLISION, COARSE, SPINS = "status", "collision", "coarse", "spins"
LIMITS, SAMPLED, LEFT_OUT, WARNED = "limits", "sampled", "left out", "warned"
"""Words: the motion is no minimum; its links enter each other; its grid is coarse; a light joint
spins; it is beyond limits that it was planned without; a condition was looked at by samples alone;
what its scene leaves unsaid; warnings."""
_AGAINST = STATUS, COLLISION
_VIOLATED = "infeasible", "diverged"
_UNFINISHED = "saddle", "unresolved", "iteration_limit", "time_limit", "interrupted"
_LENGTH, _MOST = 600, 50


@dataclass(frozen=True)
class Caution:
    """A caution. word: such as COARSE. sentence: what it says."""

    word: str
    sentence: str

    @property
    def is_against(self) -> bool:
        """Whether it speaks against executing the motion as it is."""
        return self.word in _AGAINST

    def __str__(self) -> str:
        """The word and the sentence."""
        return f"{self.word}: {self.sentence}"


def with_cautions(metadata: Mapping[str, Any], cautions: Iterable[Caution]) -> dict[str, Any]:
    """Metadata with more cautions, each sentence once."""
    recorded = {sentence: word for word, sentence in _recorded(metadata)}
    recorded |= {each.sentence: each.word for each in cautions if each.sentence not in recorded}
    if not recorded:
        return dict(metadata)
    return {**metadata, CAUTIONS: [[word, sentence] for sentence, word in recorded.items()]}


def cautions_of(metadata: Mapping[str, Any]) -> tuple[Caution, ...]:
    """The cautions of a motion, those against executing it first; none if its plan had none.

    Files are untrusted: what is no sentence is left out, and long ones are cut.
    """
    found = [Caution(_printable(word), _printable(each)) for word, each in _recorded(metadata)]
    lead = _lead(metadata.get("status"))
    if lead:
        said = [each.sentence for each in found if each.word == STATUS]
        found = [each for each in found if each.word != STATUS]
        found.insert(0, Caution(STATUS, ": ".join([lead, *said[:1]]) if said else f"{lead}."))
    return tuple(sorted(found, key=lambda each: not each.is_against))


def caution_lines(motions: Sequence[Mapping[str, Any]]) -> list[str]:
    """The cautions of motions as lines, with the numbers of the motions if there are several.

    motions: their metadata.
    """
    if len(motions) == 1:
        return [str(each) for each in cautions_of(motions[0])]
    return [f"{k + 1}, {each}" for k, data in enumerate(motions) for each in cautions_of(data)]


def warn_of_cautions(metadata: Mapping[str, Any]) -> None:
    """Warn of a motion that is not to be executed as it is."""
    against = [each.sentence for each in cautions_of(metadata) if each.is_against]
    if against:
        warn(" ".join(against))


def _lead(status: Any) -> str:
    """What a status says against executing the motion; "" if nothing."""
    if status in _VIOLATED:
        return f"This motion violates its ends, limits or distances (status {status!r})"
    if status in _UNFINISHED:
        return f"This motion is not a minimum (status {status!r}) and may violate its limits"
    return ""


def _recorded(metadata: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The pairs that are recorded, as far as they are pairs of texts."""
    entries, earlier = metadata.get(CAUTIONS), metadata.get(_EARLIER)
    if isinstance(earlier, str):
        word = STATUS if _lead(metadata.get("status")) else COLLISION
        return [(word, earlier)]
    found = entries[:_MOST] if isinstance(entries, list) else []
    pairs = [tuple(each) for each in found if isinstance(each, list | tuple) and len(each) == 2]
    return [(a, b) for a, b in pairs if isinstance(a, str) and isinstance(b, str)]


def _printable(text: str) -> str:
    return "".join(each for each in text[:_LENGTH] if each.isprintable())
