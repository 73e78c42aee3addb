"""A pool on a Dask cluster: the same items and results as of worker processes of this machine.

Only so many items are sent as keep the workers busy, so that the scheduler's memory does not grow
with their number. A worker that dies costs the items that it had; a scheduler that is started
again gets what it had been given once more.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Generic, TypeVar

from distributed import Client, Future, LocalCluster, wait
from distributed.scheduler import KilledWorker

from hovi.workers.lost import Lost
from hovi.workers.source import Source

Item = TypeVar("Item")
Result = TypeVar("Result")

LOCAL = "local"
"""Instead of an address: a cluster on this machine."""
PER_WORKER = 2
"""Items that are sent for each thread of a worker: one to work on, and one that waits."""
PATIENCE = 120.0
"""Time in [s] to wait for a scheduler that does not answer, or that has no workers."""
POLL = 1.0
"""Time in [s] after which it is seen whether the scheduler still answers."""
_DISCONNECTED = OSError, asyncio.CancelledError, concurrent.futures.CancelledError
"""What is raised where the connection to the scheduler breaks, which cancels what it was given."""
Work = Callable[[Any, float | None], Any]


class ClusterError(Exception):
    """A scheduler does not answer, or has no workers."""


def results_in_cluster(
    source: Source[Item],
    work: Callable[[Item, float | None], Result],
    address: str,
    workers: int,
) -> Generator[tuple[int, Result | Lost], None, None]:
    """As `hovi.workers.pool.results_from`, on the workers of a Dask scheduler.

    address: of the scheduler, such as "tcp://127.0.0.1:8786", or LOCAL.
    workers: number of processes of a local cluster.
    Raises ClusterError, and what `work` raises.
    """
    if address != LOCAL:
        with _without_logs():
            yield from _Crew[Item, Result](source, work, address).results()
        return
    with _without_logs(), _local_cluster(workers) as cluster:
        yield from _Crew[Item, Result](source, work, cluster.scheduler_address).results()


@contextmanager
def _without_logs() -> Iterator[None]:
    """Without tracebacks of the client about a scheduler that is gone, which is waited for."""
    logger = logging.getLogger("distributed.client")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def _local_cluster(workers: int) -> Any:
    return LocalCluster(
        n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=50
    )


class _Crew(Generic[Item, Result]):
    """The items of one call that a cluster has."""

    def __init__(
        self, source: Source[Item], work: Callable[[Item, float | None], Result], address: str
    ) -> None:
        self.source, self.work, self.address = source, work, address
        self.taken = 0
        self.sent: dict[Any, tuple[int, Item]] = {}
        self.client = self._connected()

    def results(self) -> Iterator[tuple[int, Result | Lost]]:
        """See results_in_cluster."""
        try:
            while True:
                self._send()
                if not self.sent:
                    return
                for future in self._done():
                    number, _ = self.sent.pop(future)
                    yield number, self._result(future)
        finally:
            with suppress(Exception):  # of a scheduler that is gone
                self.client.cancel(list(self.sent), force=True)
                self.client.close(timeout=5)

    def _connected(self) -> Client:
        try:
            client = Client(self.address, timeout=PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as refused:
            raise ClusterError(f"no Dask scheduler answers at {self.address}: {refused}") from None
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            client.close(timeout=5)
            raise ClusterError(f"the Dask scheduler at {self.address} has no workers") from None
        return client

    def _send(self) -> None:
        """Send items until the cluster has enough of them."""
        most = PER_WORKER * max(1, sum(self.client.nthreads().values()))
        while len(self.sent) < most:
            item = self.source.take()
            if item is None:
                return
            self._submit(self.taken, item.content)
            self.taken += 1

    def _submit(self, number: int, item: Item) -> None:
        future = self.client.submit(_run, self.work, item, pure=False, retries=0)
        self.sent[future] = number, item

    def _done(self) -> list[Future]:
        """Some futures that are done; none after a while without any."""
        try:
            with suppress(TimeoutError), self.client.as_current():
                done = wait(list(self.sent), timeout=POLL, return_when="FIRST_COMPLETED").done
                return list(done)
            if self.client.status == "running":
                return []
        except _DISCONNECTED:
            time.sleep(POLL)
        self._again()
        return []

    def _again(self) -> None:
        """Send everything again to a scheduler that was started again."""
        sent = list(self.sent.values())
        with suppress(Exception):
            self.client.close(timeout=2)
        self.client, self.sent = self._connected(), {}
        for number, item in sent:
            self._submit(number, self.source.again(number, item))

    def _result(self, future: Future) -> Any:
        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            return Lost("its workers on the cluster died again and again")
        if error is not None:
            raise error
        return future.result()


def _run(work: Work, item: Any) -> Any:
    """An item in a worker, which is lost if it needs more memory than there is."""
    try:
        return work(item, None)
    except MemoryError:
        return Lost("a worker process had not enough memory")
