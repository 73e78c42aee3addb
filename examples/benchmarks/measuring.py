"""Shared by the benchmarks: measurements in separate processes, best times, Markdown tables."""

from __future__ import annotations

import compileall
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits


@cache
def compile_modules() -> None:
    """Compile hovi's modules to bytecode, as installers do, so that no measured time contains it.

    An editable installation compiles them when they are first imported, and with
    PYTHONDONTWRITEBYTECODE they are compiled in every process.
    """
    import hovi  # not by those who only print tables, and import hovi from elsewhere

    compileall.compile_dir(Path(hovi.__file__).parent, quiet=2)


def alone(function: Callable[..., Any], *arguments: Any, threads: int = 1) -> Any:
    """function(*arguments) in a fresh process, with cold caches and separate memory.

    threads: of BLAS and of the kernel, which both follow OMP_NUM_THREADS.
    """
    compile_modules()
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = str(threads)
    print(f"{function.__name__}{arguments}, {threads} thread(s)", file=sys.stderr, flush=True)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_limited, threads, function, arguments).result()


def _limited(threads: int, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    with threadpool_limits(threads):
        return function(*arguments)


def best_time(work: Callable[[], Any], seconds: float = 0.5, least: int = 3) -> float:
    """The shortest of many runs, in [s], which depends least on other load."""
    times: list[float] = []
    while len(times) < least or sum(times) < seconds:
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def peak_memory() -> float:
    """Peak memory of this process, in [MB].

    From /proc, since the ru_maxrss of a child starts at the peak of its parent.
    """
    status = Path("/proc/self/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """p of values ~ sizes^p, by least squares in logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def print_table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a Markdown table; the first column is text, the others are numbers."""
    print("| " + " | ".join(columns) + " |")
    print("|---|" + "---:|" * (len(columns) - 1))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print()


def print_machine(threads: int | None = None) -> None:
    """Print the line of `machine`."""
    print(f"{machine(threads)}\n")


def machine(threads: int | None = None) -> str:
    """One line with the processor, threads and package versions."""
    processor = platform.processor() or platform.machine()
    cpu = Path("/proc/cpuinfo")
    if cpu.exists():
        names = [line for line in cpu.read_text().splitlines() if line.startswith("model name")]
        processor = names[0].split(":")[1].strip() if names else processor
    cores = len(os.sched_getaffinity(0))
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "pin", "casadi"))
    used = "" if threads is None else f", {threads} thread{'s' if threads > 1 else ''}"
    return f"*{processor}, {cores} cores{used}; Python {platform.python_version()}, {packages}.*"
