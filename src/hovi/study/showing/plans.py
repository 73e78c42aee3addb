"""plans.parquet and runs.parquet, or what the journals have so far, read to be shown."""

from __future__ import annotations

from collections import Counter
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, StudyError, nearest
from hovi.study.cells.extras import require_extra
from hovi.study.storage.folder import About, in_use
from hovi.study.storage.index import Index
from hovi.study.storage.rows import PlanRow
from hovi.study.storage.tables import PLANS, RUNS, read_table
from hovi.system.dataclass import dataclass
from hovi.system.files import names_file

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plans:
    """The plans of a study.

    folder: of the study. columns: of plans.parquet, by name, as lists. parameters: names of those
    that vary. seconds: that each plan took, by key; of the last run that did it.
    coordinates: as of About.
    finished: False while a run goes on and after it was killed; cells and parameters are not known.
    """

    folder: Path
    columns: dict[str, list[Any]]
    parameters: tuple[str, ...]
    seconds: dict[str, float]
    finished: bool = True
    coordinates: tuple[str, ...] = ()

    @classmethod
    def read(cls, folder: Path) -> Plans:
        """The plans of a folder; those so far if its run has not ended. Raises StudyError."""
        require_extra("pyarrow", "study")
        if in_use(folder) or not names_file(folder / PLANS):
            index = Index(folder)
            if index.read_new():
                return cls._so_far(folder, index)
        table = read_table(folder / PLANS).to_pydict()
        names = list(table)
        if "key" not in names or "status" not in names:
            raise StudyError(f"{folder / PLANS} is not the table of a study.")
        parameters = tuple(names[names.index("key") + 1 : names.index("status")])
        runs = read_table(folder / RUNS).to_pydict()
        taken = zip(runs["key"], runs["seconds"], strict=True)
        seconds = {k: s for k, s in taken if s is not None}
        about = About.read(folder)
        known = () if about is None else about.coordinates
        return cls(folder, table, parameters, seconds, coordinates=known)

    @classmethod
    def _so_far(cls, folder: Path, index: Index) -> Plans:
        """The plans of the journals, without the parameters of their cells."""
        keys = index.keys()
        done = {key: each for key in keys if (each := index.done(key)) is not None}
        rows = [each.row.to_dict() for each in done.values()]
        columns = {each.name: [row[each.name] for row in rows] for each in fields(PlanRow)}
        columns |= {"key": list(done), "cell": [None] * len(rows)}
        taken = {run["key"]: run["seconds"] for run in index.runs() if run.get("seconds")}
        return cls(folder, columns, (), taken, finished=False)

    def __len__(self) -> int:
        return len(self.columns["key"])

    def numbers(self, name: str) -> Array:
        """A column of numbers, NaN where there is none, shape (M,).

        name: of the column, or "seconds". Raises InputError for other columns.
        """
        if name == "seconds":
            return np.array([self.seconds.get(key, np.nan) for key in self.columns["key"]])
        if name not in self.columns:
            raise InputError(f"the study has no column {name!r}; {nearest(name, self.columns)}")
        values = self.columns[name]
        if any(isinstance(value, str | list) for value in values):
            raise InputError(f"column {name!r} of the study has no numbers: choose another one.")
        return np.array([np.nan if value is None else float(value) for value in values])

    @property
    def success(self) -> npt.NDArray[np.bool_]:
        """Which plans found a minimum, shape (M,)."""
        return np.array(self.columns["success"], dtype=bool)

    @property
    def varying(self) -> tuple[str, ...]:
        """Parameters that are numbers and differ between plans."""
        found = []
        for name in self.parameters:
            try:
                values = self.numbers(name)
            except InputError:
                continue
            if len(values) and np.nanmax(values) > np.nanmin(values):
                found.append(name)
        return tuple(found)

    def by_status(self) -> dict[str, int]:
        """The number of plans of each status, the most frequent first."""
        return dict(Counter(self.columns["status"]).most_common())

    def by_caution(self) -> dict[str, int]:
        """The number of minima with each word of caution, the most frequent first."""
        column = self.columns.get("cautions", [None] * len(self))
        found = zip(column, self.success, strict=True)
        words = [{line.partition(":")[0] for line in lines or ()} for lines, ok in found if ok]
        return dict(Counter(sorted(word for each in words for word in each)).most_common())

    def worst(self, count: int) -> list[int]:
        """Rows of the minima that cost most, the costliest first."""
        cost = np.where(self.success, self.numbers("cost"), np.nan)
        order = np.argsort(-cost, kind="stable")
        return [int(i) for i in order[:count] if np.isfinite(cost[i])]
