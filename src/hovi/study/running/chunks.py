"""The cells that are left to do, as chunks that a worker needs about half a second for."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.study.cells.cells import Cell, Cells
from hovi.study.cells.template import HASH_DIGITS
from hovi.study.running.work import CellJob, Guess, Output, Receipt
from hovi.study.storage.index import Index
from hovi.study.storage.journal import Stored
from hovi.system.dataclass import dataclass
from hovi.workers.source import Source, Taken

CHUNK_SECONDS = 0.5
"""Time that a chunk should take, in [s]."""
MAX_CHUNK = 500
"""Largest number of cells of a chunk."""
ATTEMPTS = 3
"""How often a cell is begun whose worker dies each time, before it is given up in this run."""
Chunk = tuple[CellJob, ...]


@dataclass(eq=False)
class Chunks(Source[Chunk]):
    """Gives the missing cells of a study to workers.

    A worker plans the cells of a chunk one after the other, so when it dies, the first one that is
    not done is the one that it was planning, and only that one counts as an attempt.
    index: what is done. output: what is stored of each motion. workers: their number.
    given_up: cells whose workers died too often, and why.
    without_receipt: how many cells of chunks that were sent again had been done.
    """

    cells: Cells
    index: Index
    output: Output
    workers: int
    given_up: list[tuple[CellJob, str]] = field(default_factory=list)
    without_receipt: int = 0
    _flying: dict[int, Chunk] = field(default_factory=dict)
    _taken: int = 0
    _seconds: float | None = None

    @cached_property
    def keys(self) -> npt.NDArray[np.bytes_]:
        """The key of each cell, as soon as it was looked at."""
        return np.zeros(self.cells.count, f"S{HASH_DIGITS}")

    @property
    def may_give_more(self) -> bool:
        """Whether cells are waiting, or are being planned by workers that may die."""
        return self.waiting > 0 or bool(self._flying)

    def take(self) -> Taken[Chunk] | None:
        """The next chunk."""
        chunk = self.next_chunk(self._size)
        if not chunk:
            return None
        self._flying[self._taken] = chunk
        self._taken += 1
        return Taken(chunk)

    @property
    def last_taken(self) -> int:
        """The number of the chunk that was taken last."""
        return self._taken - 1

    def finished(self, number: int, receipts: list[Receipt]) -> None:
        """A chunk is done. number: of the chunk, in the order of `take`."""
        chunk = self._flying.pop(number)
        if receipts:
            mean = sum(each.seconds for each in receipts) / len(receipts)
            self._seconds = mean if self._seconds is None else 0.7 * self._seconds + 0.3 * mean
        for job, receipt in zip(chunk, receipts, strict=True):
            self.job_done(job, receipt.motion if receipt.success else None)

    def again(self, number: int, content: Chunk) -> Chunk:
        """The jobs of a chunk without a row; the others are done."""
        self.index.read_new()
        left = tuple(job for job in content if not self.is_stored(job.key))
        for job in content:
            if job not in left:
                self.without_receipt += 1
                self.job_done(job, self.stored_motion(job.key))
        self._flying[number] = left
        return left

    def lost(self, number: int, reason: str) -> tuple[CellJob | None, list[CellJob]]:
        """The worker of a chunk died; returns the job that it was at, and those done before."""
        chunk = self._flying.pop(number)
        self.index.read_new()
        count = 0
        while count < len(chunk) and self.is_stored(chunk[count].key):
            self.job_done(chunk[count], self.stored_motion(chunk[count].key))
            count += 1
        if count == len(chunk):
            return None, list(chunk)
        suspect, others = chunk[count], chunk[count + 1 :]
        if suspect.attempt >= ATTEMPTS:
            self.given_up.append((suspect, reason))
            self.wait_again(None, others)
        else:
            self.wait_again(suspect, others)
        return suspect, list(chunk[:count])

    @property
    @abstractmethod
    def waiting(self) -> int:
        """About how many cells are left, without those that are being planned."""

    @abstractmethod
    def next_chunk(self, size: int) -> Chunk:
        """Up to this many jobs that can be begun now."""

    @abstractmethod
    def wait_again(self, suspect: CellJob | None, others: Chunk) -> None:
        """Jobs are to be begun again. suspect: for which this is one more attempt."""

    @abstractmethod
    def job_done(self, job: CellJob, motion: Stored | None) -> None:
        """A job is done. motion: where its motion is, if it is a minimum."""

    def is_stored(self, key: str) -> bool:
        """Whether a plan is done, with what is wanted of its motion."""
        return self.index.has(key, self.output.motions)

    def stored_motion(self, key: str) -> Stored | None:
        """Where the motion of a minimum that is done is."""
        done = self.index.done(key)
        return done.motion if done is not None and done.row.success else None

    def cell(self, number: int) -> Cell:
        """A cell, whose key is kept."""
        cell = self.cells.cell(number)
        self.keys[number] = cell.key.encode()
        return cell

    @property
    def _size(self) -> int:
        if self._seconds is None:
            return 1
        wanted = min(MAX_CHUNK, int(CHUNK_SECONDS / max(self._seconds, 1e-4)))
        return max(1, min(wanted, self.waiting // (2 * self.workers)))


def job_of(
    cell: Cell, attempt: int = 1, guesses: tuple[Guess, ...] = (), own_guess: bool = True
) -> CellJob:
    """The job of a cell."""
    return CellJob(cell.number, cell.key, cell.values, cell.ends, attempt, guesses, own_guess)
