"""Hard case 25: the same input gives the same bytes for any number of threads and processes."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from hard.case import Case, Outcome, parameters
from hovi.system.blas_threads import one_blas_thread

PLAN = """
import sys, hovi
from hovi.robot.urdf.planar_chain import write_chain
from pathlib import Path

robot, processes, starts = sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
if robot.isdecimal():
    robot = hovi.load_robot(write_chain(Path(sys.argv[1]).with_suffix(".urdf"), int(robot)))
else:
    robot = hovi.load_robot(hovi.example(robot))
scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
n = robot.nv
found = hovi.plan(
    scene, [0.0] * n, [0.5] * n, 1.0, intervals=12, limits="none", starts=starts, seed=4,
    processes=processes, max_iterations=12,
)
found.trajectory.save(sys.argv[1])
"""

Settings = tuple[str, int, int, Mapping[str, str]]
"""Robot (or links of a chain), processes, starts, environment."""


def digest(settings: Settings) -> str:
    """SHA-256 of the motion file written by a separate process, in hexadecimal."""
    robot, processes, starts, environment = settings
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "motion.npz"
        words = [str(path), robot, str(processes), str(starts)]
        command = [sys.executable, "-c", PLAN, *words]
        subprocess.run(command, check=True, env={**os.environ, **environment})
        return hashlib.sha256(path.read_bytes()).hexdigest()


def threads(ours: int, blas: int) -> Mapping[str, str]:
    return {"OMP_NUM_THREADS": str(ours), "OPENBLAS_NUM_THREADS": str(blas)}


def same(*settings: Settings) -> Callable[[], Outcome]:
    def run() -> Outcome:
        digests = [digest(each) for each in settings]
        return Outcome("SHA-256 " + ", ".join(d[:8] for d in digests), len(set(digests)) == 1)

    return run


def naive_product() -> str:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 400_003))
    sums = {float(np.sum([part @ other for part, other in split(a, b, n)])) for n in (1, 2, 4)}
    return f"a scalar product shared by 1, 2 and 4 threads has {len(sums)} values"


def split(a: np.ndarray, b: np.ndarray, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    return list(zip(np.array_split(a, count), np.array_split(b, count), strict=True))


def naive_guesses() -> str:
    """Draw guesses from one random stream per process."""
    drawn = set()
    for processes in (1, 2):
        streams = np.random.SeedSequence(4).spawn(processes)
        numbers = [np.random.default_rng(s).normal(size=6 // processes) for s in streams]
        drawn.add(np.sort(np.concatenate(numbers)).tobytes())
    return f"a stream per process: {len(drawn)} sets of guesses from 1 and 2 processes"


CASES = (
    Case(
        "25b",
        "one or two threads of ours and of BLAS write the same bytes",
        naive_product,
        same(
            ("12", 1, 1, threads(1, 1)),
            ("12", 1, 1, threads(2, 2)),
            ("12", 1, 1, threads(1, 2)),
        ),
        "one SHA-256",
    ),
    Case(
        "25c",
        "one or two processes of a search write the same bytes",
        naive_guesses,
        same(
            ("two_link.urdf", 1, 6, threads(1, 1)),
            ("two_link.urdf", 2, 6, threads(2, 2)),
        ),
        "one SHA-256",
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_determinism(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"


def blas_threads() -> set[int]:
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_blas_has_one_thread_during_a_call_and_its_own_number_afterwards() -> None:
    one_blas_thread(blas_threads)()  # loads every BLAS
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        inside = one_blas_thread(blas_threads)()
        assert blas_threads() == before
    assert inside == {1}


def test_blas_threads_are_restored_after_an_error() -> None:
    @one_blas_thread
    def fail() -> None:
        raise ZeroDivisionError

    before = blas_threads()
    with pytest.raises(ZeroDivisionError):
        fail()
    assert blas_threads() == before
