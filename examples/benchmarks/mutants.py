"""Mutation testing: how many small faults in the modules that hovi's claims rest on are noticed.

    python examples/benchmarks/mutants.py --map        # which test runs which line (10 minutes)
    python examples/benchmarks/mutants.py              # 300 mutants by the seed, and the table
    python examples/benchmarks/mutants.py --again      # the survivors again, with other tests
    python examples/benchmarks/mutants.py --solving --black-box    # what claims of motions notice

With --solving faults are drawn from all code that solves, in optimize and planning. With
--black-box only tests run whose files import nothing of the inside of the solver, so that they
would stay as they are if it was written anew.

Faults are drawn at random from all mutations of `mutations.py`. Each is put into a copy of the
tree, in which the tests that run the changed statement run, the cheapest of every test file first,
until one fails; what they pass is checked by `mypy --strict`, which is part of CI too. A mutant
that takes far longer than its tests do is noticed as well. Results are kept in the folder --work,
next to the copy; the checkout is never changed.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from random import Random

from measuring import print_table
from mutations import Mutation, is_fault, mutations_of

ROOT = Path(__file__).resolve().parents[2]
SEED, COUNT = 17, 300
STARTUP, SLOWDOWN = 60.0, 10.0
"""A mutant times out after STARTUP [s] and SLOWDOWN times what its tests took for the map, of the
processor's time and not of a clock's, which on a shared machine would notice what is no fault."""
UNKNOWN = 60.0
"""Time that a file of tests outside the map is expected to take, in [s]."""
NO_IMPORT = r"^(ERROR tests/|ImportError while loading conftest)"
"""What pytest says where a module raises when it is imported."""
IDLE = 30.0
"""Ratio of a clock's time to the processor's after which tests are taken to wait for each other."""
PARTS = {
    "status, solver": ["planning/solver/*", "planning/solver/methods/*"],
    "limits, clearance": ["planning/problem/limit*", "planning/clearance/*"],
    "problem": ["planning/problem/*"],
    "refinement, certificate": ["planning/refinement/*"],
    "search": ["planning/search/*"],
    "optimiser": ["optimize/*"],
    "schemes": ["schemes/*"],
    "Lagrangians": ["scene/*", "discrete/discrete_lagrangian", "discrete/contraction"],
    "effects": ["effects/*", "effects/expressions/*"],
    "trajectories, files": ["discrete/*"],
}
"""Parts of the table and their modules; a module belongs to the first part that names it."""
SOLVING = {
    part: patterns
    for part, patterns in (PARTS | {"the rest of planning": ["planning/**/*"]}).items()
    if patterns[0].startswith(("planning/", "optimize/"))
}
"""The same for all code that solves."""
INSIDE = r"^\s*(?:from|import) hovi\.(?:optimize|planning\.(?:solver|refinement|search))\b"
"""An import of the inside of the solver."""


@dataclass(frozen=True)
class Mutant:
    """A mutation of a module, given by its path below src/hovi."""

    number: int
    part: str
    path: str
    mutation: Mutation


def black_box_files() -> list[str]:
    """The test files that import nothing of the inside of the solver."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    outside = (f for f in files if not re.search(INSIDE, f.read_text(), re.MULTILINE))
    return [str(file.relative_to(ROOT)) for file in outside]


def modules(of: dict[str, list[str]]) -> dict[str, str]:
    """The part of every module, by its path below src/hovi."""
    parts: dict[str, str] = {}
    package = ROOT / "src/hovi"
    for part, patterns in of.items():
        for pattern in patterns:
            for file in sorted(package.glob(f"{pattern}.py")):
                if file.name != "__init__.py" or pattern.startswith("schemes"):
                    parts.setdefault(str(file.relative_to(package)), part)
    return parts


def drawn(seed: int, count: int, of: dict[str, list[str]]) -> list[Mutant]:
    """Random mutants of all modules of some parts, each mutation with the same probability."""
    part = modules(of)
    sources = {path: (ROOT / "src/hovi" / path).read_text() for path in sorted(part)}
    everything = [
        (part[path], path, mutation)
        for path, source in sources.items()
        for mutation in mutations_of(source)
    ]
    shuffled = iter(Random(seed).sample(everything, len(everything)))
    faults = (each for each in shuffled if is_fault(each[2], sources[each[1]]))
    chosen = [*itertools.islice(faults, count)]
    print(f"{count} of {len(everything)} mutations, seed {seed}", flush=True)
    return [Mutant(number, *each) for number, each in enumerate(chosen)]


# The copy of the tree


def copied(folder: Path) -> Path:
    """A fresh copy of the tree with its compiled modules; returns its path."""
    tree = folder / "tree"
    shutil.rmtree(tree, ignore_errors=True)
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout.decode()
    compiled = (ROOT / "src/hovi/_native").glob("*.so")
    names = [*filter(None, listed.split("\0")), *(str(p.relative_to(ROOT)) for p in compiled)]
    for name in names:
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, tree / name)
    return tree


def environment(tree: Path) -> dict[str, str]:
    more = os.environ.get("PYTHONPATH", "")
    one = {"OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    return os.environ | one | {"PYTHONPATH": f"{tree / 'src'}:{more}"}


def record_map(folder: Path, arguments: list[str]) -> None:
    """Run the suite once with the coverage of every test, and keep their durations."""
    tree = copied(folder)
    log, data = folder / "map.log", folder / "map.data"
    settings = folder / "coveragerc"
    settings.write_text(f"[run]\nsource = hovi\ndata_file = {data}\n")
    command = [sys.executable, "-m", "pytest", "-vv", "--durations=0", "--durations-min=0"]
    command += ["--cov=hovi", f"--cov-config={settings}", "--cov-context=test", "--cov-report="]
    with log.open("w") as output:
        subprocess.run(
            [*command, *arguments], cwd=tree, env=environment(tree), stdout=output, check=False
        )


# Which tests run a statement


class TestMap:
    """The tests that run each line, and how long each test takes."""

    __test__ = False

    def __init__(self, folder: Path, files: list[str] | None) -> None:
        """files: the only ones whose tests count; None for all."""
        from coverage import CoverageData

        self.files = files
        self.seconds: dict[str, float] = defaultdict(float)
        for log in folder.glob("*.log"):
            for line in log.read_text().splitlines():
                took = re.match(r"\s*([\d.]+)s (?:call|setup)\s+(\S.*)", line)
                if took and self._counts(took[2]):
                    self.seconds[took[2].strip()] += float(took[1])
        self.tests: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        for file in folder.glob("*.data"):
            data = CoverageData(str(file))
            data.read()
            for source in data.measured_files():
                _, _, name = source.partition("/src/hovi/")
                for line, contexts in data.contexts_by_lineno(source).items():
                    self.tests[name][line] |= {c.partition("|")[0] for c in contexts if c}

    def _counts(self, test: str) -> bool:
        return self.files is None or test.strip().partition("::")[0] in self.files

    def of(self, mutant: Mutant) -> list[str]:
        """The tests of a mutated statement, cheapest of every test file first."""
        mutation = mutant.mutation
        lines = self.tests[mutant.path]
        found = set().union(*(lines[i] for i in range(mutation.line, mutation.last + 1)))
        if not found and mutation.name:  # run when the module is imported: where the name is used
            found = self.users(mutation.name)
        if not found:
            found = set().union(*lines.values())
        return self.unmapped(mutant.path) + self.ordered(found & self.seconds.keys(), mutant.path)

    def unmapped(self, path: str) -> list[str]:
        """The module's own test file, or its folder of tests, where the map has none of them."""
        own = Path("tests") / Path(path).with_name(f"test_{Path(path).stem}.py")
        name = str(own if (ROOT / own).exists() else own.parent)
        mapped = any(test.startswith(name) for test in self.seconds)
        if mapped or not (ROOT / name).exists():
            return []
        return [name] if self.files is None else [f for f in self.files if f.startswith(name)]

    def users(self, name: str) -> set[str]:
        """The tests of all lines that contain a name."""
        found: set[str] = set()
        for path, lines in self.tests.items():
            text = self.sources.get(path, [])
            for number, tests in lines.items():
                if number <= len(text) and re.search(rf"\b{name}\b", text[number - 1]):
                    found |= tests
        return found

    @cached_property
    def sources(self) -> dict[str, list[str]]:
        package = ROOT / "src/hovi"
        files = ((path, package / path) for path in self.tests)
        return {path: file.read_text().splitlines() for path, file in files if file.exists()}

    def ordered(self, tests: set[str], path: str) -> list[str]:
        """Those of the module's own test file first, then one of each file in turn by duration."""
        own = "tests/" + str(Path(path).with_name(f"test_{Path(path).stem}.py"))
        by_file: dict[str, list[str]] = defaultdict(list)
        for test in sorted(tests, key=lambda t: self.seconds[t]):
            by_file[test.partition("::")[0]].append(test)
        rank = [
            (file != own and 3 * i, self.seconds[test], test)
            for file, members in by_file.items()
            for i, test in enumerate(members)
        ]
        return [test for *_, test in sorted(rank)]


# Running a mutant


def preload() -> None:
    """Import what tests need besides hovi, once: each mutant is a fork of this process."""
    import casadi  # noqa: F401
    import hypothesis  # noqa: F401
    import pinocchio  # noqa: F401
    import pytest  # noqa: F401
    import scipy.integrate
    import scipy.linalg
    import scipy.optimize  # noqa: F401

    assert "hovi" not in sys.modules, "the tests would not import it from the copy of the tree"


def tested(tree: Path, tests: list[str], limit: float, log: Path) -> str:
    """What the tests say: "passed", "failed" or "timeout"."""
    arguments = log.with_suffix(".tests")
    arguments.write_text("\n".join(tests))
    pid = os.fork()
    if pid == 0:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit)))
        _run_tests(tree, arguments, log)
    try:
        return _awaited(pid, time.monotonic() + IDLE * limit, log)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)


def _awaited(pid: int, end: float, log: Path) -> str:
    """How the tests in a process ended, by its code."""
    while time.monotonic() < end:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            if code in (-signal.SIGXCPU, -signal.SIGKILL):
                return "timeout"
            if code > 2 and not re.search(NO_IMPORT, log.read_text(), re.MULTILINE):
                raise RuntimeError(f"the tests did not run, see {log}")
            return "failed" if code else "passed"
        time.sleep(0.05)
    return "timeout"


def _run_tests(tree: Path, arguments: Path, log: Path) -> None:
    """The tests in this process, which then ends."""
    code = 70
    try:
        os.chdir(tree)
        os.environ |= environment(tree)
        sys.path.insert(0, str(tree / "src"))
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        import pytest

        options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short"]
        options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # for what is preloaded
        code = int(pytest.main([*options, f"@{arguments}"]))
    finally:
        os._exit(code)


def refused_by_types(tree: Path, folder: Path) -> bool:
    command = [sys.executable, "-m", "mypy", "--strict", f"--cache-dir={folder / 'mypy'}"]
    done = subprocess.run([*command, "src/hovi"], cwd=tree, capture_output=True, text=True)
    return done.returncode == 1


def first_failure(log: Path) -> str:
    """The first test that failed, or how the tests ended."""
    text = log.read_text(errors="replace") if log.exists() else ""
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE)
    return found[1] if found else text.strip().splitlines()[-1][:80] if text.strip() else "died"


@dataclass
class Runner:
    """Mutants one after the other in a copy of the tree; results are appended to a file."""

    folder: Path
    tree: Path
    tests: TestMap
    most: int
    seconds: float
    slowdown: float = SLOWDOWN
    types: bool = True

    def run(self, mutant: Mutant) -> dict[str, object]:
        began = time.monotonic()
        file = self.tree / "src/hovi" / mutant.path
        source = file.read_text()
        tests, expected = self.chosen(mutant)
        file.write_text(mutant.mutation.applied(source))
        try:
            by = self.noticed_by(tests, STARTUP + self.slowdown * expected)
        finally:
            file.write_text(source)
        return {
            "number": mutant.number,
            "part": mutant.part,
            "place": f"{mutant.path}:{mutant.mutation.line}",
            "change": mutant.mutation.change,
            "tests": len(tests),
            "by": by,
            "seconds": round(time.monotonic() - began, 1),
        }

    def chosen(self, mutant: Mutant) -> tuple[list[str], float]:
        chosen, total = [], 0.0
        for test in self.tests.of(mutant)[: self.most]:
            took = self.tests.seconds[test] if "::" in test else UNKNOWN
            if chosen and total + took > self.seconds:
                continue
            chosen.append(test)
            total += took
        return chosen, total

    def noticed_by(self, tests: list[str], limit: float) -> str:
        """The first test or tool that notices the fault in the copy; "" for none."""
        log = self.folder / "mutant.out"
        log.unlink(missing_ok=True)
        said = tested(self.tree, tests, limit, log) if tests else "passed"
        if said != "passed":
            return "timeout" if said == "timeout" else first_failure(log)
        if self.types and refused_by_types(self.tree, self.folder):
            return "mypy"
        return ""


def table(results: list[dict[str, object]]) -> None:
    """Mutants and those noticed, part by part, and the survivors."""
    total, noticed = Counter(), Counter()
    for each in results:
        for part in (str(each["part"]), "all"):
            total[part] += 1
            noticed[part] += bool(each["by"])
    names = [part for part in PARTS | SOLVING if total[part]] + ["all"]
    rows = [[p, total[p], noticed[p], f"{100 * noticed[p] / total[p]:.0f} %"] for p in names]
    print_table(["part", "mutants", "noticed", "share"], rows)
    for each in results:
        if not each["by"]:
            print(f"{each['number']}: `{each['place']}`: `{each['change']}`")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "hovi-mutants")
    parser.add_argument("--map", action="store_true", help="record which test runs which line")
    parser.add_argument("--again", action="store_true", help="run the survivors again")
    parser.add_argument("--table", action="store_true", help="only print the results so far")
    parser.add_argument("--solving", action="store_true", help="of all code that solves, alone")
    parser.add_argument("--black-box", action="store_true", help="by tests from outside, alone")
    parser.add_argument("--no-types", action="store_true", help="leave out mypy")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--only", default="", help="those of modules whose path matches this")
    parser.add_argument("--tests", type=int, default=150, help="most tests of a mutant")
    parser.add_argument("--slowdown", type=float, default=SLOWDOWN, help="until a timeout")
    parser.add_argument("--seconds", type=float, default=90.0, help="most time of its tests")
    chosen, more = parser.parse_known_args()
    chosen.work.mkdir(parents=True, exist_ok=True)
    files = black_box_files() if chosen.black_box else None
    if chosen.map:
        record_map(chosen.work, [*more, *(files or [])])
        return
    words = [word for word in ("solving", "black_box") if getattr(chosen, word)]
    record = chosen.work / f"{'-'.join(['results', *words, str(chosen.seed)])}.jsonl"
    lines = record.read_text().splitlines() if record.exists() else []
    results = {each["number"]: each for each in map(json.loads, lines)}
    everything = drawn(chosen.seed, chosen.count, SOLVING if chosen.solving else PARTS)
    mutants = [m for m in everything if re.search(chosen.only, m.path)]
    if not chosen.table:
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        preload()
        tests, types = TestMap(chosen.work, files), not chosen.no_types
        tree = copied(chosen.work)
        runner = Runner(
            chosen.work, tree, tests, chosen.tests, chosen.seconds, chosen.slowdown, types
        )
        for mutant in mutants:
            known = results.get(mutant.number)
            if known is not None and (known["by"] or not chosen.again):
                continue
            result = runner.run(mutant)
            results[mutant.number] = result
            print(f"{result['number']} {result['place']} {result['by'] or 'SURVIVED'}", flush=True)
            with record.open("a") as file:
                file.write(json.dumps(result) + "\n")
    numbers = {mutant.number for mutant in mutants}
    table([results[number] for number in sorted(results) if number in numbers])


if __name__ == "__main__":
    main()
