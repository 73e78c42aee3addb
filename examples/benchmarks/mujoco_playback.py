"""Planned torques played back in MuJoCo, without feedback: the largest deviation from the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import hovi

TABLE = Path(__file__).resolve().parents[2] / "docs" / "tables" / "mujoco_playback.md"
ARMS = {"ur5": [], "panda": ["panda_finger_joint1", "panda_finger_joint2"], "z1": []}
STEPS = (1e-3, 5e-4, 2e-4, 1e-4)


def motion_of(name: str, rotors: float) -> hovi.Trajectory:
    """A reach of 1.5 s within all limits of the URDF. rotors: armature, in [kg m^2]."""
    robot = hovi.load_robot(name, locked=ARMS[name])
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), hovi.effects.Armature(rotors)])
    start = np.clip(robot.neutral(), robot.lower + 0.1, robot.upper - 0.1)
    goal = np.clip(start + 0.5, robot.lower + 0.1, robot.upper - 0.1)
    return hovi.plan(scene, start, goal, 1.5, self_collision=False).trajectory


def main() -> None:
    lines = [
        "| arm | rotors [kg m²] | " + " | ".join(f"step {step:g} s" for step in STEPS) + " |",
        "|---|---:|" + "---:|" * len(STEPS),
    ]
    for rotors in (0.1, 0.0):
        for name in ARMS:
            motion = motion_of(name, rotors)
            errors = [hovi.replay_in_mujoco(motion, step).error.max() for step in STEPS]
            cells = " | ".join(f"{error:.1e}" for error in errors)
            lines.append(f"| {name} | {rotors:g} | {cells} |")
            print(lines[-1])
    TABLE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
