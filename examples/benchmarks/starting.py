"""Processor time of whole processes: how soon `hovi plan` answers, and what its parts take.

The time is that of a process from its start to its exit, as the operating system counts it, of user
and system together. Modules are compiled to bytecode before, as an installation does.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile

import numpy as np
from measuring import print_machine, print_table

RUNS = 10
COMMANDS = {
    "Python": ["-c", "pass"],
    "`import numpy, pinocchio`": ["-c", "import numpy, pinocchio"],
    "`hovi --version`": ["-m", "hovi", "--version"],
    "`import hovi; hovi.plan`": ["-c", "import hovi; hovi.plan"],
    "`hovi plan two_link_reach`": ["-m", "hovi", "plan", "two_link_reach"],
    "`hovi plan ur5_reach`": ["-m", "hovi", "plan", "ur5_reach"],
    "`hovi plan panda_lift`": ["-m", "hovi", "plan", "panda_lift"],
}


def seconds(arguments: list[str], environment: dict[str, str]) -> float:
    """Processor time of one process, in [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], capture_output=True, check=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    rows = []
    with tempfile.TemporaryDirectory() as bytecode:
        environment = os.environ | one_thread | {"PYTHONPYCACHEPREFIX": bytecode}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for name, arguments in COMMANDS.items():
            seconds(arguments, environment)
            times = [seconds(arguments, environment) for _ in range(RUNS)]
            rows.append([name, f"{np.median(times):.2f}", f"{min(times):.2f}"])
    print_machine()
    print_table(["process", "median [s]", f"least of {RUNS} [s]"], rows)


if __name__ == "__main__":
    main()
