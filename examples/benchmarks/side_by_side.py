"""Two checkouts of hovi, problem by problem: is what solves still as right, as sure and as fast?

    python side_by_side.py BEFORE              # ten minutes on two cores
    python side_by_side.py BEFORE --quick      # 90 seconds
    python side_by_side.py BEFORE --only limited replans --bits

BEFORE is the path of another checkout, or a commit of this repository. Both run the problems of
compared_problems.py in turn, in processes of their own. Every success is judged outside of hovi. A
class of problems passes if
- no success is false, and none of BEFORE is lost: one that crashes or takes longer than it may is;
- the optimiser takes at most 1.05 times the steps in the median;
- it takes at most 1.1 times the time, in the median and in all. Times are processor times next to
  that of 10,000 points of the UR5 kernel in the same process at the same moment. What is slower is
  measured again before that is said;
- with --bits, status, steps, cost and motion of every problem are the same to the last bit.

Kernel points are those at which torques were evaluated, and calls the function calls of a few
problems under a profiler. `--save FILE` keeps what BEFORE did, and `--load FILE` takes it from
there instead. Ctrl-C ends the measurement and prints what there is. The exit code is 1 if a class
does not pass.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from measuring import print_machine, print_table
from solving_statements import solving_statements

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
KINDS = (
    *("tasks", "limited", "unlimited", "hard", "sequences", "durations", "replans", "advances"),
    *("swing-ups", "studies"),
)
"""Classes of problems, as in compared_problems.py."""
MAX_STEPS, MAX_TIME = 1.05, 1.1
"""Ratios to BEFORE up to which a class passes."""
LEAST_TIME = 0.5
"""Times below this are too short to compare, in times of 10,000 points of the kernel."""
AGAIN = 2
"""How often what is slower is measured again."""
SHOWN = 8
"""Number of problems that are listed for each fault of a class."""
PATIENCE = 20.0
"""Ratio of a clock's time to the processor's from which a process is taken to hang."""

Row = dict[str, Any]
Rows = dict[str, dict[str, Row]]
"""Rows by class and name of the problem."""


# Processes


class Worker:
    """A process that runs problems with one checkout; it is started again when it dies."""

    def __init__(self, checkout: Path, log: Path) -> None:
        self._checkout, self._log = checkout, log
        self._process: subprocess.Popen[str] | None = None
        self._ended_for_good = False
        self._lines: queue.Queue[str | None] = queue.Queue()

    def _start(self) -> subprocess.Popen[str]:
        source = str(self._checkout / "src")
        one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": source}
        command = [sys.executable, "-W", "ignore", str(HERE / "checkout_worker.py")]
        with self._log.open("a") as log:
            process = subprocess.Popen(
                [*command, str(self._checkout)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env=os.environ | one,
                process_group=0,  # which Ctrl-C does not reach
            )
        lines: queue.Queue[str | None] = queue.Queue()
        threading.Thread(target=_forward, args=(process.stdout, lines), daemon=True).start()
        self._lines = lines
        return process

    def end(self) -> None:
        """End the process, and start none any more."""
        self._ended_for_good = True
        self.close()

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            assert process.stdin is not None
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()

    def ask(self, request: dict[str, Any], seconds: float) -> Iterator[Row]:
        """The answers to a request; the last one says `lost` if the process ended before.

        seconds: most time on a clock until the next answer.
        """
        if self._process is None:
            self._process = self._start()
        assert self._process.stdin is not None
        try:
            print(json.dumps(request), file=self._process.stdin, flush=True)
        except BrokenPipeError:
            yield {"lost": self._ended()}
            return
        while True:
            try:
                line = self._lines.get(timeout=seconds)
            except queue.Empty:
                self.close()
                yield {"lost": "hangs"}
                return
            if line is None:
                yield {"lost": self._ended()}
                return
            answer = json.loads(line)
            if "done" in answer:
                return
            yield answer

    def _ended(self) -> str:
        """How the process ended, in a word."""
        process = self._process
        code = 0 if process is None else process.wait()
        self.close()
        if -code in (signal.SIGXCPU, signal.SIGKILL):
            return "time-out"
        return f"crash ({code}): {self.failure()}"

    def failure(self) -> str:
        """The last line that the process wrote before it died."""
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "no message"

    def groups(self, kinds: Sequence[str], quick: bool) -> list[dict[str, Any]]:
        """The groups of problems."""
        answers = [*self.ask({"kinds": list(kinds), "quick": quick}, 600.0)]
        if "groups" in answers[0]:
            return list(answers[0]["groups"])
        sys.exit(f"The checkout {self._checkout} does not run: {self.failure()}")

    def run(self, group: dict[str, Any], seed: int, known: dict[str, Any]) -> dict[str, Row]:
        """The rows of a group, by name; problems in which the process dies are without success."""
        rows: dict[str, Row] = {}
        patience = PATIENCE * group["limit"] + 600.0
        while not self._ended_for_good:
            request = {"group": group, "seed": seed, "skip": list(rows), "known": known}
            begun: list[str] = []
            for answer in self.ask(request, patience):
                if "begin" in answer:
                    begun = answer["begin"]
                elif "lost" in answer:
                    if not begun or set(begun) <= set(rows):  # between two problems
                        begun = [name for name in group["names"] if name not in rows]
                    for name in begun:
                        rows.setdefault(name, _without_answer(name, answer["lost"]))
                    break
                else:
                    name, status = answer["name"], str(answer.get("status"))
                    rows[name] = _without_answer(name, status) | answer
            else:
                return rows
        raise KeyboardInterrupt


def _forward(stream: Any, lines: queue.Queue[str | None]) -> None:
    with stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def _without_answer(name: str, why: str) -> Row:
    row = dict.fromkeys(("nit", "cost", "seconds", "kernel", "points", "calls"))
    return row | {
        "name": name,
        "success": False,
        "status": why,
        "message": "",
        "bits": why,
        "denied": "",
    }


# Checkouts


def compiled_modules(checkout: Path) -> list[Path]:
    """The compiled modules of a checkout."""
    return sorted((checkout / "src" / "hovi" / "_native").glob("*.so"))


def require_compiled(checkout: Path) -> None:
    """Exit with a sentence if a checkout has no compiled modules."""
    if not compiled_modules(checkout):
        sys.exit(
            f"{checkout} has no compiled modules in src/hovi/_native: run `pip install --target "
            f"built --no-deps .` there, and copy built/hovi/_native/*.so to src/hovi/_native."
        )


def _git(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)


@contextlib.contextmanager
def checkout_of(before: str) -> Iterator[Path]:
    """The checkout that is named by its path, or one of a commit in a temporary folder."""
    if (Path(before) / "src" / "hovi").is_dir():
        checkout = Path(before).resolve()
        require_compiled(checkout)
        yield checkout
        return
    commit = _git("rev-parse", "--verify", "--quiet", f"{before}^{{commit}}").stdout.strip()
    if not commit:
        sys.exit(f"{before} is neither the path of a checkout of hovi nor a commit of {ROOT}.")
    if _git("diff", "--quiet", commit, "--", "src/cpp").returncode != 0:
        sys.exit(
            f"The C++ sources of {before} are others than those here: build it in a checkout of "
            "its own, as .github/CONTRIBUTING.md says, and give its path."
        )
    require_compiled(ROOT)
    with tempfile.TemporaryDirectory(prefix="hovi-before-") as folder:
        archive = subprocess.run(
            ["git", "archive", commit], cwd=ROOT, capture_output=True, check=True
        )
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
        for module in compiled_modules(ROOT):
            link = Path(folder) / "src" / "hovi" / "_native" / module.name
            link.symlink_to(module.resolve())
        yield Path(folder)


# Measuring


@dataclass
class Lane:
    """Workers of both checkouts, of which one runs at a time."""

    before: Worker | None
    after: Worker

    def end(self) -> None:
        """End both."""
        for worker in (self.before, self.after):
            if worker is not None:
                worker.end()


@dataclass
class Measurement:
    """Rows of both checkouts; before: of a saved measurement where one is loaded."""

    seed: int
    known: Rows
    before: Rows = field(default_factory=dict)
    after: Rows = field(default_factory=dict)

    def add(self, lane: Lane, group: dict[str, Any], number: int) -> None:
        """Run a group with both checkouts in turn; the second one begins in every other group."""
        kind, found = group["kind"], {}
        order = ("before", "after") if number % 2 == 0 else ("after", "before")
        if lane.before is None:
            old = self.known.get(kind, {})
            found["before"] = {name: old[name] for name in group["names"] if name in old}
            order = ("after",)
        for side in order:
            judged = {
                name: [[row["bits"], row["cost"]], row["denied"]]
                for rows in found.values()
                for name, row in rows.items()
                if row["success"]
            }
            worker = lane.before if side == "before" else lane.after
            assert worker is not None
            found[side] = worker.run(group, self.seed, judged)
        for side, rows in found.items():
            _merge(getattr(self, side).setdefault(kind, {}), rows)


def _merge(rows: dict[str, Row], more: dict[str, Row]) -> None:
    """Add rows; of those that are known the faster measurement is kept."""
    for name, row in more.items():
        old = rows.get(name)
        calls = row.get("calls") or (old or {}).get("calls")
        if old is None or (relative_time(row) or np.inf) < (relative_time(old) or np.inf):
            rows[name] = row | {"calls": calls}


def relative_time(row: Row) -> float | None:
    """Processor time next to that of the kernel; what is shorter than it counts as LEAST_TIME."""
    if row["seconds"] is None:
        return None
    return max(float(row["seconds"] / row["kernel"]), LEAST_TIME)


def measured(lanes: list[Lane], groups: list[dict[str, Any]], into: Measurement) -> None:
    """Run groups on all lanes."""
    free: queue.Queue[Lane] = queue.Queue()
    for lane in lanes:
        free.put(lane)
    lock, done = threading.Lock(), [0]

    def work(number: int, group: dict[str, Any]) -> None:
        lane = free.get()
        try:
            into.add(lane, group, number)
        finally:
            free.put(lane)
        with lock:
            done[0] += 1
            words = f"{done[0]} of {len(groups)} groups, {group['kind']}: {group['name']}"
            print(words, file=sys.stderr, flush=True)

    with ThreadPoolExecutor(len(lanes)) as pool:
        try:
            for future in [pool.submit(work, *each) for each in enumerate(groups)]:
                future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for lane in lanes:
                lane.end()
            raise


# Verdicts


@dataclass(frozen=True)
class Verdict:
    """What became of a class of problems: its row of the table, and why it does not pass.

    faults: by what is wrong, the problems. notes: what is not wrong.
    """

    kind: str
    cells: tuple[str, ...]
    faults: dict[str, list[str]]
    notes: dict[str, list[str]]

    @property
    def passes(self) -> bool:
        """Whether nothing is against it."""
        return not self.faults


COLUMNS = [
    *("class", "problems", "successes", "false", "lost", "new", "cost: median, most"),
    *("steps: median, all", "kernel points", "calls", "time: median, all", "same bits", ""),
]


def verdict(kind: str, before: dict[str, Row], after: dict[str, Row], bits: bool) -> Verdict:
    """The verdict on a class by the rows of both checkouts, by name."""
    names = list(dict.fromkeys([*before, *after]))
    pairs = [(before[name], after[name]) for name in names if name in before and name in after]
    false = [row for row in after.values() if row["success"] and row["denied"]]
    lost = [
        name
        for name, row in before.items()
        if row["success"] and not row["denied"] and not after.get(name, {}).get("success")
    ]
    new = [
        name
        for name, row in after.items()
        if row["success"] and not before.get(name, {}).get("success")
    ]
    both = [(x, y) for x, y in pairs if x["success"] and y["success"]]
    steps = Ratios.of(both, lambda row: None if row["nit"] is None else max(row["nit"], 1))
    times = Ratios.of(pairs, relative_time)
    costs = Ratios.of(both, lambda row: row["cost"] and float.fromhex(row["cost"]))
    other = [y["name"] for x, y in pairs if not same_bits(x, y)]
    other += [name for name in names if name not in before or name not in after]
    faults = {
        "nothing measured": [] if pairs else [""],
        "false success": [f"{row['name']} ({row['denied']})" for row in false],
        "lost success": [f"{name} ({after.get(name, {}).get('status')})" for name in lost],
        f"steps {steps.median:.3f} in the median": [""] if steps.median > MAX_STEPS else [],
        f"time {times.median:.2f} in the median": [""] if times.median > MAX_TIME else [],
        f"time {times.total:.2f} in all": [""] if times.total > MAX_TIME else [],
        "other bits": other if bits else [],
    }
    cells = (
        kind,
        str(len(names)),
        f"{_successes(before)}, {_successes(after)}",
        f"{len(false)}",
        f"{len(lost)}",
        f"{len(new)}",
        costs.words(".4f", most=True),
        steps.words(".3f"),
        Ratios.of(pairs, lambda row: row["points"]).words(".3f", only_total=True),
        Ratios.of(pairs, lambda row: row["calls"]).words(".3f", only_total=True),
        times.words(".2f"),
        f"{len(names) - len(other)}",
    )
    return Verdict(kind, cells, {k: v for k, v in faults.items() if v}, {"new success": new})


def _successes(rows: dict[str, Row]) -> int:
    return sum(bool(row["success"]) for row in rows.values())


def same_bits(x: Row, y: Row) -> bool:
    """Whether status, steps, cost and motion are the same."""
    return all(x[key] == y[key] for key in ("status", "nit", "cost", "bits"))


@dataclass(frozen=True)
class Ratios:
    """Ratios of a figure after and before, over problems."""

    each: Sequence[float]
    total: float

    @classmethod
    def of(cls, pairs: Sequence[tuple[Row, Row]], figure: Any) -> Ratios:
        """Over pairs in which both have the figure."""
        known = [(figure(x), figure(y)) for x, y in pairs]
        known = [(x, y) for x, y in known if x is not None and y is not None]
        each = [y / x for x, y in known if x]
        old = sum(x for x, _ in known)
        return cls(each, sum(y for _, y in known) / old if old else np.nan)

    @property
    def median(self) -> float:
        """NaN without any."""
        return float(np.median(self.each)) if self.each else np.nan

    def words(self, form: str, most: bool = False, only_total: bool = False) -> str:
        """The median and the ratio of the sums, or the largest; "-" without any."""
        if not self.each:
            return "-"
        last = max(self.each) if most else self.total
        return f"{last:{form}}" if only_total else f"{self.median:{form}}, {last:{form}}"


def slower(rows: Measurement, kind: str) -> set[str]:
    """Problems of a class that take more than they may."""
    before, after = rows.before.get(kind, {}), rows.after.get(kind, {})
    pairs = [(before[name], after[name]) for name in before if name in after]
    return {
        y["name"]
        for x, y in pairs
        if x["seconds"] and y["seconds"] and relative_time(y) > MAX_TIME * relative_time(x)
    }


def report(rows: Measurement, kinds: Sequence[str], bits: bool, sizes: Sequence[int]) -> bool:
    """Print the table and every fault; returns whether all classes pass."""
    verdicts = [
        verdict(kind, rows.before.get(kind, {}), rows.after.get(kind, {}), bits) for kind in kinds
    ]
    print_table(COLUMNS, [[*v.cells, "passes" if v.passes else "**fails**"] for v in verdicts])
    for each in verdicts:
        for fault, names in (each.faults | each.notes).items():
            if names:
                shown = ", ".join(filter(None, names[:SHOWN]))
                more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
                print(f"- {each.kind}: {fault}{': ' if shown else ''}{shown}{more}")
    pairs = [
        (x, rows.after[kind][name])
        for kind in kinds
        for name, x in rows.before.get(kind, {}).items()
        if name in rows.after.get(kind, {})
    ]
    kernel = Ratios.of(pairs, lambda row: row["kernel"])
    old, new = (f"{size:,}" if size else "-" for size in sizes)
    print(f"\nStatements that solve: {old} before, {new} after. ", end="")
    print(f"The kernel itself takes {kernel.median:.2f} times what it took.\n")
    print_machine(threads=1)
    bad = [each.kind for each in verdicts if not each.passes]
    print(f"Fails: {', '.join(bad)}." if bad else "All classes pass.")
    return not bad


# The command


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The options of the command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("before", nargs="?", help="path of a checkout, or a commit")
    parser.add_argument("--after", type=Path, default=ROOT, help="another checkout than this one")
    parser.add_argument("--only", nargs="+", choices=KINDS, metavar="CLASS", default=KINDS)
    parser.add_argument("--quick", action="store_true", help="a few problems of each class")
    parser.add_argument("--bits", action="store_true", help="require the same bits")
    parser.add_argument("--seed", type=int, default=0, help="of the random problems")
    parser.add_argument("--jobs", type=int, default=2, help="number of problems at a time")
    parser.add_argument("--save", type=Path, help="file for the results of BEFORE")
    parser.add_argument("--load", type=Path, help="file with the results of BEFORE")
    given = parser.parse_args(arguments)
    if (given.before is None) == (given.load is None):
        parser.error("give BEFORE, the path of a checkout or a commit, or --load FILE.")
    if given.jobs < 1:
        parser.error(f"--jobs must be at least 1, got {given.jobs}.")
    if given.save is not None and not given.save.resolve().parent.is_dir():
        parser.error(f"--save needs a file in a folder that exists, got {given.save}.")
    return given


def loaded(given: argparse.Namespace) -> dict[str, Any]:
    """The saved results; those of other problems are refused."""
    try:
        saved: dict[str, Any] = json.loads(given.load.read_text())
    except (OSError, ValueError) as error:
        sys.exit(f"{given.load} cannot be read as a measurement that --save wrote: {error}.")
    if not isinstance(saved, dict) or not {"seed", "quick", "rows"} <= saved.keys():
        sys.exit(f"{given.load} is no measurement that --save wrote: give another file.")
    for key in ("seed", "quick"):
        if saved[key] != getattr(given, key):
            sys.exit(f"{given.load} was measured with another --{key}: {saved[key]}.")
    missing = [kind for kind in given.only if kind not in saved["rows"]]
    if missing:
        sys.exit(f"{given.load} lacks the classes {', '.join(missing)}: leave them out by --only.")
    return saved


def compared(given: argparse.Namespace, before: Path | None, saved: dict[str, Any]) -> bool:
    """Measure both checkouts and report."""
    after = given.after.resolve()
    require_compiled(after)
    known: Rows = saved.get("rows", {})
    with tempfile.TemporaryDirectory(prefix="hovi-logs-") as folder:
        lanes = [
            Lane(
                before and Worker(before, Path(folder) / f"before-{i}"),
                Worker(after, Path(folder) / f"after-{i}"),
            )
            for i in range(given.jobs)
        ]
        rows, interrupted = Measurement(given.seed, known), False
        try:
            groups = lanes[0].after.groups(given.only, given.quick)
            measured(lanes, groups, rows)
            for _ in range(AGAIN):
                measured(lanes, _to_repeat(rows, groups), rows)
        except KeyboardInterrupt:
            interrupted = True
            print("Interrupted: what follows is of the problems so far.\n")
        finally:
            for lane in lanes:
                lane.end()
    size = saved.get("statements") if before is None else solving_statements(before)
    if given.save is not None:
        table = {"seed": given.seed, "quick": given.quick, "statements": size}
        given.save.write_text(json.dumps(table | {"before": given.before, "rows": rows.before}))
    passes = report(rows, given.only, given.bits, [size or 0, solving_statements(after)])
    return passes and not interrupted


def _to_repeat(rows: Measurement, groups: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Groups with problems that are slower, of classes that fail by time alone."""
    wanted = []
    for kind in dict.fromkeys(group["kind"] for group in groups):
        found = verdict(kind, rows.before.get(kind, {}), rows.after.get(kind, {}), bits=False)
        if found.faults and all(fault.startswith("time") for fault in found.faults):
            slow = slower(rows, kind)
            own = [group for group in groups if group["kind"] == kind]
            wanted += [
                group | {"names": group["names"], "profiled": False}
                for group in own
                if slow & set(group["names"])
            ]
    return wanted


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare two checkouts."""
    given = parsed(arguments)
    if given.load is not None:
        passes = compared(given, None, loaded(given))
    else:
        with checkout_of(given.before) as before:
            passes = compared(given, before, {})
    sys.exit(0 if passes else 1)


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):  # in the background, too
        signal.signal(number, signal.default_int_handler)
    main()
