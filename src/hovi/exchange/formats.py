"""The formats of `hovi export --format NAME`, as one list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.viewing.csv_table import write_csv


@dataclass(frozen=True)
class ExportFormat:
    """A file format that other programs read.

    name: on the command line. suffix: file name extension, such as ".csv".
    write: takes the motion, the path and a rate in samples per second; writes the file completely
        or not at all. Raises InputError for an invalid rate, DisplayError when the file cannot be
        written.
    """

    name: str
    suffix: str
    write: Callable[[Trajectory, Path, float], None]


FORMATS = (ExportFormat("csv", ".csv", write_csv),)


def export_format(name: str) -> ExportFormat:
    """The format with this name. Raises InputError for an unknown name."""
    by_name = {each.name: each for each in FORMATS}
    if name not in by_name:
        raise InputError(f"there is no export format {name!r}: {nearest(name, by_name)}")
    return by_name[name]
