"""Reaches under limits compared with Ipopt, and the time to detect infeasible problems.

Both solvers have the same discrete problem, guess and thread in one run: q, v and tau are bounded
at the quadrature points. hovi then continues until the limits hold between the points too. Ipopt
has exact derivatives from compiled kernels; building it is not counted. The reaches of Kinova and
xArm are the first of `limited_reaches.py`.

    python limits.py [--kernels FOLDER]
    python limits.py --methods    # other methods on the same points: docs/tables/methods.md
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from infeasible import print_cases
from limited_ipopt import MORE_SAMPLES, IpoptRun, compiled_kernels, ipopt_solve
from measuring import alone, print_machine, print_table
from random_arms import (
    PointSolve,
    arm_scene,
    cold_point_solve,
    largest_excess,
    limited_problem,
    random_reaches,
    timed,
)
from stagewise import PEERS, StageProgram

import hovi
from hovi.optimize.criteria import Criteria
from hovi.optimize.start import Start
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.initial_path import guess_path

SCENES = ("ur5_reach_limited", "panda_reach_limited")
ARMS = ("kinova", "xarm7")
SCHEME, INTERVALS = "galerkin-2", 16
REPEATS = 2


def problem_of(name: str) -> hovi.TrajectoryProblem:
    """The problem of a scene file, or the first random reach of an arm."""
    scheme = hovi.schemes.by_name(SCHEME)
    if name in ARMS:
        scene = arm_scene(name)
        return limited_problem(scene, random_reaches(scene, 1, 0)[0], INTERVALS, scheme)
    task = hovi.load_task(hovi.example(name))
    grid = hovi.Grid.uniform(task.duration, INTERVALS, scheme)
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    limits = hovi.as_limits(task.scene.robot, task.options.limits)
    return hovi.TrajectoryProblem(ld, task.start, task.goal, limits=limits)


def measure(name: str, folder: str) -> tuple[list[list[object]], str]:
    """Solver, steps, processor time, cost and largest excess of each solver; hovi's message."""
    problem = problem_of(name)
    kernels = compiled_kernels(problem.scene, Path(folder))
    points = [cold_point_solve(problem) for _ in range(REPEATS)]
    status = "" if points[0].success else ", no minimum"
    seconds, first = min(point.seconds for point in points), points[0]
    rows = [[f"hovi, at the points{status}", first.steps, seconds, first.cost, np.nan]]
    runs = [timed(lambda: hovi.solve(problem)) for _ in range(REPEATS)]
    seconds, whole = min(runs, key=lambda run: run[0])
    assert problem.limits is not None
    excess = largest_excess(problem.scene, whole.trajectory, problem.limits)
    rows.append([f"hovi, everywhere ({whole.status})", whole.nit, seconds, whole.cost, excess])
    for text, samples in (("", ()), (f", {len(MORE_SAMPLES)} more samples", MORE_SAMPLES)):
        solves = [ipopt_solve(problem, kernels, samples) for _ in range(REPEATS)]
        rows.append(_row(text, min(solves, key=lambda run: run.seconds)))
    motion = whole.trajectory

    def near(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x = motion.sample(t)
        return x.q, x.v, x.a

    rows.append(_row(", from hovi's motion", ipopt_solve(problem, kernels, guess=near)))
    return rows, whole.message


def _row(text: str, run: IpoptRun) -> list[object]:
    return [f"Ipopt{text} ({run.status})", run.steps, run.seconds, run.cost, run.excess]


def methods_on(name: str) -> list[list[object]]:
    """Steps, time, of it in functions, cost and excess at the points, of each method."""
    problem = problem_of(name)
    runs = [cold_point_solve(problem) for _ in range(REPEATS)]
    ours = min(runs, key=lambda run: run.seconds)
    rows = [_method_row(name, "hovi", "minimum" if ours.success else "none", ours, "", ours)]
    for solver in ("piqp",):
        run, status = _by_programs(problem, solver)
        rows.append(_method_row(name, f"SequentialQuadratic, {solver}", status, run, "", ours))
    stages = StageProgram(problem)
    for peer in PEERS:
        found = stages.solved(peer)
        run = PointSolve(found.steps, found.cost, found.seconds, found.success)
        inside = f"{1e3 * found.evaluations:.3g}"
        rows.append(_method_row(name, f"{peer}, stage-wise", found.status, run, inside, ours))
    return rows


def _by_programs(problem: hovi.TrajectoryProblem, solver: str) -> tuple[PointSolve, str]:
    """Sequential quadratic programs with limits at the points, from the cubic guess."""
    assert problem.limits is not None
    program, method = (
        BoundedAction(problem, problem.limits),
        hovi.methods.SequentialQuadratic(solver),
    )
    start, criteria = Start(guess_path(problem, "cubic")), Criteria(decrease=1e-9)
    seconds, found = timed(lambda: method.minimize(program, start, criteria))
    run = PointSolve(len(found.steps), found.value, seconds, found.why == "stationary")
    return run, str(found.why)


def _method_row(
    name: str, method: str, status: str, run: PointSolve, inside: str, ours: PointSolve
) -> list[object]:
    per_step = f"{1e3 * run.seconds / run.steps:.2g}" if run.steps > 0 else ""
    times = [f"{1e3 * run.seconds:.3g}", inside, f"{run.seconds / ours.seconds:.1f}", per_step]
    costs = [f"{run.cost:.8g}", f"{run.cost / ours.cost - 1:.1e}"]
    return [f"`{name}`, {method} ({status})", run.steps, *times, *costs]


def print_methods() -> None:
    """The table of methods on the same discrete problem."""
    print(f"`{SCHEME}` on {INTERVALS} intervals, limits at the points, from the cubic guess, one")
    print(
        "thread. Fatrop and HPIPM, as the QP of CasADi's `sqpmethod`, have the stage-wise form with"
    )
    print("functions that CasADi interprets: what these take is counted apart.\n")
    rows = [row for name in SCENES for row in alone(methods_on, name)]
    columns = ["scene, method", "steps", "CPU ms", "of it in functions", "time / hovi's"]
    print_table([*columns, "ms per step", "cost", "cost / hovi's - 1"], rows)
    print_machine(threads=1)


def main() -> None:
    """Print both tables, or that of other methods."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--methods", action="store_true", help="compare methods on the same points")
    parser.add_argument("--kernels", metavar="FOLDER", help="where compiled kernels are kept")
    given = parser.parse_args()
    if given.methods:
        print_methods()
        return
    print(f"`{SCHEME}` on {INTERVALS} intervals, from the cubic guess, one thread, when warm.\n")
    table, notes = [], []
    with tempfile.TemporaryDirectory() as fresh:
        for name in (*SCENES, *ARMS):
            rows, message = alone(measure, name, given.kernels or fresh)
            _, steps, seconds, cost, _ = rows[0]
            for solver, n, t, J, excess in rows:
                compared = [f"{n / steps:.2f}", f"{1e3 * t:.3g}", f"{t / seconds:.1f}"]
                costs = [f"{J:.10g}", f"{J / cost - 1:.1e}"]
                held = "" if np.isnan(excess) else f"{excess:.0e}"
                table.append([f"`{name}`, {solver}", n, *compared, *costs, held])
            notes.append(f"- `{name}`, hovi everywhere: {message}")
    columns = ["scene, solver", "steps", "steps / hovi's", "CPU ms", "time / hovi's", "cost"]
    print_table([*columns, "cost / hovi's - 1", "largest excess, of the range"], table)
    print("\n".join(notes) + "\n")
    print("Problems without a motion, against one like it that has one:\n")
    print_cases()
    print_machine(threads=1)


if __name__ == "__main__":
    main()
