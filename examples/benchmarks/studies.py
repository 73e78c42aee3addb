"""Studies: what they add to the plans, what interruptions change, clusters, and warm starts.

    python studies.py throughput [COUNT]   # UR5 reaches: single plans, one worker, two workers
    python studies.py killed [COUNT]       # ended ten times at random, against an undisturbed run
    python studies.py cluster [COUNT]      # two-link reaches on a local Dask cluster, peak memory
    python studies.py restarted [COUNT]    # the same, with a scheduler that is killed in the middle
    python studies.py warm [SIDE] [ROBOT]  # a grid of goals (ur5, panda), from neighbours' motions
    python studies.py cost [COUNT]         # what a plan costs besides its own time, for the docs

Processor time is that of all processes together; wall time depends on what else the machine does.
"""

from __future__ import annotations

import hashlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from measuring import print_machine, print_table

from hovi.planning.task_file.scene_cache import SceneCache
from hovi.planning.task_file.task_plan import plan_task
from hovi.study.running.progress import StudyProgress
from hovi.study.study import Study
from hovi.workers.pool import end_idle_workers

GOAL = np.array([1.2, -0.6, 0.4, 0.7, -0.8, 1.0])
GRIDS = {"ur5": ((0, 1.2), (1, -0.6)), "panda": ((1, 0.3), (3, -1.2))}
"""Joints of which the goal varies, and the middle of their ranges."""
DISTURBANCES = 10
WAYS = ("kill a worker", "kill the parent", "Ctrl-C", "full disk")


def ur5_reaches(count: int) -> Study:
    """Reaches of the UR5 to goals around that of ur5_reach."""
    box = {"lower": (GOAL - 0.3).tolist(), "upper": (GOAL + 0.3).tolist(), "count": count}
    return Study("ur5_reach", [{"field": "goal.q", "sample": box}])


def two_link_reaches(count: int) -> Study:
    """Reaches of the two-link arm, of which no motion is stored."""
    box = {"lower": [0.0, 0.0], "upper": [1.0, 1.0], "count": count}
    return Study("two_link_reach", [{"field": "goal.q", "sample": box}], motions=False)


def goals_on_grid(side: int, warm: bool, robot: str = "ur5") -> Study:
    """A grid of goals over two joints, around that of the shipped scene."""
    axes = [
        {"field": f"goal.q[{i}]", "grid": {"lower": c - 0.3, "upper": c + 0.3, "count": side}}
        for i, c in GRIDS[robot]
    ]
    return Study(f"{robot}_reach", axes, warm=warm)


def processor_seconds() -> float:
    """Of this process and of its children that have ended, in [s]."""
    own, children = (
        resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return sum(each.ru_utime + each.ru_stime for each in (own, children))


def timed(work: Callable[[], Any]) -> tuple[float, float, Any]:
    """Wall and processor time in [s], and the result; workers are started and ended in it."""
    end_idle_workers()
    wall, spent = time.perf_counter(), processor_seconds()
    result = work()
    wall = time.perf_counter() - wall
    end_idle_workers()
    return wall, processor_seconds() - spent, result


def digest(folder: Path) -> str:
    return hashlib.sha256((folder / "plans.parquet").read_bytes()).hexdigest()


def throughput(count: int) -> None:
    """Single plans in one process against studies of one and two workers."""
    study, folder = ur5_reaches(count), Path(tempfile.mkdtemp())
    cache, cells = SceneCache(), study.cells
    tasks = [
        cells.template.task(cells.template.with_values(cells.values(i)), cache)
        for i in range(count)
    ]
    plan_task(tasks[0])
    single = timed(lambda: [plan_task(task) for task in tasks])
    rows = [["single plans", f"{single[0]:.1f}", f"{single[1]:.1f}", "1", "1"]]
    for workers in (1, 2):
        out = folder / str(workers)
        wall, spent, report = timed(lambda w=workers, o=out: study.run(o, w))
        assert report.complete
        ratios = [f"{wall / single[0]:.2f}", f"{spent / single[1]:.2f}"]
        rows.append([f"study, {workers} workers", f"{wall:.1f}", f"{spent:.1f}", *ratios])
    assert digest(folder / "1") == digest(folder / "2")
    print_table(
        [f"{count:,} UR5 reaches", "wall [s]", "processor [s]", "wall ratio", "processor ratio"],
        rows,
    )


def lines_of(folder: Path) -> int:
    return sum(each.read_bytes().count(b"\n") for each in folder.glob("journal/*.lines"))


def run_in_child(count: int, folder: Path, way: str, random: Random) -> None:
    """A run in a process of its own that is disturbed after it has done some plans."""
    limited = way == "full disk"
    command = [sys.executable, __file__, "child", str(count), str(folder), str(int(limited))]
    child = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
    for wait in (random.randint(4, 40), 3 if way == "kill a worker" else 0):
        before = lines_of(folder)
        while child.poll() is None and lines_of(folder) < before + wait:
            time.sleep(0.01)
        if wait > 3:
            disturb(child, way, random)
    if way == "kill a worker":
        child.kill()
    child.wait()


def disturb(child: subprocess.Popen[bytes], way: str, random: Random) -> None:
    """Do what a way says; a full disk comes by itself."""
    if way == "kill the parent":
        child.kill()
    elif way == "Ctrl-C":
        child.send_signal(signal.SIGINT)
    elif way == "kill a worker":
        workers = [int(pid) for pid in children_of(child.pid)]
        if workers:
            os.kill(random.choice(workers), signal.SIGKILL)


def children_of(pid: int) -> list[str]:
    threads = Path(f"/proc/{pid}/task").iterdir()
    return [child for each in threads for child in (each / "children").read_text().split()]


def child(count: int, folder: Path, limited: bool) -> None:
    if limited:  # the largest size of a file stands for that of a disk
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, resource.RLIM_INFINITY))
    ur5_reaches(count).run(folder, 2)


def killed(count: int) -> None:
    """Ended at random in four ways and started again, against an undisturbed run."""
    random, folder = Random(1), Path(tempfile.mkdtemp())
    study = ur5_reaches(count)
    study.run(folder / "whole", 2)
    end_idle_workers()
    out, rows = folder / "disturbed", []
    for number in range(DISTURBANCES):
        way = WAYS[number % len(WAYS)]
        run_in_child(count, out, way, random)
        rows.append([str(number + 1), way, f"{lines_of(out):,}"])
    report = study.run(out, 2)
    same = digest(out) == digest(folder / "whole")
    runs = Study.load_runs(out)
    twice = int(runs[runs["outcome"] == "done"]["key"].duplicated().sum())
    print_table(["", "disturbance", "lines in the journals after it"], rows)
    print(f"\n{report.new:,} plans were left for the last run; {twice} were computed twice; ")
    print(f"the bytes of plans.parquet are {'the same' if same else 'OTHERS'}.")


def cluster(count: int) -> None:
    """Two-link reaches on a local Dask cluster, whose scheduler is in this process."""
    folder, peak, over = Path(tempfile.mkdtemp()), {}, threading.Event()

    def watch() -> None:
        while not over.wait(0.5):
            for pid in (os.getpid(), *descendants(os.getpid())):
                peak[pid] = max(peak.get(pid, 0.0), memory_of(pid))

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    wall, spent, report = timed(lambda: two_link_reaches(count).run(folder, 2, scheduler="local"))
    over.set()
    watcher.join()
    assert report.complete
    runs = Study.load_runs(folder)
    planned = runs["seconds"].sum()
    here = peak.pop(os.getpid())
    rows = [
        ["wall time [s]", f"{wall:.0f}"],
        ["processor time [s]", f"{spent:.0f}"],
        ["time inside the plans [s]", f"{planned:.0f}"],
        ["rows, of which twice", f"{len(runs):,}, {int(runs['key'].duplicated().sum())}"],
        ["peak memory of scheduler and parent [MB]", f"{here:.0f}"],
        ["peak memory of the largest worker [MB]", f"{max(peak.values()):.0f}"],
        ["journal [kB per plan]", f"{size_of(folder / 'journal') / count / 1e3:.2f}"],
        [
            "plans.parquet [kB per plan]",
            f"{(folder / 'plans.parquet').stat().st_size / count / 1e3:.3f}",
        ],
    ]
    print_table([f"{count:,} two-link reaches on Dask", ""], rows)


def restarted(count: int) -> None:
    """Two-link reaches on 2 Dask workers, whose scheduler is killed and started again halfway."""
    folder, peak, crew = Path(tempfile.mkdtemp()), {}, {}
    about = folder / "scheduler.json"

    def start(name: str, *arguments: str) -> None:
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        crew[name] = subprocess.Popen(command, cwd=folder, **output)

    def start_all(port: int) -> str:
        about.unlink(missing_ok=True)
        start("scheduler", "scheduler", "--host", f"127.0.0.1:{port}", "--scheduler-file", about)
        while not (about.exists() and about.read_text().endswith("}")):
            time.sleep(0.1)
        address = json.loads(about.read_text())["address"]
        for name in ("worker 1", "worker 2"):
            start(name, "worker", address, "--nthreads", "1")
        return address

    def watch(state: StudyProgress) -> None:
        for name, pid in [("parent", os.getpid()), *((n, c.pid) for n, c in crew.items())]:
            used = max(map(memory_of, [pid, *descendants(pid)] if name != "parent" else [pid]))
            peak[name.split()[0]] = max(peak.get(name.split()[0], 0.0), used)
        if state.done >= count // 2 and not killed:
            killed.append(state.done)
            crew["scheduler"].kill()
            crew["scheduler"].wait()
            start_all(int(address.rpartition(":")[2]))

    killed: list[int] = []
    address, own = start_all(0), time.process_time()
    wall = time.perf_counter()
    study = two_link_reaches(count)
    report = study.run(folder / "out", 2, scheduler=address, progress=watch)
    wall, own = time.perf_counter() - wall, time.process_time() - own
    for each in crew.values():
        each.terminate()
    runs, plans = Study.load_runs(folder / "out"), Study.load(folder / "out")
    rows = [
        ["plans that were done when the scheduler was killed", f"{killed[0]:,}"],
        ["plans done", f"{report.done:,}"],
        ["rows of plans.parquet, cells that occur twice", f"{len(plans):,}, "],
        ["plans that were computed twice", str(int(runs["key"].duplicated().sum()))],
        ["wall time [s]; processor time:", f"{wall:.0f}"],
        [
            "of a plan in its worker [ms]",
            f"{1e3 * runs['processor_seconds'].mean():.2f}",
        ],
        ["of the parent per plan [ms]", f"{1e3 * own / count:.2f}"],
        *([f"peak memory of the {name} [MB]", f"{most:.0f}"] for name, most in peak.items()),
    ]
    rows[2][1] += str(int(plans["cell"].duplicated().sum()))
    print_table([f"{count:,} two-link reaches on Dask, scheduler restarted", ""], rows)


def descendants(pid: int) -> list[int]:
    try:
        own = [int(each) for each in children_of(pid)]
    except OSError:
        return []
    return own + [below for each in own for below in descendants(each)]


def memory_of(pid: int) -> float:
    """Resident memory of a process, in [MB]; 0 for one that has ended."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6
    except OSError:
        return 0.0


def size_of(folder: Path) -> int:
    return sum(each.stat().st_size for each in folder.iterdir())


def warm(side: int, robot: str = "ur5") -> None:
    """A grid of goals from the cubic guess and from neighbours."""
    folder, rows, tables = Path(tempfile.mkdtemp()), [], []
    for name in ("cold", "warm"):
        out = folder / name
        study = goals_on_grid(side, name == "warm", robot)
        wall, spent, _ = timed(lambda s=study, o=out: s.run(o, 1))
        table = Study.load(out)
        tables.append(table)
        minima, steps = int(table["success"].sum()), int(table["nit"].sum())
        rows.append([name, f"{wall:.1f}", f"{spent:.1f}", f"{steps:,}", f"{minima:,}"])
    print_table(
        [f"{side} x {side} goals of a {robot}", "wall [s]", "processor [s]", "steps", "minima"],
        rows,
    )
    cold, found = tables
    same = found["success"] & (~cold["success"] | (found["cost"] <= cold["cost"] * (1 + 1e-6)))
    worse = found[~same & cold["success"]]
    print(
        f"\nthe same minima or lower in {100 * (1 - len(worse) / len(found)):.1f} % of the cells;"
    )
    both = cold["success"] & found["success"]
    print(f"lower ones in {int((both & (found['cost'] < cold['cost'] * (1 - 1e-6))).sum())} of the")
    print(f"{int(both.sum())} where both have one.")
    higher = (100 * (found["cost"] / cold["cost"] - 1))[both & ~same]
    print(f"Higher by {higher.median():.2g} % in the median and {higher.max():.2g} % at most:")
    for cell in worse["cell"]:
        print(f"cell {cell}: {cold['cost'][cell]:.6g} cold, {found['cost'][cell]:.6g} warm")


def cost(count: int) -> None:
    """What a plan costs besides its own time: the parent, keys, journals and tables."""
    study, folder = two_link_reaches(count), Path(tempfile.mkdtemp())
    began = time.process_time()
    for number in range(count):
        study.cells.key(number)
    keys = time.process_time() - began
    own = time.process_time()
    study.run(folder, 2)
    parent = time.process_time() - own
    again = time.process_time()
    study.run(folder, 2)
    tables = time.process_time() - again
    runs = Study.load_runs(folder)
    rows = [
        ["parent, all it does [ms]", f"{1e3 * parent / count:.3f}"],
        ["of this: a key [ms]", f"{1e3 * keys / count:.3f}"],
        ["a start that finds all done, tables written [ms]", f"{1e3 * tables / count:.3f}"],
        ["a plan in its worker [ms]", f"{1e3 * runs['processor_seconds'].mean():.2f}"],
        ["journal [kB]", f"{size_of(folder / 'journal') / count / 1e3:.2f}"],
        ["plans.parquet [kB]", f"{(folder / 'plans.parquet').stat().st_size / count / 1e3:.3f}"],
    ]
    print_table([f"per plan, of {count:,} two-link reaches", ""], rows)


def main() -> None:
    kind, *rest = sys.argv[1:]
    if kind == "child":
        child(int(rest[0]), Path(rest[1]), rest[2] == "1")
        return
    print_machine()
    kinds = {
        "throughput": (throughput, 1000),
        "killed": (killed, 300),
        "cluster": (cluster, 100_000),
        "restarted": (restarted, 100_000),
        "warm": (warm, 30),
        "cost": (cost, 2000),
    }
    work, default = kinds[kind]
    work(int(rest[0]) if rest else default, *rest[1:])


if __name__ == "__main__":
    main()
