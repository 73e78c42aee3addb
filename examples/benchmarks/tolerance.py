"""Plans to a tolerance: estimated and true errors, and computing time.

The true error is the distance from a solution with half the steps and six more inner modes, whose
cost is compared with SciPy's solve_bvp on Pontryagin's equations. The cheapest fixed run is the
fastest plan with a Galerkin scheme of 0 to 8 inner modes on 4 to 64 intervals, from the same guess,
that ends in the same minimum within the tolerance; its solve alone comes without an error estimate
and without the comparison with a finer solution. These and the plan to the tolerance are timed in
turns, in CPU time of one thread; the best time of each counts.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from measuring import alone, print_machine, print_table
from pontryagin import extremal_cost

import hovi
from hovi.discrete.measures.motion_error import deviation
from hovi.planning.solver.solver import solve_on_grid
from hovi.schemes import galerkin

OnGrid = Callable[[int, int], hovi.Solution]
"""A solve with r inner modes on N intervals."""
SCENES = ("two_link_reach", "ur5_reach", "panda_reach", "z1", "chain of 4")
TOLERANCES = [10.0**-k for k in range(2, 10)]
DEGREES, INTERVALS = (0, 1, 2, 3, 4, 6, 8), (4, 6, 8, 12, 16, 24, 32, 64)
REPEATS = 7
MAX_COST_DIFFERENCE = 0.05
"""Relative difference of the cost from the reference beyond which a run found another minimum, or
none."""


def task(name: str) -> tuple[hovi.Scene, hovi.State, hovi.State, float]:
    """Scene, start, goal and duration."""
    if name == "z1":
        robot = hovi.load_robot("z1", locked=["jointGripper"])
        start, goal = [0.0, 0.5, -0.5, 0.0, 0.0, 0.0], [0.8, 1.2, -1.0, 0.3, 0.4, -0.5]
        scene, duration = hovi.Scene(robot, [hovi.effects.Gravity()]), 1.0
        return scene, hovi.State(start), hovi.State(goal), duration
    if name == "chain of 4":
        robot = hovi.load_robot(pin.buildModelFromXML(hovi.chain(4)))
        scene = hovi.Scene(robot, [hovi.effects.Gravity()])
        hang, bend = np.array([-np.pi / 2, 0.0, 0.0, 0.0]), np.array([1.0, 0.4, -0.3, 0.5])
        return scene, hovi.State(hang), hovi.State(hang + bend), 1.0
    read = hovi.load_task(hovi.example(name))
    return read.scene, read.start, read.goal, read.duration


def measure(name: str) -> tuple[list[list[str]], str]:
    """Rows of the table, and the comparison of the reference with SciPy."""
    scene, start, goal, duration = task(name)

    def plan(**options: object) -> hovi.Solution:
        return hovi.plan(
            scene, start, goal, duration, limits="none", self_collision=False, **options
        )

    def on_grid(r: int, N: int) -> hovi.Solution:
        """A solve on a fixed grid, without the estimate that a plan has."""
        ld = hovi.DiscreteLagrangian(
            scene.effort_lagrangian(), hovi.Grid.uniform(duration, N, galerkin(r))
        )
        return solve_on_grid(hovi.TrajectoryProblem(ld, start, goal))

    plan(tolerance=1e-6)  # warm up imports and caches
    fixed = [_Fixed.of(plan, r, N) for r in DEGREES for N in INTERVALS]
    rows = []
    for tolerance in TOLERANCES:
        solution = plan(tolerance=tolerance)
        reference = _reference(solution)
        costs = solution.cost, reference.cost
        true = deviation(solution.trajectory, reference.trajectory, costs)
        accuracy, grid = solution.accuracy, solution.trajectory.grid
        modes = sorted({scheme.inner_modes for scheme in grid.schemes})
        good = [run for run in fixed if run.error(reference.cost) <= tolerance]
        best = min(good, key=lambda run: run.seconds) if good else None
        rows.append(
            [
                f"{name}",
                f"{tolerance:.0e}",
                "yes" if accuracy.reached else accuracy.reason,
                f"{grid.intervals}",
                f"{modes[0]}" if len(modes) == 1 else f"{modes[0]} to {modes[-1]}",
                f"{accuracy.error:.1e}",
                f"{true.cost:.1e}",
                f"{1e3 * true.largest_tip:.1e}",
                *_times(plan, on_grid, tolerance, best),
            ]
        )
    exact = extremal_cost(reference.trajectory)
    text = "SciPy found no solution"
    if exact is not None:
        text = f"{abs(exact / reference.cost - 1):.0e}"
    return rows, text


@dataclass(frozen=True)
class _Fixed:
    """A run on a fixed grid."""

    r: int
    N: int
    seconds: float
    cost: float

    @classmethod
    def of(cls, plan: Callable[..., hovi.Solution], r: int, N: int) -> _Fixed:
        """The faster of two runs; infinite cost if it ends in no minimum."""
        times = []
        for _ in range(2):
            began = time.process_time()
            solution = plan(scheme=galerkin(r), intervals=N)
            times.append(time.process_time() - began)
        return cls(r, N, min(times), solution.cost if solution.success else np.inf)

    def error(self, cost: float) -> float:
        """Relative error of the cost; infinite if the run ended in another minimum."""
        error = abs(self.cost / cost - 1)
        return error if error < MAX_COST_DIFFERENCE else np.inf


def _times(
    plan: Callable[..., hovi.Solution], on_grid: OnGrid, tolerance: float, best: _Fixed | None
) -> list[str]:
    """Times of the plan to the tolerance, the cheapest fixed one and its solve, and a ratio."""
    chosen, fixed, alone = [], [], []
    for _ in range(REPEATS):
        chosen.append(_seconds(lambda: plan(tolerance=tolerance)))
        if best is not None:
            fixed.append(_seconds(lambda: plan(scheme=galerkin(best.r), intervals=best.N)))
            alone.append(_seconds(lambda: on_grid(best.r, best.N)))
    if best is None:
        return [f"{1e3 * min(chosen):.0f}", "-", "-", "-", "-"]
    times = [f"{1e3 * min(each):.1f}" for each in (chosen, fixed, alone)]
    return [*times, f"galerkin-{best.r} on {best.N}", f"{min(chosen) / min(fixed):.1f}"]


def _seconds(work: Callable[[], hovi.Solution]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def _reference(solution: hovi.Solution) -> hovi.Solution:
    grid, problem = solution.trajectory.grid, solution.problem
    assert problem is not None
    tables = tuple(galerkin(scheme.inner_modes + 6) for scheme in grid.schemes)
    fine = hovi.Grid(grid.steps, tables).halved()
    return solve_on_grid(problem.on(fine), solution.trajectory)


def main() -> None:
    columns = ["scene", "tolerance", "reached", "N", "inner modes", "estimate", "true error"]
    columns += ["tip [mm]", "CPU [ms]", "fixed [ms]", "its solve [ms]", "which", "ratio"]
    rows, oracle = [], []
    for name in SCENES:
        more, text = alone(measure, name)
        rows += more
        oracle.append(f"{name}: {text}")
    print_table(columns, rows)
    ratios = [float(row[-1]) for row in rows if row[-1] != "-"]
    print(
        f"Ratio: {min(ratios)} to {max(ratios)}, {statistics.median(ratios):.1f} in the middle.\n"
    )
    print("Cost of the finest reference against SciPy's solve_bvp, relative: " + ", ".join(oracle))
    print()
    print_machine(1)


if __name__ == "__main__":
    main()
