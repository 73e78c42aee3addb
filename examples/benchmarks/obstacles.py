"""What obstacles cost: processor time with them and without, on the same motion and in one run.

The ten spheres have random places around the hand's way on the motion without them, at least 5 cm
from the arm at the start and at the goal.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from measuring import alone, print_machine, print_table

import hovi
from hovi.planning.clearance.distances import Distances

LIMIT = 300.0
"""Time limit of a plan, in [s]."""
SEEDS = range(5)
BALLS = 10
FREE = 0.05
"""Least distance of a ball from the ends, in [m]."""
FAR = hovi.Sphere([10.0, 0.0, 0.0], 0.1, name="far")
START = [0.0, -0.5, 0.0, -2.0, 0.0, 2.4, 0.785]
MOVE = [1.2, 0.3, 0.2, 0.5, 0.1, 0.2, 0.3]
"""A move of a Panda that keeps its hand more than a centimetre from its other links, in [rad]."""


def panda() -> hovi.Task:
    """The move in 2 s within the limits of panda_reach_limited.toml."""
    task = hovi.load_task(hovi.example("panda_reach_limited"))
    ends = hovi.State(START), hovi.State(np.add(START, MOVE))
    return hovi.Task(task.scene, *ends, 2.0, task.options)


def spent(task: hovi.Task, runs: int = 3, **changes: Any) -> tuple[float, hovi.Solution]:
    """Processor time in [s] and the solution: the best of some runs."""
    times = []
    for _ in range(runs):
        began = time.process_time()
        solution = hovi.plan_task(task, **{"time_limit": LIMIT, **changes})
        times.append(time.process_time() - began)
    return min(times), solution


def compared(name: str, task: hovi.Task, without: dict[str, Any], given: dict[str, Any]) -> Any:
    """A row: with and without; the ratio of times, the change of the cost, the least distance."""
    base, free = spent(task, **without)
    taken, kept = spent(task, **given)
    return _row(name, base, free, taken, kept)


def far_sphere() -> Any:
    return compared("Panda, a sphere 10 m away", panda(), {}, {"obstacles": [FAR]})


def self_collision() -> Any:
    given = {"self_collision": True}
    return compared("Panda, self-collision that changes nothing", panda(), {}, given)


def binding_self_collision() -> Any:
    """The reach of the scene, on which the hand would pass through the first link."""
    task = hovi.load_task(hovi.example("panda_reach_limited"))
    base, free = spent(task)
    taken, kept = spent(task, 1, self_collision=True, time_limit=60.0)
    return _row("Panda, self-collision that bends the motion", base, free, taken, kept)


def around_sphere() -> Any:
    task = hovi.load_task(hovi.example("ur5_around_sphere"))
    return compared("`ur5_around_sphere`", task, {"obstacles": []}, {})


def ten_spheres(seed: int) -> Any:
    task = panda()
    base, free = spent(task)
    taken, kept = spent(task, 1, obstacles=balls(task, free.trajectory, seed))
    return _row(f"Panda, ten spheres, {seed}", base, free, taken, kept)


def balls(task: hovi.Task, motion: hovi.Trajectory, seed: int) -> list[hovi.Sphere]:
    """Spheres around a motion that leave both ends free."""
    random, robot = np.random.default_rng(seed), task.scene.robot
    ends = np.array([task.start.q, task.goal.q])
    way = motion.configurations(np.linspace(0.0, motion.duration, 50))
    hand = robot.frame_position("panda_hand_tcp", way)
    found: list[hovi.Sphere] = []
    while len(found) < BALLS:
        ball = hovi.Sphere(random.choice(hand) + random.uniform(-0.15, 0.15, 3), 0.05)
        if Distances(robot, hovi.Clearance([ball])).values(ends).min() > FREE:
            found.append(ball)
    return found


def _row(
    name: str, base: float, free: hovi.Solution, taken: float, kept: hovi.Solution
) -> list[object]:
    return [
        name,
        f"{base:.2f}",
        f"{taken:.2f}",
        f"{taken / base:.2f}",
        f"{kept.cost / free.cost - 1:.1e}",
        free.nit,
        kept.nit,
        str(kept.status),
    ]


def main() -> None:
    rows = [alone(case) for case in (far_sphere, self_collision, around_sphere)]
    rows += [alone(ten_spheres, seed) for seed in SEEDS]
    rows.append(alone(binding_self_collision))
    print("Processor time, one thread, when warm; *cost* is that of the motion with obstacles")
    print("relative to that without.\n")
    columns = ["case", "s without", "s with", "ratio", "cost - 1", "steps without", "steps with"]
    print_table([*columns, "status"], rows)
    print_machine()


if __name__ == "__main__":
    main()
