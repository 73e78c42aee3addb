"""Fuzzing of files, meshes, compiled functions and the API: no crash, no hang, nothing silent.

Inputs are made by the mutators of tests/hard, each from the seed and its number, and loaded in
separate processes: a process that dies is a crash, one that is silent for 10 s a hang. Objects that
load are checked against the file. Every fault is printed with its number, from which
`fuzz.py --show KIND NUMBER` reproduces the input.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from random import Random

from measuring import print_machine, print_table

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from hard.verdict import Mutant, Verdict

KINDS = {
    "urdf": ("hard.mutated_urdf", 10_000),
    "scene": ("hard.mutated_scene", 6_000),
    "trajectory": ("hard.mutated_motion", 6_000),
    "motion_meshes": ("hard.mutated_motion_meshes", 3_000),
    "segments": ("hard.mutated_segments", 6_000),
    "obstacles": ("hard.mutated_obstacles", 10_000),
    "request": ("hard.mutated_request", 6_000),
    "study": ("hard.mutated_study", 6_000),
    "command": ("hard.mutated_command", 2_000),
    "compiled": ("hard.compiled_calls", 14_000),
    "api": ("hard.api_calls", 14_000),
    "mesh": ("hard.mutated_mesh", 3_000),
    "mjcf": ("hard.mutated_mjcf", 5_000),
    "surface": ("hard.mutated_surface", 10_000),
}
HANG, STARTUP = 10.0, 120.0  # [s]
FAULTS = (Verdict.CRASH, Verdict.HANG, Verdict.SILENT, Verdict.UNCLEAR)

Result = tuple[int, Verdict, str, float]
"""Number of the input, verdict, reason, and time in [s]."""


def mutant(kind: str, seed: int, number: int) -> Mutant:
    """The input with this number."""
    module, _ = KINDS[kind]
    input_: Mutant = import_module(module).mutate(Random(f"{seed}:{number}"))
    return input_


def work(kind: str, seed: int, numbers: range) -> None:
    """Load inputs one after the other, and print one line of JSON for each."""
    verdict = import_module(KINDS[kind][0]).verdict
    mutant(kind, seed, 0)
    print("ready", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            input_ = mutant(kind, seed, number)
            began = time.perf_counter()
            found, reason = verdict(input_, Path(folder))
            print(
                json.dumps([number, found, reason[:300], time.perf_counter() - began]), flush=True
            )


def watch(kind: str, seed: int, numbers: range) -> Iterator[Result]:
    """The results of a fraction of the inputs, restarting the process after a crash or a hang."""
    while numbers:
        part = [kind, str(seed), str(numbers.start), str(numbers.stop), str(numbers.step)]
        command = [sys.executable, "-W", "error", __file__, "--work", *part]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0
        ) as process:
            assert process.stdout is not None
            _line(process, STARTUP)
            while numbers:
                began = time.perf_counter()
                line, silent = _line(process, HANG)
                if not line:
                    process.kill()
                    died = f"the process ended with exit code {process.wait()}"
                    fault = (Verdict.HANG, "") if silent else (Verdict.CRASH, died)
                    yield numbers[0], *fault, time.perf_counter() - began
                else:
                    number, found, reason, seconds = json.loads(line)
                    yield number, Verdict(found), reason, seconds
                numbers = numbers[1:]
                if not line:
                    break


def _line(process: subprocess.Popen[bytes], seconds: float) -> tuple[bytes, bool]:
    """The next line of a process, or b"" and whether it was silent for too long."""
    assert process.stdout is not None
    if not select.select([process.stdout], [], [], seconds)[0]:
        return b"", True
    return process.stdout.readline(), False


def fuzz(kind: str, seed: int, count: int) -> list[Result]:
    """The results of all inputs of one kind, loaded by one process per processor."""
    cores = len(os.sched_getaffinity(0))
    parts = [range(first, count, cores) for first in range(cores)]
    with ThreadPoolExecutor(cores) as pool:
        parts = pool.map(lambda numbers: list(watch(kind, seed, numbers)), parts)
    return [result for part in parts for result in part]


def report(results: dict[str, list[Result]], seed: int) -> int:
    """Print the table and every fault; returns the number of faults."""
    total = sum(map(len, results.values()))
    print(
        f"{total:,} inputs, seed {seed}, at most {HANG:.0f} s each, warnings counted as crashes.\n"
    )
    table = []
    for kind, found in results.items():
        counts = Counter(verdict for _, verdict, _, _ in found)
        seconds = sorted(each for *_, each in found)
        times = [f"{1e3 * seconds[len(seconds) // 2]:.1f}", f"{1e3 * seconds[-1]:.0f}"]
        verdicts = [f"{counts[verdict]:,}" for verdict in Verdict]
        table.append([kind, f"{len(found):,}", *verdicts, *times])
    columns = ["file", "inputs", *Verdict, "median ms", "slowest ms"]
    print_table(columns, table)
    faults = [(kind, *each) for kind, found in results.items() for each in found]
    faults = [fault for fault in faults if fault[2] in FAULTS]
    for kind, number, verdict, reason, _ in faults:
        print(f"- {kind} {number}: {verdict}: {reason}")
    return len(faults)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--share", type=float, default=1.0, help="of the usual number of inputs")
    parser.add_argument("--show", nargs=2, metavar=("KIND", "NUMBER"), help="print one input")
    parser.add_argument("--work", nargs=5, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.work:
        kind, seed, *numbers = given.work
        work(kind, int(seed), range(*map(int, numbers)))
        return 0
    if given.show:
        sys.stdout.buffer.write(mutant(given.show[0], given.seed, int(given.show[1])).content)
        return 0
    results = {}
    for kind, (_, count) in KINDS.items():
        print(f"{kind} ...", file=sys.stderr, flush=True)
        results[kind] = fuzz(kind, given.seed, max(1, int(given.share * count)))
    faults = report(results, given.seed)
    print_machine()
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
