"""Rest-to-rest reaches between random configurations, within every limit of the URDF.

Twenty pairs are drawn uniformly within the position limits of each robot, at most one turn, among
those that can be held with less than the torque limits. The duration is three times that of the
slowest joint at its velocity limit, at least one second. Where the direct solve runs out of
iterations, `plan` goes on from its motion; reaches that still fail are planned again from four
guesses.

    python random_reaches.py [ROBOT ...]
"""

from __future__ import annotations

import sys

import numpy as np
from measuring import alone, print_machine, print_table

import hovi

ROBOTS = {
    "ur5": [],
    "panda": ["panda_finger_joint1", "panda_finger_joint2"],
    "z1": ["jointGripper"],
    "xarm7": [],
    "talos_arm": ["gripper_left_joint"],
}
PAIRS, SEED, STARTS = 20, 0, 4
HOLDING_FRACTION = 0.9
"""Fraction of the torque limits allowed for holding start and goal."""
TIME_LIMIT = 600.0  # [s], of one call of plan


def pairs(scene: hovi.Scene) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Start, goal and duration of every reach; both ends can be held within the torque limits."""
    robot = scene.robot
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    wide = robot.upper - robot.lower > 2 * np.pi
    lower, upper = np.where(wide, lower, robot.lower), np.where(wide, upper, robot.upper)
    random, found = np.random.default_rng(SEED), []
    while len(found) < PAIRS:
        q = random.uniform(lower, upper, (2, robot.nv))
        held = (
            np.abs(scene.inverse_dynamics(q, 0 * q, 0 * q)) <= HOLDING_FRACTION * robot.effort_limit
        )
        if held.all():
            T = 3 * np.max(np.abs(q[1] - q[0]) / robot.velocity_limit)
            found.append((q[0], q[1], max(float(T), 1.0)))
    return found


def measure(name: str) -> list[dict[str, object]]:
    """The result of every reach of a robot, and from more guesses where it fails."""
    scene = hovi.Scene(hovi.load_robot(name, locked=ROBOTS[name]), [hovi.effects.Gravity()])
    rows: list[dict[str, object]] = []
    for number, (start, goal, duration) in enumerate(pairs(scene)):
        settings = {"self_collision": False, "processes": 1, "time_limit": TIME_LIMIT}
        first = hovi.plan(scene, start, goal, duration, **settings)
        row = {"number": number, "solution": _result(first), "again": None}
        if not first.success:
            more = hovi.plan(scene, start, goal, duration, starts=STARTS, **settings)
            row["again"] = _result(more)
        rows.append(row)
        print(
            f"{name} {number}: {first.status} after {first.nit} steps", file=sys.stderr, flush=True
        )
    return rows


def _result(solution: hovi.Solution) -> dict[str, object]:
    return {
        "success": solution.success,
        "status": str(solution.status),
        "message": solution.message,
        "steps": solution.nit,
        "intervals": solution.trajectory.grid.intervals,
    }


def main() -> None:
    print(
        f"All defaults, cubic guess, gravity, seed {SEED}, one thread, "
        f"{PAIRS} reaches per robot, at most {TIME_LIMIT:.0f} s each. "
        "Medians and largest of those that end in a minimum.\n"
    )
    table, failures = [], []
    for name in sys.argv[1:] or ROBOTS:
        rows = alone(measure, name)
        good = [row["solution"] for row in rows if row["solution"]["success"]]
        bad = [row for row in rows if not row["solution"]["success"]]
        rescued = sum(row["again"]["success"] for row in bad)
        steps = [s["steps"] for s in good]
        table.append(
            [
                f"`{name}`",
                f"{len(good)} of {len(rows)}",
                f"{np.median(steps):.0f}, {max(steps)}",
                max(s["intervals"] for s in good),
                f"{len(good) + rescued} of {len(rows)}",
            ]
        )
        failures += [(name, row) for row in bad]
    columns = ["robot", "minima", "steps", "most intervals"]
    print_table([*columns, f"minima, with {STARTS} starts for the rest"], table)
    for name, row in failures:
        said, again = row["solution"], row["again"]
        print(f"- `{name}` {row['number']}: {said['status']} after {said['steps']} steps:")
        print(f"  {said['message']}")
        print(f"  With {STARTS} starts: {again['status']}.")
    print()
    print_machine(threads=1)


if __name__ == "__main__":
    main()
