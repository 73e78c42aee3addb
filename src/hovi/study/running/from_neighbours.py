"""Cells of which each starts from the motion of a neighbour that the grid fixes.

The neighbours form a tree: see Cells.parent. A chunk is a path down that tree, so that a worker
goes on from the motion that it has just found; whatever else hangs on its cells can be begun when
the chunk is done.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from hovi.study.running.chunks import Chunk, Chunks, job_of
from hovi.study.running.work import CellJob
from hovi.study.storage.journal import Stored


@dataclass(frozen=True)
class _Ready:
    """A cell whose parent is done. guess: where the parent's motion is, if it is a minimum."""

    number: int
    guess: Stored | None
    attempt: int = 1


@dataclass(eq=False)
class FromNeighbours(Chunks):
    """The missing cells, each as soon as the one that it starts from is done."""

    _ready: deque[_Ready] = field(default_factory=lambda: deque([_Ready(0, None)]))
    _finished: int = 0
    _continued: dict[int, int] = field(default_factory=dict)

    @property
    def waiting(self) -> int:
        """See Chunks; cells of which the neighbour is missing count as well."""
        flying = sum(len(chunk) for chunk in self._flying.values())
        return self.cells.count - self._finished - flying - len(self.given_up)

    @property
    def may_give_more(self) -> bool:
        """Whether a cell can be begun, or may be when others are done."""
        return bool(self._ready or self._flying)

    def next_chunk(self, size: int) -> Chunk:
        """See Chunks."""
        while self._ready:
            first = self._ready.popleft()
            cell = self.cell(first.number)
            if self.is_stored(cell.key):
                self._finish(first.number, self.stored_motion(cell.key), None)
                continue
            return self._path(job_of(cell, first.attempt, first.guess), size)
        return ()

    def _path(self, first: CellJob, size: int) -> Chunk:
        """A path down the tree from a cell, of cells that are missing."""
        jobs = [first]
        while len(jobs) < size:
            below = self._children(jobs[-1].number)
            if not below:
                break
            cell = self.cell(below[0])
            if self.is_stored(cell.key):
                break
            self._continued[jobs[-1].number] = below[0]
            jobs.append(job_of(cell, follows=True))
        return tuple(jobs)

    def wait_again(self, suspect: CellJob | None, others: Chunk) -> None:
        """See Chunks; the others are below the suspect, and come when that is done."""
        for job in others if suspect is None else (suspect, *others):
            self._continued.pop(job.number, None)
        if suspect is None:
            return
        guess = suspect.guess
        if suspect.follows:
            parent = self.cells.parent(suspect.number)
            assert parent is not None
            guess = self.stored_motion(self.cell(parent).key)
        self._ready.append(_Ready(suspect.number, guess, suspect.attempt + 1))

    def job_done(self, job: CellJob, motion: Stored | None) -> None:
        """See Chunks."""
        self._finish(job.number, motion, self._continued.pop(job.number, None))

    def _finish(self, number: int, motion: Stored | None, continued: int | None) -> None:
        """What hangs on a cell can be begun, but for the one that its chunk goes on to."""
        self._finished += 1
        for child in self._children(number):
            if child != continued:
                self._ready.append(_Ready(child, motion))

    def _children(self, number: int) -> list[int]:
        """The cells that start from a cell's motion, first the next one on its own line."""
        places, shape = list(self.cells.places(number)), self.cells.shape
        moved = [axis for axis, place in enumerate(places) if place > 0]
        found = []
        for axis in range(moved[-1] if moved else 0, len(shape)):
            if places[axis] + 1 < shape[axis]:
                next_places = [*places[:axis], places[axis] + 1, *places[axis + 1 :]]
                found.append(self.cells.number(next_places))
        return found
