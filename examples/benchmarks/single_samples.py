"""Processor time of `trajectory.sample` at one time, torques included, as in a control loop."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import hovi

ROBOTS = ("ur5", "panda", "kinova")


def microseconds(call: Callable[[], object], calls: int = 1000, runs: int = 9) -> float:
    """The least processor time of a call in several runs, in [us]."""
    best = np.inf
    for _ in range(runs):
        begin = time.process_time()
        for _ in range(calls):
            call()
        best = min(best, (time.process_time() - begin) / calls)
    return 1e6 * float(best)


def main() -> None:
    print(f"{'robot':10} {'sample':>8} {'RNEA':>8} {'configurations':>16}   [us]")
    for name in ROBOTS:
        locked = ["panda_finger_joint1", "panda_finger_joint2"] if name == "panda" else []
        scene = hovi.Scene(hovi.load_robot(name, locked=locked), [hovi.effects.Gravity()])
        start = scene.robot.neutral()
        goal = scene.robot.space.integrate(start, np.full(scene.robot.nv, 0.4))
        motion = hovi.plan(scene, start, goal, 2.0, limits="none", self_collision=False).trajectory
        q, v, a, _ = motion.sample(0.7)
        calls = (
            partial(motion.sample, 0.7),
            partial(scene.inverse_dynamics, q, v, a),
            partial(motion.configurations, 0.7),
        )
        sample, rnea, configurations = map(microseconds, calls)
        print(f"{name:10} {sample:8.1f} {rnea:8.1f} {configurations:16.1f}")


if __name__ == "__main__":
    sys.exit(main())
