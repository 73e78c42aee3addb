"""Hard cases: what a literal implementation of the paper does on each, what hovi does, and the bar.

The cases are those of tests/hard, which are run here together with what breaks on them. With the
word `long` those that take minutes: a million steps, 100,000 intervals, thirty links.
"""

from __future__ import annotations

import importlib
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

from measuring import print_machine
from threadpoolctl import threadpool_limits

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "hard"), str(TESTS)]


def families() -> dict[str, list[Any]]:
    """The cases of every file of tests/hard, in the order of their numbers."""
    found = {}
    for path in TESTS.glob("hard/test_*.py"):
        cases = getattr(importlib.import_module(path.stem), "CASES", ())
        if cases:
            found[path.stem.removeprefix("test_").replace("_", " ")] = list(cases)
    return dict(sorted(found.items(), key=lambda item: _place(item[1][0].number)))


def _place(number: str) -> int:
    return int("".join(c for c in number if c.isdigit()))


def row(case: Any) -> tuple[bool, list[str]]:
    """Whether a case is as it should be, and its row of the table."""
    print(f"{case.number}: {case.claim}", file=sys.stderr, flush=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        naive = _attempted(case.naive)
    began = time.perf_counter()
    try:
        outcome = case.run()
        shown, passed = outcome.shown, outcome.passed
    except Exception as error:
        traceback.print_exc()
        shown, passed = f"{type(error).__name__}: {error}", False
    seconds = time.perf_counter() - began
    word = "pass" if passed else "**fail**"
    if case.known_failure and not passed:
        word = f"known failure: {case.known_failure}"
    cells = [case.number, case.claim, naive, shown, case.bar, word, f"{seconds:.2g}"]
    return passed or bool(case.known_failure), [cell.replace("|", "\\|") for cell in cells]


def _attempted(work: Any) -> str:
    """What a literal implementation does, which may well be an exception."""
    try:
        return str(work())
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def main() -> None:
    long = "long" in sys.argv[1:]
    good = True
    columns = ["case", "claim", "a literal implementation", "hovi", "the bar", "", "s"]
    with threadpool_limits(1):
        for family, cases in families().items():
            rows = [row(case) for case in cases if case.long == long]
            if not rows:
                continue
            good = good and all(fine for fine, _ in rows)
            print(f"**{family.capitalize()}**\n")
            print("| " + " | ".join(columns) + " |")
            print("|" + "---|" * (len(columns) - 1) + "---:|")
            for _, cells in rows:
                print("| " + " | ".join(cells) + " |")
            print(flush=True)
    print_machine(threads=1)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
