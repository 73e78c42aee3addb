"""Time of set-up and of each part of a Newton step, on the scenes of models/."""

from __future__ import annotations

import time

from measuring import alone, best_time, peak_memory, print_machine, print_table
from sampling import PARTS, shares

import hovi
import hovi.planning.search.planner

SCENES = (
    "two_link_reach",
    "two_link_swing_up",
    "two_link_elbow",
    "ur5_reach",
    "panda_reach",
)


def measure(scene: str) -> dict[str, float]:
    """Times of the first and of a warm solve on the scene's own grid, from the cubic guess."""
    began = time.perf_counter()
    task = hovi.load_task(hovi.example(scene))
    read = time.perf_counter()
    fresh = hovi.Scene(task.scene.robot, task.scene.effects)
    grid = hovi.Grid.uniform(task.duration, task.options.interval_count, task.options.table)
    ld = hovi.DiscreteLagrangian(fresh.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, task.start, task.goal)
    ready = time.perf_counter()
    solution = hovi.solve(problem)
    first = time.perf_counter() - ready
    result = {"n": fresh.robot.nv, "N": task.options.interval_count, "reading": read - began}
    result |= {"set-up": ready - read, "first": first, "steps": solution.nit}
    result |= {"success": solution.success, "cost": solution.cost}
    result["warm"] = best_time(lambda: hovi.solve(problem), seconds=1.0)
    result["memory"] = peak_memory()
    return result | shares(lambda: hovi.solve(problem))


def main() -> None:
    runs = {scene: alone(measure, scene) for scene in SCENES}
    print("From the cubic guess, one start, on the scene's own grid.\n")
    columns = ["scene", "n", "N", "reading [ms]", "set-up [ms]", "first solve [ms]"]
    columns += ["warm solve [ms]", "steps", "cost", "peak MB"]
    rows = [
        [f"`{scene}`", run["n"], run["N"]]
        + [f"{1e3 * run[key]:.3g}" for key in ("reading", "set-up", "first", "warm")]
        + [run["steps"], f"{run['cost']:.7g}", f"{run['memory']:.0f}"]
        for scene, run in runs.items()
    ]
    print_table(columns, rows)
    print("A Newton step when warm, in microseconds.\n")
    parts = (*PARTS, "Python")
    rows = []
    for scene, run in runs.items():
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
