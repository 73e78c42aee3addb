"""Every robot of example-robot-data: joints, setup, and a small random motion."""

from __future__ import annotations

import sys
import time
from collections import Counter

import numpy as np
from measuring import print_machine, print_table

import hovi
from hovi.robot.example_robots import BUILT_IN_CODE, example_names

INTERVALS = 4
SIZE = 0.1
"""Size of the random displacement of every coordinate, in [rad] or [m]."""
SECONDS = 60.0
"""Time limit of the motion, in [s]."""


def measure(name: str) -> list[object]:
    """One row: name, nq, nv, joints, setup time in [s], result of the motion."""
    try:
        robot = hovi.load_robot(name)
    except hovi.HoviError as error:
        return [name, "", "", "", "", _cell(error)]
    joints = ", ".join(f"{n} {kind}" for kind, n in _kinds(robot).items())
    row: list[object] = [name, robot.nq, robot.nv, joints]
    began = time.perf_counter()
    try:
        scene = hovi.Scene(robot, [hovi.effects.Armature(0.1)])
        d = SIZE * np.random.default_rng(0).uniform(-1, 1, robot.nv)
        start = robot.neutral()
        grid = hovi.Grid.uniform(1.0, INTERVALS, hovi.schemes.galerkin(1))
        ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
        goal = hovi.State(robot.integrate(start, d))
        problem = hovi.TrajectoryProblem(ld, hovi.State(start), goal)
    except hovi.HoviError as error:
        return [*row, "", _cell(error)]
    row.append(f"{time.perf_counter() - began:.2f}")
    solution = hovi.solve(problem, time_limit=SECONDS)
    outcome = f"{solution.status}, cost {solution.cost:.4g}, {solution.nit} steps"
    return [*row, outcome]


def _kinds(robot: hovi.Robot) -> Counter[str]:
    """Number of joints of each of Pinocchio's types."""
    short = (joint.shortname().removeprefix("JointModel") for joint in robot.model.joints[1:])
    return Counter(kind.rstrip("XYZ") if len(kind) < 5 else kind for kind in short)


def _cell(error: Exception) -> str:
    return str(error).replace("|", "/").replace("\n", " ")


def main() -> None:
    """Print one table of all robots."""
    rows = []
    for name in sorted({*example_names(), *BUILT_IN_CODE}):
        print(name, file=sys.stderr, flush=True)
        rows.append(measure(name))
    print(
        f"A motion of 1 s from the neutral configuration at rest by up to {SIZE} rad or m in every "
        f"coordinate without gravity, rotors of 0.1 kg m², `galerkin-1` on {INTERVALS} intervals, "
        f"at most {SECONDS:.0f} s. Joints by Pinocchio's names: RUB turns without end, R revolute, "
        "P prismatic.\n"
    )
    print_table(["robot", "nq", "nv", "joints", "setup [s]", "motion"], rows)
    print_machine()


if __name__ == "__main__":
    main()
