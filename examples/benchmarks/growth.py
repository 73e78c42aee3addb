"""Growth of time and memory with the number of intervals, on the two-link reach from 1e2 to 1e5.

Up to 1,000 intervals the nodal band matrix is factored; beyond, intervals are merged in pairs.
"""

from __future__ import annotations

from measuring import alone, exponent, peak_memory, print_machine, print_table

import hovi

SIZES = (100, 1_000, 10_000, 100_000)
SCHEMES = ("taylor-midpoint", "galerkin-2")


def measure(scheme: str, intervals: int) -> dict[str, float]:
    """One solve from the default guess."""
    task = hovi.load_task(hovi.example("two_link_reach"))
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    solution = hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal))
    assert solution.success, solution.message
    return {
        "steps": solution.nit,
        "seconds": solution.solve_seconds,
        "cost": solution.cost,
        "memory": peak_memory(),
    }


def main() -> None:
    print("The two-link reach from the default guess.\n")
    for scheme in SCHEMES:
        runs = [alone(measure, scheme, intervals) for intervals in SIZES]
        per_step = [1e3 * run["seconds"] / run["steps"] for run in runs]
        columns = ["intervals", "steps", "ms per step", "us per step and interval"]
        columns += ["seconds in all", "peak MB", "cost"]
        rows = [
            [
                f"{intervals:,}",
                run["steps"],
                f"{ms:.3g}",
                f"{1e3 * ms / intervals:.3g}",
                f"{run['seconds']:.3g}",
                f"{run['memory']:.0f}",
                f"{run['cost']:.10f}",
            ]
            for intervals, run, ms in zip(SIZES, runs, per_step, strict=True)
        ]
        print(f"`{scheme}`\n")
        print_table(columns, rows)
        memory = [run["memory"] for run in runs]
        print(
            f"Time per step grows like N^{exponent(SIZES, per_step):.2f} from 1e2 to 1e5 (like "
            f"N^{exponent(SIZES[2:], per_step[2:]):.2f} from 1e4 to 1e5), and memory by "
            f"{1e3 * (memory[3] - memory[2]) / (SIZES[3] - SIZES[2]):.1f} kB per interval.\n"
        )
    print_machine(threads=1)


if __name__ == "__main__":
    main()
