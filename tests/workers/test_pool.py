"""The pool of worker processes, with real ones that die, hang, fail to start and are left alone."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from hovi.system.deadline import Deadline
from hovi.workers import frames, pool
from hovi.workers.lost import Lost
from hovi.workers.pool import end_idle_workers, results_from, results_in_workers
from hovi.workers.source import Source, Taken
from hovi.workers.stopped import STOPPED, state_of
from oracles.processes import children, is_running, wait_until

Work = Callable[[int, float | None], Any]


@pytest.fixture(autouse=True)
def new_workers() -> Iterator[None]:
    """Workers of the test's own, which end with it."""
    end_idle_workers()
    yield
    end_idle_workers()


def run(work: Work, count: int, processes: int = 2, deadline: Deadline | None = None) -> dict:
    return dict(results_in_workers(work, range(count), processes, deadline or Deadline()))


def test_every_item_gets_its_own_result() -> None:
    offset = 10  # in a closure, which only cloudpickle can send
    assert run(lambda i, left: (i * i + offset, left), 7) == {
        i: (i * i + 10, None) for i in range(7)
    }


def test_the_work_runs_in_other_processes_that_are_kept() -> None:
    first = set(run(lambda i, left: os.getpid(), 4, processes=1).values())
    again = set(run(lambda i, left: os.getpid(), 4, processes=1).values())
    assert first == again
    assert len(first) == 1
    assert first != {os.getpid()}
    end_idle_workers()
    wait_until(lambda: not any(map(is_running, first)))


def test_a_worker_of_another_environment_is_not_used_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def work(i: int, left: float | None) -> tuple[int, str | None]:
        return os.getpid(), os.environ.get("HOVI_TEST")

    before = run(work, 1)[0]
    monkeypatch.setenv("HOVI_TEST", "changed")
    after = run(work, 1)[0]
    assert before[1] is None
    assert after[1] == "changed"
    assert before[0] != after[0]


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_a_killed_worker_loses_its_item_only(number: signal.Signals) -> None:
    def work(i: int, left: float | None) -> int:
        if i in (2, 5):
            os.kill(os.getpid(), number)
        return -i

    found = run(work, 9)
    assert sorted(found) == list(range(9))
    lost = {i: each.reason for i, each in found.items() if isinstance(each, Lost)}
    assert sorted(lost) == [2, 5]
    assert all(f"was ended by {number.name}" in reason for reason in lost.values())
    assert {i: each for i, each in found.items() if i not in lost} == {
        i: -i for i in range(9) if i not in lost
    }


def test_a_worker_that_exits_says_with_which_code() -> None:
    found = run(lambda i, left: os._exit(3), 2, processes=1)
    assert found == {i: Lost("a worker process ended with exit code 3") for i in range(2)}


def test_an_item_without_memory_is_lost() -> None:
    def work(i: int, left: float | None) -> int:
        return len(b"x" * (1 << 60)) if i == 1 else i

    found = run(work, 3)
    assert found == {0: 0, 1: Lost("a worker process had not enough memory"), 2: 2}


def test_an_exception_of_the_work_is_raised_here() -> None:
    def fail(i: int, left: float | None) -> None:
        raise ZeroDivisionError("by name")

    with pytest.raises(ZeroDivisionError, match="by name"):
        run(fail, 3)


def test_an_exception_that_cannot_be_sent_is_raised_by_its_text() -> None:
    class UnsendableError(Exception):
        def __init__(self, one: object, two: object) -> None:
            super().__init__("one and two")

    def fail(i: int, left: float | None) -> None:
        raise UnsendableError(1, 2)

    with pytest.raises(RuntimeError, match="UnsendableError: one and two"):
        run(fail, 3)


def test_work_that_cannot_be_sent_raises_what_loading_it_does() -> None:
    with pytest.raises(ModuleNotFoundError):
        run(_of_this_file, 2)


def _of_this_file(i: int, left: float | None) -> int:
    return i


def test_what_the_work_prints_does_not_disturb_the_answers() -> None:
    def work(i: int, left: float | None) -> int:
        print("x" * 100_000, flush=True)
        os.write(1, b"y" * 100_000)
        return i

    assert run(work, 3) == {0: 0, 1: 1, 2: 2}


def test_large_items_and_results_arrive_whole() -> None:
    items = [bytes([i]) * 3_000_000 for i in range(4)]
    found = dict(results_in_workers(lambda x, left: x[::-1] + x, items, 2, Deadline()))
    assert found == {i: 2 * item for i, item in enumerate(items)}


def test_nothing_is_begun_after_the_deadline() -> None:
    assert run(lambda i, left: i, 4, deadline=Deadline(-1.0)) == {}


def test_work_that_does_not_end_in_time_is_given_up_and_its_process_ended(tmp_path: Any) -> None:
    def work(i: int, left: float | None) -> int:
        assert left is not None
        (tmp_path / str(os.getpid())).touch()
        time.sleep(3600.0 if i == 1 else 0.0)
        return i

    found = run(work, 2, deadline=Deadline(10.0))
    assert found == {0: 0}
    end_idle_workers()
    pids = [int(path.name) for path in tmp_path.iterdir()]
    assert pids
    wait_until(lambda: not any(map(is_running, pids)))


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pool that looks more often than once a second."""
    monkeypatch.setattr(pool, "LOOK_SECONDS", 0.02)
    monkeypatch.setattr(frames, "PATIENCE", 0.2)


@pytest.mark.usefixtures("impatient")
def test_a_stopped_worker_is_given_up_and_a_slow_one_is_not() -> None:
    def work(i: int, left: float | None) -> int:
        if i == 1:
            os.kill(os.getpid(), signal.SIGSTOP)
        time.sleep(1.0 if i == 0 else 0.0)
        return i

    found = run(work, 4)
    assert found == {0: 0, 1: Lost(STOPPED), 2: 2, 3: 3}


@pytest.mark.usefixtures("impatient")
def test_a_worker_that_is_continued_in_time_loses_nothing() -> None:
    def work(i: int, left: float | None) -> int:
        if i == 0:
            waker = f"sleep 0.1; kill -CONT {os.getpid()}"
            subprocess.Popen(["sh", "-c", waker], start_new_session=True)
            os.kill(os.getpid(), signal.SIGSTOP)
        return i

    assert run(work, 2) == {0: 0, 1: 1}


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("size", [1, 1_000_000])
def test_a_worker_that_was_stopped_between_calls_is_not_used_again(size: int) -> None:
    stopped = run(lambda i, left: os.getpid(), 1)[0]
    os.kill(stopped, signal.SIGSTOP)
    wait_until(lambda: state_of(stopped) == "T")
    items = [b"x" * size] * 3
    found = dict(results_in_workers(lambda x, left: (len(x), os.getpid()), items, 2, Deadline()))
    assert [found[i][0] for i in range(3)] == [size] * 3
    assert stopped not in {pid for _, pid in found.values()}
    assert not is_running(stopped)


@pytest.mark.usefixtures("impatient")
def test_what_a_stopped_worker_does_not_read_blocks_nothing() -> None:
    def stop_soon(x: bytes, left: float | None) -> int:
        waker = f"sleep 0.1; kill -STOP {os.getpid()}"
        subprocess.Popen(["sh", "-c", waker], start_new_session=True)
        return len(x)

    def items() -> Iterator[bytes]:
        yield b""
        time.sleep(0.3)  # as the worker is stopped between two items
        yield b"x" * 1_000_000

    source = Drawn(items())
    found = dict(results_from(source, stop_soon, 1, Deadline()))
    assert found == {0: 0, 1: Lost(STOPPED)}


class Drawn(Source[bytes]):
    """The items of an iterator, each made when it is asked for."""

    def __init__(self, items: Iterator[bytes]) -> None:
        self._items = items

    def take(self) -> Taken[bytes] | None:
        item = next(self._items, None)
        return None if item is None else Taken(item)

    @property
    def may_give_more(self) -> bool:
        return False


@pytest.mark.parametrize("program", ["/nowhere/python", "/bin/false", "/bin/true"])
def test_without_a_process_that_starts_there_are_no_results(
    program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    assert run(lambda i, left: i, 5) == {}


PARENT = """
import os, signal, sys, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # which nohup ignores
from hovi.system.deadline import Deadline
from hovi.workers.pool import results_in_workers

def work(i, left):
    if i < 2 and {busy}:
        while True:
            pass  # holds the interpreter
    return os.getpid()

if {busy}:
    for _, pid in results_in_workers(work, range(4), 4, Deadline()):
        print(pid, flush=True)
else:
    pids = set(dict(results_in_workers(work, range(4), 2, Deadline())).values())
    child = os.fork()
    if child != 0:
        print(*pids, child, flush=True)
    time.sleep(3600)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_workers_end_with_their_parent_even_in_the_middle_of_work(number: signal.Signals) -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT.format(busy=True)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    parent.stdout.readline(), parent.stdout.readline()  # two are done, the others busy
    pids = children(parent.pid)
    assert len(pids) >= 2
    parent.send_signal(number)
    parent.communicate(timeout=30)  # the end of stdout: nobody else holds it
    wait_until(lambda: not any(map(is_running, pids)))


def test_a_forked_child_does_not_keep_workers_alive() -> None:
    parent = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", PARENT.format(busy=False)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    *pids, child = map(int, parent.stdout.readline().split())  # one worker or two, as it came
    assert pids
    parent.kill()
    parent.wait()
    try:
        wait_until(lambda: not any(map(is_running, pids)))
        assert is_running(child)
    finally:
        os.kill(child, signal.SIGKILL)
        parent.stdout.close()
