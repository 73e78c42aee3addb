"""A study on a Dask cluster whose scheduler is killed: nothing is lost, and nothing is twice."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest

from hovi.study.running.in_order import InOrder
from hovi.study.running.progress import StudyProgress
from hovi.study.running.work import Output, StudyWork
from hovi.study.storage.index import Index
from hovi.study.study import Study
from oracles.dask_cluster import Cluster
from samples.studies import digest, reaches

pytest.importorskip("pyarrow")
pytest.importorskip("pandas")
pytest.importorskip("distributed")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of its sockets
@pytest.mark.parametrize("warm", [False, True])
def test_a_restarted_scheduler_changes_no_byte(tmp_path: Path, warm: bool) -> None:
    folder = tmp_path / "scheduler"
    folder.mkdir()
    own, states = Cluster(folder), list[int]()

    def restart(state: StudyProgress) -> None:
        if state.done >= 40 and not states:
            own.start_again()
            states.append(state.done)

    try:
        out = tmp_path / "out"
        report = reaches(120, warm).run(out, scheduler=own.address, progress=restart)
    finally:
        own.end()
        gc.collect()  # of connections that the scheduler broke
    assert states
    assert report.complete
    assert report.new == 120
    reaches(120, warm).run(tmp_path / "undisturbed", 2)
    assert digest(out) == digest(tmp_path / "undisturbed")
    assert Study.load(out)["cell"].tolist() == list(range(120))


def test_what_has_a_row_is_not_sent_again(tmp_path: Path) -> None:
    study = reaches(8)
    (tmp_path / "journal").mkdir()
    chunks = InOrder(study.cells, Index(tmp_path), Output(), 1)
    chunks._seconds = 1e-3  # a chunk of several cells
    first = chunks.take()
    assert first is not None
    assert len(first.content) == 4
    work = StudyWork(study.cells.template, str(tmp_path), Output(), "run")
    work(first.content[:3])
    left = chunks.again(0, first.content)
    assert left == first.content[3:]
    assert chunks.without_receipt == 3
    chunks.finished(0, work(left))
    rest = chunks.take()
    assert rest is not None
    assert {job.number for job in rest.content} <= {4, 5, 6, 7}
