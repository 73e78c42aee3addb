"""A first motion by hovi and by other libraries: lines, seconds, and what of the limits it keeps.

python first_hour.py hovi=PYTHON pink=PYTHON ...

Each program in `first_motions` moves the tool of the same URDF to the same point, and runs in the
environment of its library. `--install` puts each into a new environment instead.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from measuring import print_table

PROGRAMS = Path(__file__).parent / "first_motions"
PACKAGES = {
    "hovi": [str(PROGRAMS.parents[2])],
    "pink": ["pin-pink", "quadprog"],
    "mink": ["mink", "daqp"],
    "drake": ["drake"],
    "crocoddyl": ["crocoddyl", "pin==4.0.0"],
    "pyroki": [
        "git+https://github.com/brentyi/jaxls.git",
        "git+https://github.com/chungmin99/pyroki.git",
    ],
}
JUDGE = """
import importlib, json, sys, time
sys.path.insert(0, FOLDER)
begin = time.perf_counter()
motion = importlib.import_module("of_" + NAME)
seconds = time.perf_counter() - begin
import numpy as np
from task import GOAL
q, t = np.array(motion.q), np.array(motion.t)
sums = np.cumsum(q[-1, 1:])
links = np.array([0.4, 0.4, 0.12])
out, up = links @ np.cos(sums), 0.3 + links @ np.sin(sums)
tool = np.array([out * np.cos(q[-1, 0]), out * np.sin(q[-1, 0]), up])
v = np.diff(q, axis=0) / np.diff(t)[:, None]
fastest = float((np.abs(v) / [3.0, 2.6, 2.6, 4.0]).max())
low, high = np.array([-2.9, -0.5, -2.6, -2.0]), np.array([2.9, 2.2, 0.2, 2.0])
beyond = float(max(0.0, (low - q).max(), (q - high).max()))
print(json.dumps([seconds, 1e3 * float(np.linalg.norm(tool - GOAL)), fastest, beyond]))
"""
"""Judges a program by closed forms of the arm: seconds, by how much the goal is missed in [mm],
the largest velocity over its limit, and the largest excess of a position in [rad]."""


def lines(name: str) -> int:
    """The lines of a program that are not empty, without its docstring."""
    text = (PROGRAMS / f"of_{name}.py").read_text()
    return sum(bool(line.strip()) for line in text.splitlines()) - 1


def row(name: str, python: str) -> list[str]:
    """What came of a program, run twice: the shorter time."""
    program = JUDGE.replace("FOLDER", repr(str(PROGRAMS))).replace("NAME", repr(name))
    found = []
    for _ in range(2):
        done = subprocess.run([python, "-c", program], capture_output=True, text=True, cwd="/")
        if done.returncode != 0:
            said = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
            return [name, str(lines(name)), f"fails: {said[:80]}", "", "", ""]
        found.append(json.loads(done.stdout.splitlines()[-1]))
    seconds, missed, fastest, beyond = min(found)
    return [
        name,
        str(lines(name)),
        f"{seconds:.1f}",
        f"{missed:.2g}",
        f"{fastest:.2f}",
        f"{beyond:.2g}",
    ]


def installed(name: str, folder: str) -> str:
    """The Python of a new environment with a library, whose seconds and size it prints."""
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python, begin = str(Path(folder) / "bin" / "python"), time.perf_counter()
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES[name]], check=True)
    size = sum(each.stat().st_size for each in Path(folder).rglob("*") if each.is_file())
    print(f"{name}: {time.perf_counter() - begin:.0f} s, {size / 1e6:,.0f} MB", flush=True)
    return python


def main(arguments: list[str]) -> None:
    """Print the table."""
    columns = ["library", "lines", "seconds", "goal missed [mm]", "velocity / limit"]
    columns.append("beyond a position [rad]")
    if arguments == ["--install"]:
        for name in PACKAGES:
            with tempfile.TemporaryDirectory() as folder:
                print_table(columns, [row(name, installed(name, folder))])
        return
    print_table(columns, [row(*each.split("=", 1)) for each in arguments])


if __name__ == "__main__":
    main(sys.argv[1:])
