"""Straight lines with the tool's rotation kept: hovi next to roboplan's Cartesian planner.

roboplan follows the line by inverse kinematics and times it by TOPP-RA within limits on velocities
and accelerations; hovi plans the least effort in the same time, and in 1.3 times of it, within the
same limits and those of torques. Both are judged by Pinocchio: efforts by torques of pin.rnea. Some
lines end at singularities or limits, with the rotation of the start.

    python kept_lines.py --peer PYTHON [ARM ...] [--count 20] [--seed 0]

PYTHON: of an environment with `pip install roboplan-cartesian-planning roboplan-toppra`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from kept_paths import pose, random_tasks
from measuring import print_machine, print_table
from random_arms import arm_scene, middle_and_most, rnea, timed, torque_model

import hovi
from hovi.robot.example_robots import example_robot

Array = npt.NDArray[np.float64]

ARMS = ("ur5", "xarm7")
ACCELERATION, STEP = 20.0, 1e-3
"""Limit on accelerations, in [rad/s^2], and time between roboplan's samples, in [s]."""
SLOWER = 1.0, 1.3
"""hovi's durations, in those of roboplan."""
LONG = 1.0
"""hovi's duration of lines on which roboplan finds no trajectory, in [s]."""
BASE = "universe"


def lines(arm: str, count: int, seed: int) -> tuple[hovi.Scene, list[dict[str, Any]]]:
    """Starts and poses at both ends, whose rotation is the same."""
    scene = arm_scene(arm)
    model, frame, asked = torque_model(scene), scene.robot.tip_frames[0], []
    for task in random_tasks(scene, "line", count, seed):
        first = pose(model, frame, task.start)
        last = first.copy()
        last[:3, 3] = task.place
        asked.append(
            {
                "urdf": example_robot(arm).urdf.read_text(),
                "start": task.start.tolist(),
                "poses": [first.tolist(), last.tolist()],
                "frame": frame,
                "base": BASE,
                "acceleration": ACCELERATION,
                "dt": STEP,
                "within": 1e-4,
                "turn": float(np.deg2rad(0.1)),
            }
        )
    return scene, asked


def judged(scene: hovi.Scene, asked: dict[str, Any], motion: dict[str, Array]) -> dict[str, float]:
    """Effort, the largest acceleration, torque relative to its limit, distance and turn."""
    model, frame = torque_model(scene), scene.robot.tip_frames[0]
    t, q = motion["t"], motion["q"]
    tau = rnea(model, q, motion["v"], motion["a"])
    poses = np.array([pose(model, frame, each) for each in q])
    first, last = np.array(asked["poses"])
    along = (last - first)[:3, 3] / np.linalg.norm((last - first)[:3, 3])
    away = poses[:, :3, 3] - first[:3, 3]
    off = np.linalg.norm(away - np.outer(away @ along, along), axis=1)
    turned = [np.linalg.norm(pin.log3(first[:3, :3].T @ each[:3, :3])) for each in poses]
    return {
        "T": float(t[-1]),
        "effort": float(np.trapezoid(0.5 * (tau**2).sum(axis=1), t)),
        "a": float(np.abs(motion["a"]).max()),
        "tau": float((np.abs(tau) / model.effortLimit).max()),
        "off": float(off.max()),
        "turn": float(max(turned)),
    }


def hovi_side(scene: hovi.Scene, asked: dict[str, Any], duration: float) -> dict[str, float]:
    """hovi's plan of a line in a duration; only its time where no minimum was found."""
    frame, (_, last) = scene.robot.tip_frames[0], np.array(asked["poses"])
    x, y, z, w = pin.Quaternion(last[:3, :3]).coeffs()
    goal = hovi.FrameGoal(frame, position=last[:3, 3], quaternion_wxyz=[w, x, y, z])
    keep = [hovi.conditions.OnLine(frame), hovi.conditions.KeepOrientation(frame)]
    limits = {"base": "urdf", "a": ACCELERATION}
    planned = partial(hovi.plan, scene, asked["start"], goal, duration, keep=keep, limits=limits)
    seconds, found = timed(partial(planned, self_collision=False, processes=1, time_limit=30.0))
    if not found.success:
        return {"seconds": seconds}
    t = np.linspace(0.0, duration, 2001)
    x = found.trajectory.sample(t)
    return judged(scene, asked, {"t": t, "q": x.q, "v": x.v, "a": x.a}) | {"seconds": seconds}


def main() -> None:
    """Print a row for each side, arm and duration."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--peer", required=True, help="Python of roboplan's environment")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    given, table = parser.parse_args(), []
    for arm in given.arms or ARMS:
        scene, asked = lines(arm, given.count, given.seed)
        worker = [given.peer, str(Path(__file__).with_name("kept_lines_peer.py"))]
        answer = subprocess.run(
            worker, input=json.dumps(asked), capture_output=True, text=True, check=True
        )
        theirs = []
        for each, found in zip(asked, json.loads(answer.stdout), strict=True):
            known = {"seconds": found["seconds"]}
            if "error" not in found:
                known |= judged(scene, each, {x: np.array(found[x]) for x in "tqva"})
            theirs.append(known)
        table.append(row(f"`{arm}`, roboplan", theirs, theirs))
        both = [(a, b) for a, b in zip(asked, theirs, strict=True) if "T" in b]
        hovi_side(scene, *next((a, b["T"]) for a, b in both))  # loads everything
        for slower in SLOWER:
            ours = [hovi_side(scene, a, slower * b["T"]) for a, b in both]
            table.append(row(f"`{arm}`, hovi in {slower:g} T", ours, [b for _, b in both]))
        others = [a for a, b in zip(asked, theirs, strict=True) if "T" not in b]
        ours = [hovi_side(scene, each, LONG) for each in others]
        table.append(row(f"`{arm}`, hovi in {LONG:g} s, the other lines", ours, ours))
    columns = ["", "lines", "CPU s: median, max", "effort / roboplan's: median, max"]
    columns += ["largest |a| [rad/s^2]", "|tau| / limit", "off the line [mm]", "turned [deg]"]
    print_table(columns, table)
    print_machine(threads=1)


def row(name: str, runs: list[dict[str, float]], others: list[dict[str, float]]) -> list[str]:
    """A row of the table; others: what efforts are relative to."""
    good = [(a, b) for a, b in zip(runs, others, strict=True) if "T" in a and "T" in b]
    return [
        name,
        f"{len(good)} of {len(runs)}",
        middle_and_most([a["seconds"] for a, _ in good]),
        middle_and_most([a["effort"] / b["effort"] for a, b in good]),
        middle_and_most([a["a"] for a, _ in good], ".3g"),
        middle_and_most([a["tau"] for a, _ in good]),
        middle_and_most([1e3 * a["off"] for a, _ in good]),
        middle_and_most([float(np.rad2deg(a["turn"])) for a, _ in good]),
    ]


if __name__ == "__main__":
    main()
