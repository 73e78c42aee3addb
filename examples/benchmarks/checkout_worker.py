"""Shared by side_by_side.py: one process that runs problems with the hovi of one checkout.

Requests and answers are lines of JSON on its standard input and output. It ends when a problem
takes more processor time than it may, or crashes; side_by_side.py starts another one then.
"""

from __future__ import annotations

import cProfile
import hashlib
import json
import math
import os
import pstats
import resource
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

JUDGING = 600.0
"""Processor time that everything but a problem itself may take, in [s]."""
POINTS, REPEATS = 10_000, 3
"""Points of the UR5 kernel whose time is measured next to every problem, and how often."""
KERNELS = {
    "hovi.dynamics.inverse_dynamics_kernel": "InverseDynamicsKernel",
    "hovi.dynamics.mimic_kernel": "MimicKernel",
}
"""Classes whose evaluated points are counted where they exist."""
EVALUATIONS = "torque", "linearize", "expand"


def use(checkout: Path) -> None:
    """Import hovi from the source tree of a checkout, whatever is installed."""
    source = (checkout / "src").resolve()
    sys.meta_path[:] = [each for each in sys.meta_path if not _finds_hovi(each)]
    sys.path[:0] = [str(source)]
    import hovi

    found = Path(str(hovi.__file__)).resolve()
    if source not in found.parents:
        raise SystemExit(f"hovi was imported from {found} and not from {source}.")


def _finds_hovi(finder: Any) -> bool:
    """Whether a finder is that of an editable installation of hovi."""
    tables = ("known_source_files", "known_wheel_files")
    return any("hovi" in (getattr(finder, name, None) or ()) for name in tables)


class Counter:
    """Counts the points at which the kernels are evaluated that are found."""

    def __init__(self) -> None:
        self.points = 0
        for module, name in KERNELS.items():
            try:
                kernel = getattr(__import__(module, fromlist=[name]), name)
            except (ImportError, AttributeError):
                continue
            for method in EVALUATIONS:
                if hasattr(kernel, method):
                    setattr(kernel, method, self._counting(getattr(kernel, method)))

    def _counting(self, evaluate: Callable[..., Any]) -> Callable[..., Any]:
        def counted(kernel: Any, q: Any, *more: Any, **named: Any) -> Any:
            self.points += len(q)
            return evaluate(kernel, q, *more, **named)

        return counted

    def taken(self) -> int | None:
        """The points since the last call; None if there are none, as in other processes."""
        points, self.points = self.points, 0
        return points or None


class Yardstick:
    """The processor time of the UR5 kernel at 10,000 points."""

    def __init__(self) -> None:
        import numpy as np

        import hovi

        scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
        self._lagrangian = scene.effort_lagrangian()
        self._jets = np.random.default_rng(0).uniform(-1, 1, (3, POINTS, 6))

    def seconds(self) -> float:
        """The shortest of a few runs, in [s]."""
        return min(cpu_time(lambda: self._lagrangian.evaluate(*self._jets)) for _ in range(REPEATS))


def processor_time() -> float:
    """Of this process and of all that it has started, ended or not, in [s]."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    living = sum(map(_time_with_children, _children(os.getpid())))
    return time.process_time() + ended.ru_utime + ended.ru_stime + living


def _children(process: int) -> list[int]:
    tasks = Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for each in tasks for child in each.read_text().split()]


def _time_with_children(process: int) -> float:
    """Processor time of another process and of those that it has started, in [s]."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        living = sum(map(_time_with_children, _children(process)))
    except OSError:  # it has just ended
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK") + living


def cpu_time(work: Callable[[], Any]) -> float:
    """Processor time of one call, in [s]."""
    began = processor_time()
    work()
    return processor_time() - began


def allow(seconds: float) -> None:
    """End this process once it has taken some more seconds of processor time."""
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(time.process_time() + seconds), hard))


def digest(motion: Any) -> str:
    """A hash of the arrays of a motion: nodes, their derivatives, inner unknowns and times."""
    path = getattr(motion, "path", None)
    names = ("q", "rates", "z")
    arrays = [getattr(path, name) for name in names if getattr(path, name, None) is not None]
    arrays = [motion.t, *(arrays or [motion.q, motion.v])]
    return hashlib.sha256(b"".join(_bytes(each) for each in arrays)).hexdigest()[:16]


def _bytes(array: Any) -> bytes:
    import numpy as np

    return np.ascontiguousarray(array, dtype=float).tobytes()


class Runner:
    """Runs groups of problems."""

    def __init__(self) -> None:
        self._counter, self._yardstick = Counter(), Yardstick()

    def run(self, request: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Answers to a request: the begin of every case, and its rows.

        request: the `group`, the `seed`, names of cases to `skip`, and what is `known` of some
        motions, by name: a hash and a judgement.
        """
        from compared_problems import Group, cases_of

        group = Group(**request["group"] | {"names": tuple(request["group"]["names"])})
        allow(JUDGING)
        profile = group.profiled
        for case in cases_of(group, request["seed"]):
            if not set(case.names) <= set(request["skip"]):
                yield {"begin": case.names}
                yield from self._rows(case, group.limit, profile, request["known"])
                profile = False
            allow(JUDGING)

    def _rows(self, case: Any, limit: float, profile: bool, known: Any) -> Iterator[dict[str, Any]]:
        before = self._yardstick.seconds()
        self._counter.taken()
        allow(limit)
        began = processor_time()
        try:
            found, fault = case.solve(), None
        except Exception as error:
            found, fault = None, error
        seconds = processor_time() - began
        allow(JUDGING)
        points, after = self._counter.taken(), self._yardstick.seconds()
        shared = {"seconds": seconds, "kernel": min(before, after), "points": points}
        shared |= {"calls": calls_of(case.solve) if profile and fault is None else None}
        if fault is not None:
            said = {"success": False, "status": type(fault).__name__, "message": str(fault)}
            yield from ({"name": name, **said, **shared} for name in case.names)
            return
        outcomes = case.outcomes(found)
        parts = {
            key: None if value is None else value / len(outcomes) for key, value in shared.items()
        }
        for name, each in zip(case.names, outcomes, strict=True):
            row = row_of(name, each, known.get(name), case.judge)
            yield row | (shared if len(outcomes) == 1 else parts | {"kernel": shared["kernel"]})


def row_of(name: str, each: Any, known: Any, judge: Callable[[Any], str]) -> dict[str, Any]:
    """The row of an outcome. known: hash and judgement of a motion that may be the same."""
    has_motion = each.motion is not None
    row = {
        "name": name,
        "success": each.success,
        "status": each.status,
        "message": each.message,
        "nit": each.nit,
        "cost": None if each.cost is None else float(each.cost).hex(),
        "bits": digest(each.motion) if has_motion else each.status,
    }
    if not each.success:
        return row | {"denied": ""}
    if known is not None and known[0] == [row["bits"], row["cost"]]:
        return row | {"denied": known[1]}
    return row | {"denied": judge(each)}


def calls_of(work: Callable[[], Any]) -> int:
    """The number of function calls of some work, of Python's and of compiled ones."""
    profile = cProfile.Profile()
    profile.runcall(work)
    return int(pstats.Stats(profile, stream=sys.stderr).total_calls)


def listed(kinds: list[str], quick: bool) -> list[dict[str, Any]]:
    """The groups of some classes, as JSON-able data."""
    from dataclasses import asdict

    from compared_problems import groups_of

    return [asdict(group) for group in groups_of(kinds, quick)]


def main() -> None:
    """Answer requests until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    use(Path(sys.argv[1]))
    runner = Runner()
    for line in sys.stdin:
        request = json.loads(line)
        if "kinds" in request:
            rows: Any = [{"groups": listed(request["kinds"], request["quick"])}]
        else:
            rows = runner.run(request)
        for row in rows:
            print(json.dumps(row), file=answers, flush=True)
        print(json.dumps({"done": True}), file=answers, flush=True)


if __name__ == "__main__":
    main()
