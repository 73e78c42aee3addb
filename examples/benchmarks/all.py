"""Run every benchmark, one after the other, and write their output into the docs.

Each script prints Markdown; it goes to docs/tables/<name>.md, from which the docs include it. The
table of swing_up goes into the README as well, between two comments that name it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
TOP = HERE.parents[1]
TABLES = TOP / "docs" / "tables"
SCRIPTS = (
    "swing_up",
    "regularity",
    "orders",
    "kernel",
    "scenes",
    "replanning",
    "limited_replanning",
    "free_duration",
    "dimensions",
    "peers",
    "general_costs",
    "work_precision",
    "limits",
    "limited_reaches",
    "chains",
    "obstacles",
    "effects",
    "random_reaches",
    "fuzz",
    "hard_cases",
    "underactuated",
    "growth",
    "starting",
    "tolerance",
    "example_robots",
    "manifold_points",
    "inverse_kinematics",
    "pages",
)

PEER = [f"--peer={os.environ['TASKS_PEER']}"] if "TASKS_PEER" in os.environ else []
"""The Python of an environment with OMPL and TOPP-RA, next to which tasks are planned."""

LONG = {
    "tasks": ("tasks.py", *PEER),
    "receding_noise": ("receding_noise.py",),
    "rules": ("rules.py", "--full"),
    "numbers": ("steering_numbers.py",),
    "kkt_factors": ("kkt_factors.py",),
    "self_collision": ("self_collision.py", "--count", "12"),
    "hard_cases_long": ("hard_cases.py", "long"),
    "methods": ("limits.py", "--methods"),
    "limited_reaches_ipopt": ("limited_reaches.py", "--ipopt"),
    "limited_reaches_rotors": ("limited_reaches.py", "kinova", "xarm7", "--armature", "0.1"),
}
"""Benchmarks that are run only when named: script and arguments."""


def run(name: str) -> None:
    """Run one benchmark and write its table; a failure ends the program."""
    began = time.perf_counter()
    print(f"{name} ...", file=sys.stderr, flush=True)
    script, *words = LONG.get(name, (f"{name}.py",))
    command = [sys.executable, str(HERE / script), *words]
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    text = done.stdout.decode().rstrip() + "\n"
    (TABLES / f"{name}.md").write_text(text)
    _into_readme(name, text)
    print(f"{name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)


def _into_readme(name: str, table: str) -> None:
    readme = TOP / "README.md"
    first, last = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
    text = readme.read_text()
    if first in text:
        before, rest = text.split(first, 1)
        readme.write_text(f"{before}{first}\n{table}\n{last}{rest.split(last, 1)[1]}")


def main() -> None:
    for name in sys.argv[1:] or SCRIPTS:
        run(name)


if __name__ == "__main__":
    main()
