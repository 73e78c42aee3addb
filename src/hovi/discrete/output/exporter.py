"""The function that exports motions: registered by the package, as formats draw and simulate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Exporter = Callable[..., None]
"""(motion, path, format, rate, **options): see `hovi.export`."""

_registered: list[Callable[[], Exporter]] = []


def register_exporter(load: Callable[[], Exporter]) -> None:
    """Register the function behind `Trajectory.to_csv` and the like; load: returns it."""
    _registered[:] = [load]


def exported(motion: Any, path: Any, format: str, rate: float | None, **options: Any) -> None:
    """Write a motion with the registered function."""
    _registered[0]()(motion, path, format, rate, **options)
