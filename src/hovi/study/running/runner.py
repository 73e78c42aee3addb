"""Running a study: what is missing is planned, and the tables are written."""

from __future__ import annotations

import secrets
from collections.abc import Generator
from contextlib import closing
from dataclasses import field
from pathlib import Path
from typing import Any

from hovi.errors import StudyError
from hovi.study.cells.cells import Cells
from hovi.study.running.chunks import Chunks
from hovi.study.running.from_neighbours import FromNeighbours
from hovi.study.running.in_order import InOrder
from hovi.study.running.progress import OnProgress, StudyProgress
from hovi.study.running.work import CellJob, Output, Receipt, StudyWork
from hovi.study.storage.folder import About
from hovi.study.storage.index import Index
from hovi.study.storage.journal import JournalWriter, StorageError
from hovi.study.storage.tables import PLANS, require_own, write_tables
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.files import names_file
from hovi.workers.lost import Lost
from hovi.workers.pool import results_from

Results = Generator[tuple[int, list[Receipt] | Lost], None, None]


@dataclass(eq=False)
class StudyRun:
    """One run of a study.

    folder: of the study, which no other run uses. workers: number of worker processes.
    scheduler: the address of a Dask scheduler, or "local" for a cluster on this machine; None for
        processes of hovi's own.
    replace: whether plans of other cells may leave the tables.
    """

    cells: Cells
    about: About
    folder: Path
    output: Output
    workers: int
    scheduler: str | None
    on_progress: OnProgress
    replace: bool = False
    progress: StudyProgress = field(init=False)
    given_up: tuple[tuple[CellJob, str], ...] = ()
    interrupted: bool = False

    def __post_init__(self) -> None:
        self.progress = StudyProgress(self.cells.count)

    def run(self) -> None:
        """Plan what is missing, and write the tables; an interrupt ends it early.

        Raises StudyError if nothing can be written any more; what is done stays. And if the folder
        holds plans of another study, unless these may be replaced.
        """
        index = Index(self.folder, self.output.samples)
        index.read_new()
        kind = FromNeighbours if self.cells.warm else InOrder
        chunks = kind(self.cells, index, self.output, self.workers)
        self.progress.before = self.progress.done = self._count_done(chunks)
        if not self.replace:
            require_own(self.folder, chunks.keys, index)
        self.about.write(self.folder)
        self.progress.take(0)
        try:
            self._report()
            self._plan(chunks)
        except KeyboardInterrupt:
            self.interrupted = True
        except StorageError as full:
            raise StudyError(
                f"the study in {self.folder} ends here: {full}. {self.progress.done} of "
                f"{self.cells.count} plans are done; see that the folder has room and can be read, "
                "then start it again."
            ) from None
        self.given_up = tuple(chunks.given_up)
        index.read_new()
        write_tables(self.folder, self.cells, chunks.keys, index, self.output.sample_format)

    def _count_done(self, chunks: Chunks) -> int:
        """How many cells are done. Sets the keys of all of them."""
        if len(chunks.index) == 0 and not names_file(self.folder / PLANS):
            return 0
        numbers = range(self.cells.count)
        return sum(chunks.is_stored(chunks.cell(number).key) for number in numbers)

    def _plan(self, chunks: Chunks) -> None:
        work = StudyWork(self.cells.template, str(self.folder), self.output, secrets.token_hex(4))
        with closing(self._results(chunks, work)) as results:
            for number, result in results:
                if isinstance(result, Lost):
                    self._lost(chunks, number, result.reason)
                else:
                    chunks.finished(number, result)
                    self.progress.take(chunks.without_receipt)
                    chunks.without_receipt = 0
                    self._tell(result)
        while (taken := chunks.take()) is not None:  # no worker could be started
            receipts = work(taken.content)
            chunks.finished(chunks.last_taken, receipts)
            self._tell(receipts)

    def _results(self, chunks: Chunks, work: StudyWork) -> Results:
        if self.scheduler is None:
            return results_from(chunks, work, self.workers, Deadline())
        return self._on_cluster(chunks, work, self.scheduler)

    def _on_cluster(self, chunks: Chunks, work: StudyWork, scheduler: str) -> Results:
        from hovi.workers.cluster import ClusterError, results_in_cluster  # 0.7 s

        try:
            yield from results_in_cluster(chunks, work, scheduler, self.workers)
        except ClusterError as lost:
            raise StudyError(f"{lost}; what is done stays, start the study again.") from None

    def _tell(self, receipts: list[Receipt]) -> None:
        for receipt in receipts:
            if not receipt.success:
                self.progress.failures[receipt.status] += 1
                self.progress.failed = receipt
                self._report()
                self.progress.failed = None
        self.progress.take(len(receipts))
        self._report()

    def _lost(self, chunks: Chunks, number: int, reason: str) -> None:
        """A worker died: its cell is noted as lost, and the others of its chunk are not."""
        before = len(chunks.given_up)
        suspect, done = chunks.lost(number, reason)
        self.progress.take(len(done))
        self.progress.lost += len(chunks.given_up) - before
        if suspect is not None:
            run = {"attempt": suspect.attempt, "outcome": f"lost: {reason}"}
            self._note({"key": suspect.key, "row": None, "run": run})
        self._report()

    def _note(self, entry: dict[str, Any]) -> None:
        writer = JournalWriter(self.folder)
        try:
            writer.add(entry)
            writer.sync()
        finally:
            writer.close()

    def _report(self) -> None:
        self.on_progress(self.progress)
