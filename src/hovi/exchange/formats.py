"""The one list of formats that a motion is exported to: `hovi export --format NAME`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.viewing.csv_table import write_csv


@dataclass(frozen=True)
class ExportFormat:
    """A kind of file that other programs read.

    name: as the command line has it. suffix: of its files, such as ".csv".
    write: takes the motion, the file and a rate in samples per second; writes the file whole or
        not at all. Raises InputError for a bad rate, DisplayError when it cannot be written.
    """

    name: str
    suffix: str
    write: Callable[[Trajectory, Path, float], None]


FORMATS = (ExportFormat("csv", ".csv", write_csv),)


def export_format(name: str) -> ExportFormat:
    """The format of a name. Raises InputError for an unknown one."""
    by_name = {each.name: each for each in FORMATS}
    if name not in by_name:
        raise InputError(f"there is no export format {name!r}: {nearest(name, by_name)}")
    return by_name[name]
