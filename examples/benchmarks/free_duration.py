"""A free duration against the same plan for its best duration, both from the cubic guess."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from measuring import alone, print_machine, print_table

import hovi
from hovi.effects import Armature, Gravity

SCENES: dict[str, tuple[float, dict[str, Any]]] = {
    "two_link_reach": (20.0, {"limits": "none"}),
    "two_link_elbow_limited": (20.0, {}),
    "ur5_reach": (50.0, {"limits": "none"}),
    "ur5_reach_limited": (50.0, {}),
    "panda_reach": (50.0, {"limits": "none"}),
    "panda_reach_limited": (50.0, {}),
}
"""Price of time, and options instead of the scene's."""
BOUNDS = 0.5, 6.0
GRIDS: dict[str, dict[str, Any]] = {"24 intervals": {"intervals": 24}, "to 0.1 %": {}}
ROBOTS = {"ur5": 100.0, "panda": 50.0}
KINDS = (
    "to a configuration",
    "to a frame",
    "past a ball",
    "clear of its links",
    "a joint's power limited",
)
BALL, POWER = 0.05, 100.0
"""Radius of the ball in the middle of the path straight in q, in [m], and the power, in [W]."""
REACHES, MOVES = 6, 3
RUNS = 3

Row = list[float]
"""T, steps and seconds with it free and given, |dS/dT + w| / w, 0 at a bound; and whether both
succeeded."""


def compare(ends: Sequence[Any], weight: float, options: dict[str, Any], runs: int = RUNS) -> Row:
    """One row for a problem."""
    free, seconds = timed(ends, BOUNDS, options | {"time_weight": weight}, runs)
    T = free.trajectory.duration
    fixed, given = timed(ends, T, options, runs)
    inside = BOUNDS[0] < T < BOUNDS[1]
    slope = abs(free.duration_derivative / weight + 1) if inside else 0.0
    return [T, free.nit, fixed.nit, seconds, given, slope, free.success and fixed.success]


def timed(
    ends: Sequence[Any], duration: Any, more: dict[str, Any], runs: int
) -> tuple[hovi.Solution, float]:
    """A plan and the least processor time of some runs, in [s]."""
    times, options = [], {"self_collision": False} | more
    for _ in range(runs):
        began = time.process_time()
        found = hovi.plan(*ends, duration, processes=1, **options)
        times.append(time.process_time() - began)
    return found, min(times)


def scene_row(name: str, grid: str) -> Row:
    """A bundled scene; that of a Panda without limits with rotors, without which it spins."""
    weight, options = SCENES[name]
    task = hovi.load_task(hovi.example(name))
    scene = task.scene
    if name == "panda_reach":
        scene = hovi.Scene(scene.robot, [*scene.effects, Armature(0.1)])
    options = {"limits": task.options.limits} | options | GRIDS[grid]
    return compare((scene, task.start, task.goal), weight, options)


def task_of(
    kind: str, robot: hovi.Robot, q0: np.ndarray, q1: np.ndarray
) -> tuple[Any, dict[str, Any]]:
    """The goal and the options of a reach of a kind."""
    position = partial(robot.frame_position, robot.tip_frames[0])
    if kind == "to a frame":
        return hovi.FrameGoal(robot.tip_frames[0], position=position(q1), guess=q1), {}
    if kind == "past a ball":
        ball = hovi.Sphere(position(0.5 * (q0 + q1)), BALL, name="ball")
        return q1, {"obstacles": [ball]}
    if kind == "clear of its links":
        return q1, {"self_collision": True}
    if kind == "a joint's power limited":
        power = hovi.Condition(lambda tau, v: tau[1] * v[1], hovi.Between(-POWER, POWER))
        return q1, {"conditions": [power]}
    return q1, {}


def random_rows(name: str, kind: str) -> list[Row]:
    """Reaches of a kind between random configurations, within the limits of the URDF."""
    robot = hovi.load_robot(name)
    scene = hovi.Scene(robot, [Gravity()])
    lower = np.maximum(robot.model.lowerPositionLimit, -np.pi)
    upper = np.minimum(robot.model.upperPositionLimit, np.pi)
    random = np.random.default_rng(5)
    rows = []
    for _ in range(REACHES):
        q0, q1 = 0.8 * random.uniform(lower, upper), 0.8 * random.uniform(lower, upper)
        goal, options = task_of(kind, robot, q0, q1)
        rows.append(compare((scene, q0, goal), ROBOTS[name], {"intervals": 24} | options, 1))
    return rows


def sequence_rows(name: str, passing: bool) -> list[Row]:
    """Sequences of random moves within the limits of the URDF, as `compare` without slopes.

    passing: whether the robot moves through the goals on the way; it stops there otherwise.
    """
    robot = hovi.load_robot(name)
    scene = hovi.Scene(robot, [Gravity()])
    lower = np.maximum(robot.model.lowerPositionLimit, -np.pi)
    upper = np.minimum(robot.model.upperPositionLimit, np.pi)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    free = {"free_velocity": list(robot.joint_names)} if passing else {}
    options = {"limits": "urdf", "intervals": 36, "self_collision": False, "processes": 1}
    random = np.random.default_rng(5)

    def planned(start: np.ndarray, goals: list[hovi.State], durations: Any, **more: Any) -> Any:
        moves = [hovi.Segment(goal, T) for goal, T in zip(goals, durations, strict=True)]
        began = time.process_time()
        found = hovi.plan_sequence(scene, start, moves, **options, **more)
        return found, time.process_time() - began

    rows = []
    for _ in range(REACHES):
        q = [middle + 0.6 * half * random.uniform(-1.0, 1.0, robot.nv)]
        for _ in range(MOVES):
            moved = q[-1] + 0.3 * half * random.uniform(-1.0, 1.0, robot.nv)
            q.append(np.clip(moved, middle - 0.9 * half, middle + 0.9 * half))
        goals = [*(hovi.State(each, **free) for each in q[1:-1]), hovi.State(q[-1])]
        found, seconds = planned(q[0], goals, [BOUNDS] * MOVES, time_weight=ROBOTS[name])
        motion = found.trajectory
        last = np.cumsum(motion.segments.intervals)
        durations = np.diff(motion.grid.t[[0, *last]]).tolist()
        fixed, given = planned(q[0], goals, durations)
        T, success = motion.duration, found.success and fixed.success
        rows.append([T, found.nit, fixed.nit, seconds, given, 0.0, success])
    return rows


def ratios_of(rows: list[Row]) -> list[str]:
    """The successes, and medians and largest ratios of steps and times, as text."""
    found = np.array(rows, dtype=float)
    done = found[found[:, 6] == 1.0]
    steps, times = done[:, 1] / done[:, 2], done[:, 3] / done[:, 4]
    ratios = [f"{f(x):.1f}" for x in (steps, times) for f in (np.median, np.max)]
    return [f"{len(done)} of {REACHES}", *ratios]


def cells(row: Row) -> list[str]:
    """The numbers of a row as text, ratios included."""
    T, steps, given_steps, seconds, given, slope, success = row
    steps_ratio, ratio = steps / given_steps, seconds / given
    note = "" if success else " (not resolved)"
    return [
        f"{T:.3f}{note}",
        *(f"{steps:.0f}", f"{given_steps:.0f}", f"{steps_ratio:.1f}"),
        *(f"{1e3 * seconds:.0f}", f"{1e3 * given:.0f}", f"{ratio:.1f}"),
        f"{slope:.0e}",
    ]


def main() -> None:
    print("`plan` with a duration between 0.5 and 6 s, and with the best one given; one thread.\n")
    columns = ["T [s]", "steps", "given", "ratio", "ms", "given", "ratio", "abs(dS/dT + w) / w"]
    rows = [
        [f"`{name}`, {grid}", *cells(alone(scene_row, name, grid))]
        for grid in GRIDS
        for name in SCENES
    ]
    print_table(["scene and grid", *columns], rows)
    print(f"{REACHES} random reaches within the limits of the URDF, 24 intervals.\n")
    rows = []
    for name, kind in itertools.product(ROBOTS, KINDS):
        found = alone(random_rows, name, kind)
        slope = max(row[5] for row in found if row[6])
        rows.append([f"`{name}`, {kind}", *ratios_of(found), f"{slope:.0e}"])
    names = ["successes", "steps, median", "largest", "time, median", "largest"]
    print_table(["robot and task", *names, "largest abs(dS/dT + w) / w"], rows)
    print(f"{REACHES} random sequences of {MOVES} moves, each of a free duration, 36 intervals.\n")
    rows = [
        [f"`{name}`, {'passing' if passing else 'stopping at'} goals on the way", *ratios_of(found)]
        for name, passing in itertools.product(ROBOTS, (False, True))
        if (found := alone(sequence_rows, name, passing))
    ]
    print_table(["robot and task", *names], rows)
    print_machine()


if __name__ == "__main__":
    main()
