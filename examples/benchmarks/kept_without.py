"""What lines and directions cost: plans that keep them next to the same plans without.

Random tasks (kept_paths.py) on arms of seven joints within the limits of their URDFs, and a line of
0.6 m on a UR10 within its maker's. What is kept, the limits and the integral of 1/2 |tau|^2 are
judged at 20,000 samples by Pinocchio alone. Steps and processor times are given relative to those
of the same call without `keep`, and of plans without it to the configuration in which it ends, next
to plans with it to the same.

    python kept_without.py [ARM ...] [--count 5] [--seed 0]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from kept_paths import KeptTask, pose, random_tasks
from kept_tasks import judge
from measuring import alone, print_machine, print_table
from random_arms import arm_scene, middle_and_most, timed, torque_model

import hovi
from hovi.conditions import Keep, OnLine, Upright

Array = npt.NDArray[np.float64]

ARMS = ("panda", "kinova", "ur10")
KINDS: dict[str, Callable[[str], list[Keep]]] = {
    "line": lambda frame: [OnLine(frame)],
    "upright": lambda frame: [Upright(frame)],
    "line and upright": lambda frame: [OnLine(frame), Upright(frame)],
}
LONG, LONG_START = 0.6, (-0.6, -1.2, 1.9, -2.27, -1.57, 0.0)
"""Length of the UR10's line along y, in [m], and where it starts."""
LONG_DURATION = 2.0


@dataclass(frozen=True)
class Pair:
    """Steps and times with what is kept, and without: of the same call, and to one configuration.

    missed: in [m]. angle: in [rad]. wrong: what an own judge says.
    """

    missed: float
    angle: float
    wrong: str
    steps: tuple[float, float]
    seconds: tuple[float, float]
    times: float


def measure(arm: str, kind: str, count: int, seed: int) -> list[Pair]:
    """Every task of an arm."""
    scene = arm_scene(arm)
    frame = scene.robot.tip_frames[0]
    if arm == "ur10":
        place = pose(torque_model(scene), frame, np.array(LONG_START))[:3, 3] + [0.0, LONG, 0.0]
        tasks, limits = [KeptTask(np.array(LONG_START), place, LONG_DURATION, np.nan)], "ur10"
    else:
        tasks, limits = random_tasks(scene, kind, count, seed), "urdf"
    pairs = []
    for number, task in enumerate(tasks):
        plan = partial(hovi.plan, scene, task.start, duration=task.duration, limits=limits)
        plan = partial(plan, processes=1, self_collision=False)
        goal, keep = hovi.FrameGoal(frame, position=task.place), KINDS[kind](frame)
        if number == 0:
            plan(goal, keep=keep), plan(goal)  # loads everything
        kept, free = timed(partial(plan, goal, keep=keep)), timed(partial(plan, goal))
        end = kept[1].trajectory.q[-1]
        again, there = timed(partial(plan, end, keep=keep)), timed(partial(plan, end))
        missed, angle, _, said = judge(scene, None, kind, task, kept[1], limits)
        found = [each.success for _, each in (kept, free, again, there)]
        missing = "" if all(found) else f"minima: {found}"
        steps = kept[1].nit / free[1].nit, again[1].nit / there[1].nit
        seconds = kept[0] / free[0], again[0] / there[0]
        wrong = ", ".join(filter(None, (said, missing)))
        pairs.append(Pair(missed, angle, wrong, steps, seconds, kept[0]))
    return pairs


def row(name: str, pairs: list[Pair]) -> list[Any]:
    """A row of the table."""
    missed, angle = max(p.missed for p in pairs), max(p.angle for p in pairs)
    held = sum(not p.wrong for p in pairs)
    first = [name, f"{held} of {len(pairs)}", f"{1e3 * missed:.1e}, {np.rad2deg(angle):.1e}"]
    ratios = (
        [[p.steps[i] for p in pairs] for i in (0, 1)],
        [[p.seconds[i] for p in pairs] for i in (0, 1)],
    )
    return [
        *first,
        middle_and_most([p.times for p in pairs]),
        *(middle_and_most(each[i]) for i in (0, 1) for each in ratios),
    ]


def main() -> None:
    """Print a row for each arm and kind, and what is wrong."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--count", type=int, default=5, help="tasks of each arm and kind")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    table, wrong = [], []
    for arm in given.arms or ARMS:
        for kind in KINDS:
            if arm == "ur10" and kind != "line":
                continue
            pairs = alone(measure, arm, kind, given.count, given.seed)
            what = f"{kind} of {LONG} m" if arm == "ur10" else kind
            table.append(row(f"`{arm}`, {what}", pairs))
            wrong += [f"- `{arm}`, {kind}, {i}: {p.wrong}" for i, p in enumerate(pairs) if p.wrong]
    columns = ["", "held", "missed [mm], [deg]", "CPU s: median, max"]
    columns += ["steps / the same without", "CPU s / the same without"]
    columns += ["steps / without, to one end", "CPU s / without, to one end"]
    print_table(columns, table)
    print(*wrong, sep="\n")
    print_machine(threads=1)


if __name__ == "__main__":
    main()
