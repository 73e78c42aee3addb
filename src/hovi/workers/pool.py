"""A pool of worker processes that loses one item, and no result, when a worker dies.

The workers are sessions of their own with pipes of their own: Ctrl-C in a terminal does not reach
them, they hold none of this process's streams open, and they end when this process does, whatever
ends it. Idle ones are kept for the next call.
"""

from __future__ import annotations

import atexit
import os
import pickle
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from typing import Any, Generic, TypeVar

import cloudpickle

from hovi.system.deadline import Deadline
from hovi.system.interruption import raise_if_cancelled
from hovi.workers.frames import ClosedPipeError, Receiver, send
from hovi.workers.lost import Lost
from hovi.workers.serving import IDLE_SECONDS
from hovi.workers.source import Listed, Source
from hovi.workers.stopped import LOOK_SECONDS, STOPPED, Watch

Item = TypeVar("Item")
Result = TypeVar("Result")

GRACE = 1.0
"""Time in [s] beyond the deadline after which busy workers are ended."""
MAX_PARKED_SECONDS = 0.8 * IDLE_SECONDS
"""Time without work after which a worker is not used again, as it is about to end."""
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"), "1"
)
_BOOTSTRAP = (
    "import sys; sys.path[:] = eval(sys.argv[1]); from hovi.workers.serving import serve; serve()"
)


def results_in_workers(
    work: Callable[[Item, float | None], Result],
    items: Sequence[Item],
    processes: int,
    deadline: Deadline,
) -> Generator[tuple[int, Result | Lost], None, None]:
    """The number of each item and its result or loss, as they come.

    work: called in a worker with an item and the time that is left, in [s]. Pickled by cloudpickle,
        so that it may be defined anywhere.
    processes: largest number of workers.
    deadline: no item is begun after it, and what is not done soon after it is given up.
    Items are missing if they were not begun, or if no worker could be started: whoever needs them
    can do without workers. To be closed, as by contextlib.closing, where it is left early.
    Raises what `work` raises.
    """
    yield from results_from(Listed(items), work, min(processes, len(items)), deadline)


def results_from(
    source: Source[Item],
    work: Callable[[Item, float | None], Result],
    processes: int,
    deadline: Deadline,
) -> Generator[tuple[int, Result | Lost], None, None]:
    """As results_in_workers, of items that a source gives one at a time, whenever a worker is idle.

    So the source may make them as they are taken, and give more once it has seen a result. It is
    asked again after every result; the end is when it has none and no worker is busy.
    Items are numbered in the order in which they are taken.
    """
    crew = _Crew[Item, Result](work, source, processes, deadline)
    try:
        yield from crew.results()
    finally:
        crew.dismiss()


class _Worker:
    """A worker process, and what it was sent."""

    def __init__(self) -> None:
        self.environment = dict(os.environ)
        self.process = subprocess.Popen(
            [sys.executable, "-c", _BOOTSTRAP, repr(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env=self.environment | _ONE_THREAD,
            start_new_session=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.requests, self.answers = self.process.stdin.fileno(), self.process.stdout.fileno()
        os.set_blocking(self.requests, False)
        self.receiver = Receiver(self.answers)
        self.watch = Watch(self.process.pid)
        self.work = b""
        self.item: int | None = None
        self.is_ready = False
        self.parked = time.monotonic()

    @property
    def is_usable(self) -> bool:
        """Whether a parked worker is alive and has this process's environment."""
        fresh = time.monotonic() - self.parked < MAX_PARKED_SECONDS
        alive = self.process.poll() is None and not self.watch.is_stopped
        return fresh and self.environment == dict(os.environ) and alive

    def begin(self, work: bytes, number: int, item: bytes, left: float | None) -> None:
        """Send an item, and the work if it is not the last one. Raises ClosedPipeError."""
        self.item = number
        if self.work != work:
            send(self.requests, "work", work)
            self.work = work
        send(self.requests, "item", item, left)

    def end(self) -> int:
        """End the process; returns its exit code."""
        with suppress(ProcessLookupError):
            self.process.kill()
        self.close()
        return self.process.wait()

    def close(self) -> None:
        """Close the pipes."""
        for stream in (self.process.stdin, self.process.stdout):
            assert stream is not None
            stream.close()


_parked: list[_Worker] = []
"""Idle workers, for the next call."""


class _Crew(Generic[Item, Result]):
    """The workers of one call."""

    def __init__(
        self,
        work: Callable[[Item, float | None], Result],
        source: Source[Item],
        count: int,
        deadline: Deadline,
    ) -> None:
        self.work, self.source, self.deadline = cloudpickle.dumps(work), source, deadline
        self.taken, self.looked = 0, time.monotonic()
        self.selector = selectors.DefaultSelector()
        self.hands: list[_Worker] = []
        for _ in range(count):
            self._hire()

    def results(self) -> Iterator[tuple[int, Result | Lost]]:
        """See results_in_workers."""
        while True:
            raise_if_cancelled()
            yield from self._hand_out()
            if not any(worker.item is not None or not worker.is_ready for worker in self.hands):
                return
            if self.deadline.passed and not self._is_busy:
                return
            ready = self.selector.select(LOOK_SECONDS)
            if not ready and not self.deadline.allows(-GRACE):
                return
            for key, _ in ready:
                yield from self._heard(key.data)
            if time.monotonic() > self.looked + LOOK_SECONDS:
                yield from self._look()

    def dismiss(self) -> None:
        """Keep idle workers for the next call, and end the others."""
        self.selector.close()
        for worker in self.hands:
            if worker.is_ready and worker.item is None:
                worker.parked = time.monotonic()
                _parked.append(worker)
            else:
                worker.end()
        self.hands = []

    @property
    def _is_busy(self) -> bool:
        return any(worker.item is not None for worker in self.hands)

    def _hire(self) -> None:
        """One more worker, unless the system refuses one."""
        worker = _idle_worker()
        if worker is None:
            try:
                worker = _Worker()
            except OSError:  # no more processes, memory or descriptors
                return
        self.hands.append(worker)
        self.selector.register(worker.answers, selectors.EVENT_READ, worker)

    def _hand_out(self) -> Iterator[tuple[int, Lost]]:
        """Give items to idle workers."""
        for worker in list(self.hands):
            if not worker.is_ready or worker.item is not None:
                continue
            item = None if self.deadline.passed else self.source.take()
            if item is None:
                return
            number, self.taken = self.taken, self.taken + 1
            sent = cloudpickle.dumps(item.content)
            try:
                worker.begin(self.work, number, sent, self.deadline.seconds_left)
            except ClosedPipeError:
                yield from self._bury(worker)

    def _heard(self, worker: _Worker) -> Iterator[tuple[int, Result | Lost]]:
        """What a worker has to say: that it is ready or done, or, by a closed pipe, dead."""
        try:
            worker.receiver.read()
        except ClosedPipeError:
            yield from self._bury(worker)
            return
        while (message := worker.receiver.message()) is not None:
            number, worker.item = worker.item, None
            worker.is_ready = True
            yield from _result(number, *message)

    def _look(self) -> Iterator[tuple[int, Lost]]:
        """Give up workers that have been stopped for long: they would be waited for without end."""
        self.looked = time.monotonic()
        for worker in list(self.hands):
            if worker.watch.looks_stopped():
                yield from self._bury(worker)

    def _bury(self, worker: _Worker) -> Iterator[tuple[int, Lost]]:
        """Replace a dead or stopped worker if there may be more to do; its item is lost.

        One that died before any item is not replaced.

        Otherwise processes would be started for ever where none can run.
        """
        self.selector.unregister(worker.answers)
        self.hands.remove(worker)
        stopped, code = worker.watch.is_stopped, worker.end()
        if worker.item is None:
            return
        if not self.deadline.passed and self.source.may_give_more:
            self._hire()
        yield worker.item, Lost(STOPPED if stopped else _cause(code))


def _result(number: int | None, kind: str, content: bytes = b"") -> Iterator[tuple[int, Any]]:
    """An answer as a result. Raises the exception that the work ended in."""
    if number is None:  # it has only become ready
        return
    found = pickle.loads(content)
    if kind == "failed":
        raise found
    yield number, Lost(found) if kind == "lost" else found


def _idle_worker() -> _Worker | None:
    """A worker of an earlier call."""
    while _parked:
        worker = _parked.pop()
        if worker.is_usable:
            return worker
        worker.end()
    return None


def _cause(code: int) -> str:
    """What became of a worker, by its exit code."""
    if code >= 0:
        return f"a worker process ended with exit code {code}"
    with suppress(ValueError):
        name = signal.Signals(-code).name
        often = ", as the system does when memory runs out" if -code == signal.SIGKILL else ""
        return f"a worker process was ended by {name}{often}"
    return f"a worker process was ended by signal {-code}"


@atexit.register
def end_idle_workers() -> None:
    """End the workers that wait for the next call."""
    while _parked:
        _parked.pop().end()


def _forget() -> None:
    """In a forked child: drop its copies of the pipes, which would keep the workers alive."""
    for worker in _parked:
        worker.close()
        worker.process.returncode = 0  # it is no child of this process
    _parked.clear()


os.register_at_fork(after_in_child=_forget)
