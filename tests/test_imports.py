"""What a first plan imports: not what it does not use, which takes a quarter of a second."""

from __future__ import annotations

import subprocess
import sys

FIRST_PLAN = """
import sys
import hovi
solution = hovi.plan_task(hovi.load_task(hovi.example("two_link_reach")))
assert solution.success
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def test_a_first_plan_imports_nothing_that_it_does_not_use() -> None:
    run = [sys.executable, "-c", FIRST_PLAN]
    loaded = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    assert "pinocchio" in loaded
    assert not {"scipy", "joblib", "matplotlib", "meshcat", "typer"} & set(loaded)


def test_a_report_in_the_terminal_draws_nothing() -> None:
    code = "import sys, hovi.cli.reports.plan; print(*sys.modules)"
    run = [sys.executable, "-c", code]
    loaded = subprocess.run(run, capture_output=True, text=True, check=True).stdout.split()
    assert "hovi.cli.reports.plan" in loaded
    assert not {"matplotlib", "meshcat", "scipy"} & set(loaded)
