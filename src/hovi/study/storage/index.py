"""What the journals of a study have, by key: where the line of each plan is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from typing import Any

from hovi.errors import StudyError
from hovi.study.storage.journal import FOLDER, LINES, Stored, entry_of
from hovi.study.storage.rows import PlanRow
from hovi.system.dataclass import dataclass
from hovi.system.files import reason


@dataclass(frozen=True)
class Done:
    """A plan that is done: its row, and where its motion and its samples are."""

    row: PlanRow
    motion: Stored | None
    samples: Stored | None


@dataclass(frozen=True, slots=True)
class _Line:
    """Where a line is. asked: whether for a motion, and for how many samples."""

    file: int
    offset: int
    length: int
    asked: tuple[bool, int]


@dataclass(eq=False)
class Index:
    """The lines of all journals of a study, of which only their places are kept.

    folder: of the study. samples: how many of each motion are wanted, 0 for none.
    """

    folder: Path
    samples: int = 0
    _lines: dict[str, _Line] = field(default_factory=dict)
    _runs: list[tuple[int, int, int]] = field(default_factory=list)
    _files: list[Path] = field(default_factory=list)
    _read: dict[Path, tuple[int, int]] = field(default_factory=dict)

    def read_new(self) -> list[str]:
        """Read what was added to the journals; the keys of plans that are new. Raises StudyError.

        Of a plan that was done twice, the line that has as many samples as are wanted is taken,
        then the one that has a motion, or else the first one.
        """
        found = []
        try:
            for path in sorted((self.folder / FOLDER).glob(f"*{LINES}")):
                found += self._read_file(path)
        except OSError as refused:
            raise _unreadable(self.folder, refused) from None
        return found

    def has(self, key: str, motion: bool) -> bool:
        """Whether a plan is done that was asked for its samples, and for its motion if wanted."""
        line = self._lines.get(key)
        return line is not None and line.asked[0] >= motion and self._is_sampled(line.asked)

    def __contains__(self, key: str) -> bool:
        return key in self._lines

    def __len__(self) -> int:
        return len(self._lines)

    def keys(self) -> list[str]:
        """The keys of all plans that are done."""
        return list(self._lines)

    def done(self, key: str) -> Done | None:
        """A plan; None if it is not done. Raises StudyError."""
        line = self._lines.get(key)
        if line is None:
            return None
        entry = self._entry(line.file, line.offset, line.length)
        assert entry is not None
        row = PlanRow.from_dict(entry["row"])
        samples = _stored(entry["samples"]) if self._is_sampled(line.asked) else None
        return Done(row, _stored(entry["motion"]), samples)

    def runs(self) -> Iterator[dict[str, Any]]:
        """The runs of all plans, also of those that were lost. Raises StudyError."""
        for place in self._runs:
            entry = self._entry(*place)
            if entry is not None:
                yield {"key": entry["key"], **entry["run"]}

    def _read_file(self, path: Path) -> list[str]:
        if path not in self._read:
            self._read[path] = len(self._files), 0
            self._files.append(path)
        number, offset = self._read[path]
        found = []
        with path.open("rb") as stream:
            stream.seek(offset)
            for line in stream:
                if not line.endswith(b"\n"):
                    break  # it may be whole later
                key = self._take(line, number, offset)
                found += [] if key is None else [key]
                offset += len(line)
        self._read[path] = number, offset
        return found

    def _take(self, line: bytes, file: int, offset: int) -> str | None:
        """Keep the place of a line; its key if it is that of a plan."""
        entry = entry_of(line)
        if entry is None:
            return None
        try:
            key, asked = _checked(entry)
        except (KeyError, TypeError, ValueError):
            return None  # of another version
        self._runs.append((file, offset, len(line)))
        if asked is None:
            return None
        before = self._lines.get(key)
        if before is None or self._rank(asked) > self._rank(before.asked):
            self._lines[key] = _Line(file, offset, len(line), asked)
        return key

    def _is_sampled(self, asked: tuple[bool, int]) -> bool:
        return self.samples in (0, asked[1])

    def _rank(self, asked: tuple[bool, int]) -> tuple[bool, bool]:
        return self._is_sampled(asked), asked[0]

    def _entry(self, file: int, offset: int, length: int) -> dict[str, Any] | None:
        try:
            with self._files[file].open("rb") as stream:
                stream.seek(offset)
                return entry_of(stream.read(length))
        except OSError as refused:
            raise _unreadable(self.folder, refused) from None


def _checked(entry: dict[str, Any]) -> tuple[str, tuple[bool, int] | None]:
    """The key of an entry, and what a plan was asked for. Raises as conversions do."""
    key, run = entry["key"], entry["run"]
    if not isinstance(key, str) or not isinstance(run, dict):
        raise TypeError
    if entry["row"] is None:
        return key, None
    PlanRow.from_dict(entry["row"])
    _stored(entry["motion"])
    _stored(entry["samples"])
    motions, samples = entry["asked"]
    return key, (bool(motions), int(samples))


def _stored(data: Any) -> Stored | None:
    return None if data is None else Stored.from_list(data)


def _unreadable(folder: Path, refused: OSError) -> StudyError:
    return StudyError(f"the study in {folder} cannot be read: {reason(refused)}.")
