"""Time per Newton step against the number of joints n (chains of rods), intervals and threads."""

from __future__ import annotations

import tempfile
import time
from math import pi
from pathlib import Path

import numpy as np
from measuring import alone, exponent, print_machine, print_table

import hovi
from hovi.robot.urdf.planar_chain import write_chain

LINKS = (2, 3, 5, 7, 10, 14, 20, 30)
INTERVALS = (16, 32, 64, 128, 256, 512)
STEPS = 12
REPEATS = 5


def measure(links: int, intervals: int) -> float:
    """Seconds per step of a chain that lifts itself from hanging at rest to bent at rest."""
    with tempfile.TemporaryDirectory() as folder:
        robot = hovi.load_robot(write_chain(Path(folder) / "chain.urdf", links))
    scene = hovi.Scene(robot, effects=[hovi.effects.Gravity()])
    grid = hovi.Grid.uniform(1.0, intervals, hovi.schemes.galerkin(2))
    start, goal = np.zeros(links), np.full(links, 0.7 / links)
    start[0], goal[0] = -pi / 2, 0.3
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State(start), hovi.State(goal))
    return min(_step_time(problem) for _ in range(REPEATS))


def _step_time(problem: hovi.TrajectoryProblem) -> float:
    """The median time from step to step."""
    clock: list[float] = []
    hovi.solve(
        problem,
        max_iterations=STEPS,
        escape_saddles=False,
        report=lambda number, cost: clock.append(time.perf_counter()),
    )
    return float(np.median(np.diff(clock)))


def main() -> None:
    print(
        f"Chains of n links, `galerkin-2`, 16 intervals: the median of the first {STEPS} steps.\n"
    )
    times = {t: [alone(measure, n, 16, threads=t) for n in LINKS] for t in (1, 2)}
    rows = [
        [n, f"{1e3 * one:.2f}", f"{1e3 * two:.2f}", f"{one / two:.2f}"]
        for n, one, two in zip(LINKS, times[1], times[2], strict=True)
    ]
    columns = ["ms per step", "with 2 threads", "gain"]
    print_table(["n", *columns], rows)
    print(
        f"Time per step grows like n^{exponent(LINKS[:5], times[1][:5]):.2f} from 2 to 10 links "
        f"and like n^{exponent(LINKS[4:], times[1][4:]):.2f} from 10 to 30.\n"
    )
    print("A chain of 7 links on more intervals.\n")
    times = {t: [alone(measure, 7, N, threads=t) for N in INTERVALS] for t in (1, 2)}
    rows = [
        [N, f"{1e3 * one:.2f}", f"{1e3 * two:.2f}", f"{one / two:.2f}"]
        for N, one, two in zip(INTERVALS, times[1], times[2], strict=True)
    ]
    print_table(["N", *columns], rows)
    print(f"Time per step grows like N^{exponent(INTERVALS, times[1]):.2f} from 16 to 512.\n")
    print_machine()


if __name__ == "__main__":
    main()
