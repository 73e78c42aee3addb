"""What is left of work whose process died."""

from __future__ import annotations

from hovi.system.dataclass import dataclass


@dataclass(frozen=True)
class Lost:
    """An item without a result, since its worker died. reason: what became of the worker."""

    reason: str
