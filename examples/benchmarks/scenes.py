"""Time of set-up and of each part of a Newton step, on the scenes of models/."""

from __future__ import annotations

import time

from measuring import alone, best_time, peak_memory, print_machine, print_table
from sampling import PARTS, shares

import hovi
from hovi.planning.refinement.resolution import resolved
from hovi.planning.solver.solver import solve_on_grid

RUNS: tuple[tuple[str, int | None], ...] = (
    ("two_link_reach", None),
    ("two_link_swing_up", None),
    ("two_link_elbow", None),
    ("ur5_reach", None),
    ("panda_reach", 16),
    ("panda_reach", None),
)
"""Scenes, and intervals, None for the scene's own; 16 do not resolve the Panda's motion."""


def measure(scene: str, intervals: int | None) -> dict[str, float]:
    """Times of the first and of a warm solve, from the cubic guess. intervals: None for its own."""
    began = time.perf_counter()
    task = hovi.load_task(hovi.example(scene))
    read = time.perf_counter()
    fresh = hovi.Scene(task.scene.robot, task.scene.effects)
    number = intervals or task.options.interval_count
    grid = hovi.Grid.uniform(task.duration, number, task.options.table)
    ld = hovi.DiscreteLagrangian(fresh.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, task.start, task.goal)
    ready = time.perf_counter()
    solution = solve_on_grid(problem)
    first = time.perf_counter() - ready
    result = {"n": fresh.robot.nv, "N": number, "reading": read - began}
    result |= {"set-up": ready - read, "first": first, "steps": solution.nit}
    result |= {"status": str(resolved(solution).status), "cost": solution.cost}
    result["warm"] = best_time(lambda: solve_on_grid(problem), seconds=1.0)
    result["memory"] = peak_memory()
    return result | shares(lambda: solve_on_grid(problem))


def main() -> None:
    runs = [(scene, alone(measure, scene, intervals)) for scene, intervals in RUNS]
    print("From the cubic guess, one start, on the scene's own grid.\n")
    columns = ["scene", "n", "N", "reading [ms]", "set-up [ms]", "first solve [ms]"]
    columns += ["warm solve [ms]", "steps", "cost", "status", "peak MB"]
    rows = [
        [f"`{scene}`", run["n"], run["N"]]
        + [f"{1e3 * run[key]:.3g}" for key in ("reading", "set-up", "first", "warm")]
        + [run["steps"], f"{run['cost']:.7g}", run["status"], f"{run['memory']:.0f}"]
        for scene, run in runs
    ]
    print_table(columns, rows)
    print("A Newton step when warm, in microseconds.\n")
    parts = (*PARTS, "Python")
    rows = []
    for scene, run in runs:
        step = 1e6 * run["warm"] / run["steps"]
        cells = [f"{step * run[part]:.0f} ({run[part]:.0%})" for part in parts]
        rows.append([f"`{scene}`", *cells, f"{step:.0f}", f"{step * (1 - run['kernel']):.0f}"])
    print_table(["scene", *parts, "together", "all but the kernel"], rows)
    print(
        "*Reading* is the TOML file, the URDF and its checks; no mesh is read. *Set-up* is all "
        "that follows before the solve. Both are timed once, in a process that has only imported "
        "hovi.\n"
    )
    print_machine(threads=1)


if __name__ == "__main__":
    main()
