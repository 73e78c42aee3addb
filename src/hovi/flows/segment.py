"""The former names of `hovi.flows.interval`, to be removed in the next version."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hovi.flows import interval
from hovi.flows.former_names import former_names

_NAMES = {"Segment": "Interval", "SegmentLagrangian": "FlatLagrangian"}

if not TYPE_CHECKING:  # otherwise the type checker accepts every misspelt name
    __getattr__ = former_names(__name__, interval, _NAMES)
