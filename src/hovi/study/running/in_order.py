"""Cells that do not depend on each other, in their order."""

from __future__ import annotations

from collections import deque
from dataclasses import field

from hovi.study.running.chunks import Chunk, Chunks, job_of
from hovi.study.running.work import CellJob
from hovi.study.storage.journal import Stored
from hovi.system.dataclass import dataclass


@dataclass(eq=False)
class InOrder(Chunks):
    """The missing cells in their order, of which only the next ones are made."""

    _next: int = 0
    _again: deque[tuple[int, int]] = field(default_factory=deque)
    _given: set[str] = field(default_factory=set)

    @property
    def waiting(self) -> int:
        """See Chunks."""
        return self.cells.count - self._next + len(self._again)

    def next_chunk(self, size: int) -> Chunk:
        """See Chunks."""
        jobs: list[CellJob] = []
        while len(jobs) < size and self._again:
            number, attempt = self._again.popleft()
            jobs.append(job_of(self.cell(number), attempt))
        while len(jobs) < size and self._next < self.cells.count:
            cell = self.cell(self._next)
            self._next += 1
            if cell.key not in self._given and not self.is_stored(cell.key):
                self._given.add(cell.key)  # another cell may have the same content
                jobs.append(job_of(cell))
        return tuple(jobs)

    def wait_again(self, suspect: CellJob | None, others: Chunk) -> None:
        """See Chunks."""
        if suspect is not None:
            self._again.append((suspect.number, suspect.attempt + 1))
        self._again.extend((job.number, job.attempt) for job in others)

    def job_done(self, job: CellJob, motion: Stored | None) -> None:
        """See Chunks."""
