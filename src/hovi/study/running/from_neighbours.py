"""Cells of which each starts from the motion of a neighbour that the grid fixes.

The neighbours are those of Cells.parents: a coarse grid is planned first, then one that is twice as
fine, and so on. A cell can be begun when all its parents are done.
"""

from __future__ import annotations

import heapq
from dataclasses import field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.study.running.chunks import Chunk, Chunks, job_of
from hovi.study.running.work import CellJob, Guess
from hovi.study.storage.journal import Stored
from hovi.system.dataclass import dataclass


@dataclass(eq=False)
class FromNeighbours(Chunks):
    """The missing cells, each as soon as those that it may start from are done."""

    _ready: list[tuple[int, int, int]] = field(default_factory=lambda: [(0, 0, 1)])
    _finished: int = 0
    _motions: dict[int, Stored] = field(default_factory=dict)

    @property
    def waiting(self) -> int:
        """See Chunks; cells of which a parent is missing count as well."""
        flying = sum(len(chunk) for chunk in self._flying.values())
        return self.cells.count - self._finished - flying - len(self.given_up)

    @property
    def may_give_more(self) -> bool:
        """Whether a cell can be begun, or may be when others are done."""
        return bool(self._ready or self._flying)

    def next_chunk(self, size: int) -> Chunk:
        """See Chunks. What can be begun is shared among the workers."""
        jobs: list[CellJob] = []
        while self._ready and len(jobs) < min(size, 1 + len(self._ready) // self.workers):
            _, number, attempt = heapq.heappop(self._ready)
            cell = self.cell(number)
            if self.is_stored(cell.key):
                self._finish(number, self.stored_motion(cell.key))
            else:
                own = self.cells.takes_own_guess(number)
                jobs.append(job_of(cell, attempt, self._guesses(number), own))
        return tuple(jobs)

    def wait_again(self, suspect: CellJob | None, others: Chunk) -> None:
        """See Chunks."""
        for job in others if suspect is None else (suspect, *others):
            self._wait(job.number, job.attempt + (job is suspect))

    def job_done(self, job: CellJob, motion: Stored | None) -> None:
        """See Chunks."""
        self._finish(job.number, motion)

    def _guesses(self, number: int) -> tuple[Guess, ...]:
        """The motions of a cell's parents that found a minimum."""
        return tuple(
            Guess(self.keys[parent].decode(), self._motions[parent])
            for parent in self.cells.parents(number)
            if parent in self._motions
        )

    def _finish(self, number: int, motion: Stored | None) -> None:
        """Cells can be begun of which this was the last parent that was missing."""
        self._finished += 1
        self._done[number] = True
        if motion is not None:
            self._motions[number] = motion
        for child in self.cells.children(number):
            if all(self._done[parent] for parent in self.cells.parents(child)):
                self._wait(child, 1)

    def _wait(self, number: int, attempt: int) -> None:
        """A cell can be begun; those of coarse grids are begun first, as others wait for them."""
        heapq.heappush(self._ready, (self.cells.rank(number), number, attempt))

    @cached_property
    def _done(self) -> npt.NDArray[np.bool_]:
        return np.zeros(self.cells.count, bool)
