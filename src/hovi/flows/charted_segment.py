"""The former names of `hovi.flows.charted_interval`, to be removed in the next version."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hovi.flows import charted_interval
from hovi.flows.former_names import former_names

_NAMES = {"ChartedSegment": "ChartedInterval", "symplectic_form": "symplectic_form"}

if not TYPE_CHECKING:  # otherwise the type checker accepts every misspelt name
    __getattr__ = former_names(__name__, charted_interval, _NAMES)
