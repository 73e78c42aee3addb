"""Observed orders: least-squares slopes of errors against the step, on the two-link reach."""

from __future__ import annotations

import numpy as np
from measuring import exponent, print_table

import hovi
from hovi.schemes import by_name

REFERENCE = ("galerkin-6", 192)
COMMON = (24, 32, 48, 64, 96)
GRIDS = {
    "taylor-midpoint": COMMON,
    "taylor-trapezoid": COMMON,
    "hermite-simpson": COMMON,
    "galerkin-0": COMMON,
    "galerkin-1": COMMON,
    "galerkin-2": COMMON[:-1],
    "galerkin-3": (12, 16, 24, 32),
}
"""Numbers of intervals that divide the reference's, with errors above round-off."""
BETWEEN = np.array([0.2, 0.37, 0.5, 0.71, 0.9])


def motion(scheme: str, intervals: int, guess: object = "cubic") -> hovi.Solution:
    """The minimum of cost 20.2 on a grid."""
    task = hovi.load_task(hovi.example("two_link_reach"))
    grid = hovi.Grid.uniform(task.duration, intervals, by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    solution = hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal), guess)
    assert solution.success, solution.message
    return solution


def errors(solution: hovi.Solution, exact: hovi.Solution) -> dict[str, float]:
    """Largest errors at the nodes and between them, relative to the largest value."""
    mine, true = solution.trajectory, exact.trajectory
    stride = true.grid.intervals // mine.grid.intervals
    pairs = {"q": (mine.q, true.q[::stride]), "v": (mine.v, true.v[::stride])}
    pairs["p, p~"] = (mine.momenta, true.momenta[::stride])
    pairs["cost"] = (np.array([solution.cost]), np.array([exact.cost]))
    t = (mine.t[:-1, None] + mine.grid.steps[:, None] * BETWEEN).ravel()
    between = zip(mine.sample(t)._asdict().items(), true.sample(t), strict=True)
    pairs |= {f"{name} between": (x, y) for (name, x), y in between}
    return {name: float(np.max(abs(x - y)) / np.max(abs(y))) for name, (x, y) in pairs.items()}


def print_slopes(slopes: dict[str, dict[str, str]], keys: tuple[str, ...]) -> None:
    """Print observed orders of some quantities."""
    rows = [
        [f"`{name}`", by_name(name).order, f"{sizes[0]} to {sizes[-1]}"]
        + [slopes[name][key] for key in keys]
        for name, sizes in GRIDS.items()
    ]
    print_table(["scheme", "order", "intervals", *keys], rows)


def main() -> None:
    exact = motion(*REFERENCE)
    print(f"Against `{REFERENCE[0]}` on {REFERENCE[1]} intervals, cost {exact.cost:.10f}.\n")
    slopes = {}
    for name, sizes in GRIDS.items():
        found = [errors(motion(name, N, exact.trajectory), exact) for N in sizes]
        slopes[name] = {
            key: f"{-exponent(sizes, [each[key] for each in found]):.2f}" for key in found[0]
        }
    print("At the nodes:\n")
    print_slopes(slopes, ("q", "v", "p, p~", "cost"))
    print("At five points inside every interval:\n")
    print_slopes(slopes, ("q between", "v between", "a between", "tau between"))
    last = errors(motion("galerkin-3", 32, exact.trajectory), exact)
    print(
        "`galerkin-3` on 32 intervals: relative errors "
        + ", ".join(f"{name} {value:.0e}" for name, value in last.items())
        + ".\n"
    )


if __name__ == "__main__":
    main()
