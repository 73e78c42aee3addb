"""Rest-to-rest reaches between random configurations, within every limit of the URDF.

Twenty pairs are drawn evenly within the position limits of each robot, a turn at most. The time is
three times what the slowest joint needs at its velocity limit, one second at least. What does not
end in a minimum is tried again from four guesses.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from measuring import alone, print_machine, print_table

import hovi

ROBOTS = {
    "ur5": {},
    "panda": {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0},
    "z1": {"jointGripper": 0.0},
}
PAIRS, SEED, STARTS = 20, 0, 4
SCHEME, INTERVALS = "galerkin-2", 16


def pairs(robot: hovi.Robot) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Start, goal and duration of every reach."""
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    wide = robot.upper - robot.lower > 2 * np.pi
    lower, upper = np.where(wide, lower, robot.lower), np.where(wide, upper, robot.upper)
    drawn = np.random.default_rng(SEED).uniform(lower, upper, (PAIRS, 2, robot.nv))
    durations = 3 * np.max(np.abs(drawn[:, 1] - drawn[:, 0]) / robot.velocity_limit, axis=1)
    return list(zip(drawn[:, 0], drawn[:, 1], np.maximum(durations, 1.0), strict=True))


def measure(name: str) -> list[dict[str, object]]:
    """What every reach of a robot ends in, and again from more guesses where it fails."""
    scene = hovi.Scene(hovi.load_robot(name, locked=ROBOTS[name]), [hovi.effects.Gravity()])
    rows = []
    for number, (start, goal, duration) in enumerate(pairs(scene.robot)):
        settings = {"scheme": SCHEME, "intervals": INTERVALS, "limits": "urdf", "processes": 1}
        first = hovi.plan(scene, start, goal, duration, **settings)
        row = {"number": number, "solution": _said(first), "again": None}
        if not first.success:
            more = hovi.plan(scene, start, goal, duration, starts=STARTS, **settings)
            row["again"] = _said(more)
        rows.append(row)
    return rows


def _said(solution: hovi.Solution) -> dict[str, object]:
    return {
        "success": solution.success,
        "status": str(solution.status),
        "message": solution.message,
        "steps": solution.nit,
        "seconds": solution.solve_seconds,
        "intervals": solution.trajectory.grid.intervals,
    }
