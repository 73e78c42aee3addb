"""How soon a mistake in a task is reported: twenty tasks, each by a `hovi plan` process of its own.

The processor time is that of the whole process, its start included, until the sentence is printed;
the least of several runs. A plan that goes on after a warning is ended then.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import tomlkit
from measuring import print_machine, print_table

import hovi

RUNS = 3
TICKS = os.sysconf("SC_CLK_TCK")
Q0, Q1 = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
FLAT = [0.0] * 6
HAND = {"frame": "tool0", "position": [0.45, 0.25, 0.25]}
HEAVY = {"gravity": {}, "payload": {"frame": "tool0", "mass": 30.0}}
BALL = {"kind": "sphere", "name": "ball", "radius": 0.1, "position": [1.0, 1.0, 1.0]}
REACH = {"name": "reach", "duration": 1.5, "goal": {"q": Q1}}
CART = {"robot": str(hovi.example("cart_pole.urdf")), "limits": "none", "start": {"q": [0, 0]}}
BODY = {"robot": str(hovi.example("flying_body.urdf")), "free_flyer": True, "limits": "none"}
POSE = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]

MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "a torque at an end above its limit": (
        {"start": {"q": FLAT}, "effects": HEAVY},
        "holding the robot still at the start takes",
    ),
    "a smooth start that no torque holds": (
        {"start": {"q": FLAT}, "effects": HEAVY, "smooth": True},
        "at the start is -299.7 N m",
    ),
    "too little time for a joint": ({"duration": 0.2}, "which takes 0.381 s"),
    "too little time for a frame": (
        {"duration": 0.2, "goal": HAND | {"position": [-0.45, -0.25, 0.25]}},
        "cannot move from the start to the goal within 0.2 s",
    ),
    "too little time for a segment": (
        {"segments": [REACH, {"name": "back", "duration": 0.2, "goal": {"q": Q0}}]},
        "in 'back' joint 'shoulder_pan_joint' has to move by",
    ),
    "angles in degrees": ({"goal": {"q": [60.0, -30, 20, 40, -50, 60]}}, "looks like degrees"),
    "an orientation in degrees": (
        {"goal": HAND | {"rpy": [180.0, 0.0, 90.0]}},
        "rpy = (180, 0, 90) rad looks like degrees",
    ),
    "ranges of joints in degrees": ({"limits": {"q": 170.0}}, "-170 to 170 rad, looks like"),
    "velocities in degrees per second": ({"limits": {"v": 180.0}}, "looks like degrees"),
    "a position in millimetres": (
        {"goal": HAND | {"position": [457.0, 191.0, 300.0]}},
        "looks like millimetres",
    ),
    "an obstacle in millimetres": (
        {"obstacles": [BALL | {"position": [457.0, 191.0, 300.0]}]},
        "away from the robot's base",
    ),
    "the size of an obstacle in millimetres": (
        {"obstacles": [BALL | {"radius": 100.0}]},
        "measures 200 x 200 x 200 m",
    ),
    "a margin in millimetres": ({"obstacles": [BALL], "margin": 10.0}, "looks like millimetres"),
    "more equations than joints": (
        {
            **{"robot": str(hovi.example("two_link.urdf")), "start": {"q": [0.0, 0.0]}},
            "goal": {"frame": "tip", "position": [0.5, 0.5, 0.0], "rpy": [0.0, 0.0, 0.0]},
        },
        "which only 2 joint coordinates move",
    ),
    "a base without motors": (
        BODY | {"start": {"q": POSE}, "goal": {"q": [0.1, *POSE[1:]]}},
        "has no motor that a URDF could name",
    ),
    "gravity that is not named": ({"effects": {}}, "Gravity is left out"),
    "newtons next to newton metres": (
        CART | {"goal": {"q": [0.2, 0.1]}},
        "adds up squares of forces in N",
    ),
    "a goal in an obstacle": (
        {"obstacles": [BALL | {"position": [0.8, 0.19, 0.0]}], "goal": {"q": FLAT}},
        "and obstacle 'ball' overlap by",
    ),
    "a goal in which links overlap": (
        {"self_collision": True, "goal": {"q": [0.0, 0.0, 3.1, 0.0, 0.0, 0.0]}},
        "and link 'wrist_1_link' overlap by",
    ),
    "a joint that does not exist": (
        {"goal": {"q": dict.fromkeys(["elbow", "wrist"], 0.3)}},
        "names joint 'elbow'",
    ),
}
"""What a task changes in one without mistakes, and a part of its sentence."""


def task(changes: dict[str, Any]) -> dict[str, Any]:
    """A task of a UR5 with a mistake."""
    whole = {
        **{"format": 2, "robot": "ur5", "duration": 1.5, "start": {"q": Q0}, "goal": {"q": Q1}},
        **{"effects": {"gravity": {}}, **changes},
    }
    if "segments" in whole:
        del whole["duration"], whole["goal"]
    return whole


def processor_seconds(process: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def told_after(scene: Path, sentence: str) -> float:
    """Processor time in [s] until `hovi plan` prints a part of a sentence."""
    command = [sys.executable, "-u", "-m", "hovi", "plan", str(scene), "--no-certificate"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    printed = ""
    try:
        assert process.stdout is not None
        for line in process.stdout:
            printed += line
            if sentence in line:
                return processor_seconds(process.pid)
    finally:
        process.kill()
        process.wait()
    raise AssertionError(f"{sentence!r} is not in {printed!r}")


def main() -> None:
    """Print the table."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        for mistake, (changes, sentence) in MISTAKES.items():
            scene.write_text(tomlkit.dumps(task(changes)))
            least = min(told_after(scene, sentence) for _ in range(RUNS))
            rows.append([mistake, f"... {sentence} ...", least])
    print_table(["mistake", "reported", "processor s"], rows)
    print_machine()


if __name__ == "__main__":
    main()
