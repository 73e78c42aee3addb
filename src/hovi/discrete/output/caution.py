"""What a motion's file says against executing it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hovi.errors import warn

CAUTION = "caution"
"""Key of the metadata."""
_VIOLATED = "infeasible", "diverged"
_UNFINISHED = "saddle", "unresolved", "iteration_limit", "time_limit", "interrupted"
_LENGTH = 600


def caution_of(metadata: Mapping[str, Any]) -> str:
    """Why a motion is not to be executed as it is, in a sentence or two; "" if nothing is known.

    From what its plan recorded: its status, and what `plan` said of a motion that is no minimum or
    in which links enter each other.
    """
    status, recorded = metadata.get("status"), metadata.get(CAUTION)
    said = recorded if isinstance(recorded, str) else ""
    said = "".join(each for each in said[:_LENGTH] if each.isprintable())
    if status in _VIOLATED:
        lead = f"This motion violates its ends, limits or distances (status {status!r})"
    elif status in _UNFINISHED:
        lead = f"This motion is not a minimum (status {status!r}) and may violate its limits"
    else:
        return said
    return f"{lead}: {said}" if said else f"{lead}."


def warn_of_caution(metadata: Mapping[str, Any]) -> None:
    """Warn of a motion that is not to be executed as it is."""
    sentence = caution_of(metadata)
    if sentence:
        warn(sentence)
