"""hovi against CasADi, Ipopt and Fatrop: the same discrete problem, guess and thread, in one run.

Compiling and building are not counted. From the same guess different solvers may end in
different minima, so their costs are printed; started at hovi's motion, Ipopt must not move.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import casadi as ca
from measuring import alone, best_time, print_machine, print_table
from random_arms import timed
from stagewise import StageProgram
from transcription import Transcription

import hovi
from hovi.planning.refinement.resolution import resolved
from hovi.planning.solver.solver import solve_on_grid

RUNS = ("ur5_reach", 16), ("panda_reach", 16), ("panda_reach", 60)
"""Scenes and intervals; 16 do not resolve the Panda's motion, and are kept for comparison."""
SCHEME = "galerkin-2"


def measure(scene: str, intervals: int) -> list[dict[str, object]]:
    """hovi, then both peers: steps, time of a warm solve, cost, setup time."""
    task = hovi.load_task(hovi.example(scene))
    began = time.perf_counter()
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.by_name(SCHEME))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, task.start, task.goal)
    solution = solve_on_grid(problem)
    built = time.perf_counter() - began - solution.solve_seconds
    assert solution.success, solution.message
    warm = best_time(lambda: solve_on_grid(problem), seconds=2.0)
    note = "" if resolved(solution).success else ", unresolved"
    ours = {"solver": f"hovi{note}", "steps": solution.nit, "seconds": warm, "built": built}
    rows = [ours | {"cost": solution.cost, "stays": 0.0}]
    transcription = Transcription(problem)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("compiled", "interpreted"):
            began = time.perf_counter()
            arguments = (Path(folder),) if name == "compiled" else ()
            solver = getattr(transcription, name)(*arguments)
            row = {"solver": f"Ipopt, {name}", "built": time.perf_counter() - began}
            rows.append(row | _peer(solver, transcription, solution))
    return [*rows, _fatrop(problem, solution), _by_programs(problem, solution)]


def _fatrop(problem: hovi.TrajectoryProblem, ours: hovi.Solution) -> dict[str, object]:
    """Fatrop on the stage-wise form, with functions that CasADi interprets."""
    began = time.perf_counter()
    stages = StageProgram(problem)
    built = time.perf_counter() - began
    found, near = stages.solved("Fatrop"), stages.solved("Fatrop", ours.trajectory)
    inside = f"{1e3 * (found.seconds - found.evaluations):.0f} ms of it Fatrop's own"
    row = {"solver": f"Fatrop, interpreted, {inside}", "built": built, "cost": found.cost}
    row |= {"steps": found.steps, "seconds": found.seconds}
    return row | {"stays": abs(near.cost / ours.cost - 1)}


def _by_programs(problem: hovi.TrajectoryProblem, ours: hovi.Solution) -> dict[str, object]:
    """Sequential quadratic programs by PIQP, a second method of hovi's."""
    method = hovi.methods.SequentialQuadratic()
    seconds, found = timed(lambda: solve_on_grid(problem, method=method))
    near = solve_on_grid(problem, ours.trajectory, method=method)
    row = {"solver": f"SequentialQuadratic ({found.status})", "built": 0.0, "cost": found.cost}
    row |= {"steps": found.nit, "seconds": seconds}
    return row | {"stays": abs(near.cost / ours.cost - 1)}


def _peer(solver: ca.Function, it: Transcription, ours: hovi.Solution) -> dict[str, object]:
    near = solver(**it.arguments(ours.trajectory))
    guess = it.arguments("cubic")
    found = solver(**guess)
    stats = solver.stats()
    assert stats["success"], stats["return_status"]
    seconds = best_time(lambda: solver(**guess), seconds=2.0)
    return {
        "steps": stats["iter_count"],
        "seconds": seconds,
        "cost": float(found["f"]),
        "stays": abs(float(near["f"]) / ours.cost - 1),
    }


def main() -> None:
    print(f"`{SCHEME}`, from the cubic guess, one thread, when warm.\n")
    rows = []
    for scene, intervals in RUNS:
        runs = alone(measure, scene, intervals)
        ours = runs[0]["seconds"]
        for run in runs:
            rows.append(
                [
                    f"`{scene}` on {intervals}, {run['solver']}",
                    run["steps"],
                    f"{1e3 * run['seconds']:.1f}",
                    f"{run['seconds'] / ours:.1f}",
                    f"{1e3 * run['seconds'] / run['steps']:.2f}",
                    f"{run['cost']:.7g}",
                    f"{run['stays']:.0e}",
                    f"{run['built']:.2g}",
                ]
            )
    columns = ["scene, solver", "steps", "ms", "time / hovi's", "ms per step", "cost"]
    columns += ["from hovi's motion: change of cost", "seconds to build"]
    print_table(columns, rows)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
