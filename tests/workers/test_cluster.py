"""The pool on a Dask cluster, with a real scheduler and real workers that are killed."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hovi.workers.lost import Lost
from hovi.workers.source import Listed, Source, Taken
from oracles.dask_cluster import Cluster

pytest.importorskip("distributed")

from hovi.workers.cluster import PER_WORKER, ClusterError, results_in_cluster


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    yield made
    made.end()


class Counted(Source[int]):
    """Whole numbers, and how many of them are given and not done."""

    def __init__(self, count: int) -> None:
        self.inner, self.flying, self.most = Listed(range(count)), 0, 0

    def take(self) -> Taken[int] | None:
        taken = self.inner.take()
        if taken is not None:
            self.flying += 1
            self.most = max(self.most, self.flying)
        return taken

    @property
    def may_give_more(self) -> bool:
        return self.inner.may_give_more


def by_value(function: Any) -> Any:
    """The function, sent by its code."""
    function.__module__ = "__main__"
    return function


def test_items_are_worked_on_with_few_at_a_time(cluster: Cluster) -> None:
    source, found = Counted(50), {}
    for number, result in results_in_cluster(
        source, by_value(lambda i, left: i * i), cluster.address, 2
    ):
        source.flying -= 1
        found[number] = result
    assert found == {i: i * i for i in range(50)}
    assert source.most <= PER_WORKER * cluster.threads


def test_a_killed_worker_costs_no_item(cluster: Cluster, tmp_path: Path) -> None:
    marker = str(tmp_path / "killed")

    def work(i: int, left: float | None) -> int:
        import os
        import signal
        from pathlib import Path

        if i == 5 and not Path(marker).exists():
            Path(marker).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return -i

    found = dict(results_in_cluster(Listed(range(12)), by_value(work), cluster.address, 2))
    assert found == {i: -i for i in range(12)}
    assert Path(marker).exists()


@pytest.mark.long
def test_an_item_that_kills_its_workers_is_lost(cluster: Cluster) -> None:
    def work(i: int, left: float | None) -> int:
        import os

        if i == 2:
            os._exit(3)
        return i

    found = dict(results_in_cluster(Listed(range(4)), by_value(work), cluster.address, 2))
    assert isinstance(found.pop(2), Lost)
    assert found == {0: 0, 1: 1, 3: 3}


def test_an_exception_of_the_work_is_raised_here(cluster: Cluster) -> None:
    def fail(i: int, left: float | None) -> None:
        raise ZeroDivisionError("by name")

    with pytest.raises(ZeroDivisionError, match="by name"):
        list(results_in_cluster(Listed(range(2)), by_value(fail), cluster.address, 2))


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of its sockets
def test_a_scheduler_that_is_started_again_gets_its_items_once_more(tmp_path: Path) -> None:
    own = Cluster(tmp_path)
    try:

        def work(i: int, left: float | None) -> int:
            import time

            time.sleep(0.2)
            return i

        found: dict[int, Any] = {}
        for number, result in results_in_cluster(Listed(range(20)), by_value(work), own.address, 2):
            assert number not in found
            found[number] = result
            if len(found) == 8:
                own.start_again()
        assert found == {i: i for i in range(20)}
    finally:
        own.end()
        gc.collect()  # of connections that the scheduler broke


def test_a_scheduler_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    from hovi.workers import cluster as module

    monkeypatch.setattr(module, "PATIENCE", 1.0)
    with pytest.raises(ClusterError, match="no Dask scheduler answers"):
        list(results_in_cluster(Listed(range(2)), print, "tcp://127.0.0.1:9", 1))
