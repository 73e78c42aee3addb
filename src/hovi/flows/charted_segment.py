"""The former names of `hovi.flows.charted_interval`, to be removed in the next version."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hovi.errors import warn
from hovi.flows import charted_interval

_NAMES = {"ChartedSegment": "ChartedInterval", "symplectic_form": "symplectic_form"}


def _deprecated(name: str) -> Any:
    """What has had this name, with a DeprecationWarning."""
    if name not in _NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn(
        f"{__name__}.{name} is now hovi.flows.charted_interval.{_NAMES[name]}.", DeprecationWarning
    )
    return getattr(charted_interval, _NAMES[name])


if not TYPE_CHECKING:  # otherwise the type checker accepts every misspelt name
    __getattr__ = _deprecated
