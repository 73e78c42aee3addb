"""Replanning in a loop: the goal moves, and the last motion is the guess."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from measuring import alone, print_machine, print_table

import hovi

Array = npt.NDArray[np.float64]

MOVES = (0.005, 0.05, 0.2)
LAPS = 40


def solved(scene: str) -> tuple[hovi.Solution, Array]:
    """The motion of a scene and the configuration of its goal."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(task.duration, task.options.interval_count, task.options.table)
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    solution = hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal))
    return solution, np.asarray(task.goal.q, dtype=float)


def goals(home: Array, move: float, count: int) -> Iterator[Array]:
    """A walk of the goal: steps of length `move`, random but biased towards the original goal."""
    random, goal = np.random.default_rng(0), home
    for _ in range(count):
        direction = random.standard_normal(len(home)) + 2 * (home - goal) / move
        goal = goal + move * direction / np.linalg.norm(direction)
        yield goal


def measure(scene: str, move: float) -> list[float]:
    """Steps (most and mean), milliseconds (median) and Hz, over a walk of the goal."""
    solution, home = solved(scene)
    steps, times = [], []
    for goal in goals(home, move, LAPS):
        began = time.perf_counter()
        solution = solution.replan(goal=hovi.State(goal))
        times.append(time.perf_counter() - began)
        steps.append(solution.nit)
        assert solution.success, solution.message
    median = float(np.median(times))
    return [max(steps), float(np.mean(steps)), 1e3 * median, 1 / median]


def measure_joints(scene: str, move: float) -> list[list[float]]:
    """Joint, steps and change of the motion in [rad], for each joint forwards and backwards."""
    solution, home = solved(scene)
    rows = []
    for joint in range(len(home)):
        row: list[float] = [joint + 1]
        for change in (move, -move):
            goal = home.copy()
            goal[joint] += change
            again = solution.replan(goal=hovi.State(goal))
            assert again.success, again.message
            row += [again.nit, float(np.abs(again.trajectory.q - solution.trajectory.q).max())]
        rows.append(row)
    return rows


def main() -> None:
    rows = []
    for scene in ("ur5_reach", "panda_reach"):
        for move in MOVES:
            most, mean, ms, rate = alone(measure, scene, move)
            cells = [f"{most:.0f}", f"{mean:.1f}", f"{ms:.1f}", f"{rate:.0f}"]
            rows.append([f"`{scene}`, goal moved by {move:g} rad", *cells])
    print(f"`Solution.replan`, {LAPS} goals in a row, one thread.\n")
    print_table(["scene", "most steps", "mean steps", "ms", "Hz"], rows)
    print("One joint of the UR5's own goal moved by 0.05 rad, forwards and backwards.\n")
    rows = [
        [f"{joint:.0f}", f"{ahead:.0f}", f"{far:.2f}", f"{back:.0f}", f"{away:.2f}"]
        for joint, ahead, far, back, away in alone(measure_joints, "ur5_reach", 0.05)
    ]
    columns = ["joint", "+0.05: steps", "motion moves [rad]", "-0.05: steps", "motion moves [rad]"]
    print_table(columns, rows)
    print(
        "The prediction counts as a step, and so does every one with an exact Hessian; chord "
        "steps, which cost a gradient each, do not.\n"
    )
    print_machine(threads=1)


if __name__ == "__main__":
    main()
