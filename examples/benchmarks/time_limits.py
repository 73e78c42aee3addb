"""Time limits on hostile scenes: how long `hovi plan` really takes under --time-limit.

A duration in milliseconds, a million intervals, a million starts, tolerances out of reach:
each scene is planned in a process of its own, with the certificate. Its time includes the start of
the process, which is measured next to it.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from measuring import print_machine, print_table

LIMIT = 5.0
"""The limit, in [s]."""
PATIENCE = 60.0
"""Time after which a plan is killed, in [s]."""
ARM = """
robot = "{robot}"
duration = {duration}
{keys}
[start]
q = {start}
[goal]
{goal}
[effects.gravity]
acceleration = 9.81
{tables}
"""
MODELS = Path(__file__).resolve().parents[2] / "models"
TWO_LINK = {"robot": f"{MODELS}/two_link.urdf", "start": [-1.57, 0.0], "goal": "q = [1.57, 0.3]"}
UR5 = {
    "robot": "ur5",
    "start": [0.0, -1.2, 1.2, -0.5, 0.3, 0.1],
    "goal": "q = [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]",
}
AROUND = {**UR5, "goal": "q = [1.8, -1.0, 1.4, -0.5, 0.3, 0.1]"}
HAND = {**UR5, "goal": 'frame = "tool0"\nposition = [0.45, 0.25, 0.25]'}
NO_LIMITS = 'limits = "none"'
BALL = (
    "obstacles = [{ kind = 'sphere', position = [0.05, 0.35, 0.25], radius = 0.1 }]\n"
    "self_collision = true"
)
GRID = "[scheme]\nname = 'galerkin-2'\nintervals = {}"
SCENES: dict[str, dict[str, object]] = {
    "two links, milliseconds meant": TWO_LINK | {"duration": 2000.0, "keys": NO_LIMITS},
    "ur5, milliseconds meant": UR5 | {"duration": 2000.0},
    "ur5, milliseconds meant, on 16 intervals": UR5
    | {"duration": 2000.0, "keys": NO_LIMITS, "tables": GRID.format(16)},
    "two links, 2,000 intervals of 1 s": TWO_LINK
    | {"duration": 2000.0, "keys": NO_LIMITS, "tables": GRID.format(2000)},
    "two links, 1,000,000 intervals": TWO_LINK
    | {"duration": 2.0, "keys": NO_LIMITS, "tables": GRID.format(1_000_000)},
    "ur5, 1,000,000 intervals": UR5
    | {"duration": 2.0, "keys": NO_LIMITS, "tables": GRID.format(1_000_000)},
    "ur5, limits and 1,000,000 intervals": UR5
    | {"duration": 2.0, "tables": GRID.format(1_000_000)},
    "ur5, 20,000 intervals": UR5
    | {"duration": 2.0, "keys": NO_LIMITS, "tables": GRID.format(20_000)},
    "two links, 1,000,000 starts": TWO_LINK
    | {"duration": 8.0, "keys": NO_LIMITS + "\nstarts = 1000000", "tables": GRID.format(40)},
    "ur5, free duration to a tolerance": UR5
    | {"duration": "[0.5, 3.0]", "keys": "tolerance = 1e-12\ntime_weight = 100.0"},
    "two links, free duration up to 2,000 s": TWO_LINK
    | {"duration": "[0.5, 2000.0]", "keys": NO_LIMITS},
    "ur5, obstacles and itself": AROUND | {"duration": 2.0, "keys": BALL},
    "ur5, obstacles on 20,000 intervals": AROUND
    | {"duration": 2.0, "keys": BALL, "tables": GRID.format(20_000)},
    "ur5, pose of the hand on 100,000 intervals": HAND
    | {"duration": 2.0, "keys": NO_LIMITS, "tables": GRID.format(100_000)},
    "ur5, drag in CasADi on 50,000 intervals": UR5
    | {
        "duration": 2.0,
        "keys": NO_LIMITS,
        "tables": "[effects.viscous_friction]\ncoefficient = 1.0\n" + GRID.format(50_000),
    },
}


def scene_text(name: str) -> str:
    """The scene file."""
    values = {"keys": "", "tables": ""} | SCENES[name]
    return ARM.format(**values)


def _start_seconds() -> float:
    """Time of a plan that takes nearly none: what a process needs to start, at today's load."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "hovi", "plan", f"{MODELS}/two_link_reach.toml"]
    subprocess.run(command, capture_output=True, check=True)
    return time.perf_counter() - began


def measured(name: str, limit: float) -> list[str]:
    """A row: scene, limit, times, status and what the certificate lacks."""
    start = f"{_start_seconds():.1f}"
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(scene_text(name))
        out = Path(folder) / "motion.npz"
        command = [sys.executable, "-m", "hovi", "plan", str(scene), "--json", "--out", str(out)]
        began = time.perf_counter()
        process = subprocess.Popen(
            [*command, "--time-limit", str(limit)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            text, error = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.communicate()
            return [name, f"{limit:g}", start, f"> {PATIENCE:g}", "", "", ""]
        seconds = time.perf_counter() - began
    if not text:
        ending = (error.strip().splitlines() or [f"exit {process.returncode}"])[-1]
        return [name, f"{limit:g}", start, f"{seconds:.1f}", "", ending[:90], ""]
    result = json.loads(text)
    certificate = result["certificate"] or {"missing": {}}
    missing = ", ".join(certificate["missing"])
    planning = f"{result['setup_seconds'] + result['solve_seconds']:.1f}"
    return [name, f"{limit:g}", start, f"{seconds:.1f}", planning, result["status"], missing]


def main() -> None:
    """Measure the scenes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", default=list(SCENES), help="Names of scenes.")
    parser.add_argument("--limit", type=float, default=LIMIT, help="In seconds.")
    arguments = parser.parse_args()
    print_machine()
    rows = []
    for name in arguments.only:
        rows.append(measured(name, arguments.limit))
        print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    header = [
        "scene",
        "limit, s",
        "process start, s",
        "took, s",
        "planning, s",
        "status",
        "missing in the certificate",
    ]
    print_table(header, rows)


if __name__ == "__main__":
    main()
