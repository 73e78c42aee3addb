"""Hard cases: results of a literal implementation of the paper and of hovi, and the requirements.

The cases are those of tests/hard. With the argument `long`, the cases that take minutes: a million
steps, 100,000 intervals, thirty links. They take an hour together, so `--table FILE` writes every
row as soon as it is measured and keeps the others; `--only 3b 22b` selects cases.
"""

from __future__ import annotations

import argparse
import importlib
import itertools
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

from measuring import machine, print_machine
from threadpoolctl import threadpool_limits

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path.insert(0, str(TESTS))


def families(tests: Path = TESTS) -> dict[str, list[Any]]:
    """The cases of every file of tests/hard, in the order of their numbers.

    tests: the folder of tests that Python imports them from.
    """
    found = {}
    for path in tests.glob("hard/test_*.py"):
        if "Case(" not in path.read_text():
            continue
        listed = getattr(importlib.import_module(f"hard.{path.stem}"), "CASES", ())
        if listed:
            found[path.stem.removeprefix("test_").replace("_", " ")] = list(listed)
    return dict(sorted(found.items(), key=lambda item: _case_number(item[1][0].number)))


def require_tests() -> None:
    """Exit with a sentence if a package that the tests need is not installed."""
    try:
        families()
    except ModuleNotFoundError as missing:
        sys.exit(f"The cases are tests, which need {missing.name}; run pip install '.[dev]'.")


def _case_number(number: str) -> int:
    return int("".join(c for c in number if c.isdigit()))


def row(case: Any) -> tuple[bool, list[str]]:
    """Whether a case passes or fails as known, and its row of the table."""
    print(f"{case.number}: {case.claim}", file=sys.stderr, flush=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        naive = _naive_result(case.naive)
    began = time.perf_counter()
    try:
        outcome = case.run()
        shown, passed = outcome.shown, outcome.passed
    except Exception as error:
        traceback.print_exc()
        shown, passed = f"{type(error).__name__}: {error}", False
    seconds = time.perf_counter() - began
    verdict = "pass" if passed else "**fail**"
    if case.known_failure and not passed:
        verdict = f"known failure: {case.known_failure}"
    cells = [case.number, case.claim, naive, shown, case.requirement, verdict, f"{seconds:.2g}"]
    return passed or bool(case.known_failure), [cell.replace("|", "\\|") for cell in cells]


def _naive_result(run_naive: Any) -> str:
    """The result of the literal implementation, which may be an exception."""
    try:
        return str(run_naive())
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def rows_of(path: Path | None) -> dict[str, str]:
    """Rows of an earlier table, by the numbers of their cases."""
    if path is None or not path.exists():
        return {}
    lines = (line for line in path.read_text().splitlines() if line.startswith("| "))
    return {line.split("|")[1].strip(): line for line in lines}


def table(rows: dict[str, str]) -> str:
    """The existing rows, by family and in order."""
    columns = ["case", "claim", "a literal implementation", "hovi", "requirement", "", "s"]
    head = ["| " + " | ".join(columns) + " |", "|" + "---|" * (len(columns) - 1) + "---:|"]
    parts = []
    for family, cases in families().items():
        lines = [rows[case.number] for case in cases if case.number in rows]
        if lines:
            parts.append("\n".join([f"**{family.capitalize()}**\n", *head, *lines]))
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("long", nargs="?", choices=["long"], help="the cases that take minutes")
    parser.add_argument("--only", nargs="+", metavar="NUMBER", help="these cases")
    parser.add_argument("--table", type=Path, metavar="FILE", help="file of the table")
    given = parser.parse_args()
    require_tests()
    good, rows = True, rows_of(given.table)
    with threadpool_limits(1):
        for case in itertools.chain(*families().values()):
            if case.long != bool(given.long) or case.number not in (given.only or [case.number]):
                continue
            fine, cells = row(case)
            good, rows[case.number] = good and fine, "| " + " | ".join(cells) + " |"
            if given.table is not None:
                given.table.write_text(f"{table(rows)}\n\n{machine(threads=1)}\n")
    print(f"{table(rows)}\n")
    print_machine(threads=1)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
