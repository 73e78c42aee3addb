"""Random reaches within the URDF's limits: time, steps, and limits checked between the points.

Reaches from rest to rest under gravity, between configurations that can be held with 0.9 of the
torque limits, in 1.5 to 2 times the time at the velocity limits. Each is planned on 16 intervals
and with all defaults. Limits are checked at 50,000 samples with torques of pin.rnea. The point
solve is one interior-point solve from the cubic guess on the final grid, with its points, whose
motion need not hold limits between them.

With --ipopt, the plan on 16 intervals and that point solve against Ipopt on compiled kernels with
limits at the points only, on 16 equal intervals, with as few points as there may be and with those
of the plan; and, for the Kinova, the default plan against Ipopt on 64 intervals with four more
samples each. All of them start from the cubic guess.

    python limited_reaches.py [ARM ...] [--count 10] [--seed 0] [--armature 0.1] [--ipopt]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from limited_ipopt import against_ipopt
from measuring import alone, print_machine, print_table
from random_arms import (
    ARMS,
    arm_scene,
    cold_point_solve,
    largest_excess,
    middle_and_most,
    random_reaches,
    timed,
)

import hovi

APART = {"self_collision": False}
SETTINGS = {"16 intervals": {"intervals": 16, **APART}, "defaults": APART}
MAX_EXCESS = 1e-6
"""Largest excess of a motion that holds its limits, as a fraction of their ranges."""


@dataclass(frozen=True)
class Run:
    """One plan. ratio: of its time to that of a point solve on its grid; nan without one."""

    arm: str
    setting: str
    number: int
    status: str
    message: str
    seconds: float
    intervals: int
    points: int
    steps: int
    cost: float
    excess: float
    ratio: float

    @property
    def good(self) -> bool:
        """Whether it is a minimum that holds its limits."""
        return self.status == "minimum" and self.excess <= MAX_EXCESS


def measure(arm: str, armature: float, count: int, seed: int, time_limit: float) -> list[Run]:
    """Every reach of an arm with every setting, after a plan that loads everything."""
    scene = arm_scene(arm, armature)
    reaches = random_reaches(scene, count, seed)
    hovi.plan(scene, reaches[0].start, reaches[0].start + 0.01, 1.0, intervals=16, **APART)
    rows = []
    for number, reach in enumerate(reaches):
        for setting, options in SETTINGS.items():
            options = options | {"processes": 1, "time_limit": time_limit}
            seconds, plan = timed(
                lambda reach=reach, options=options: hovi.plan(
                    scene, reach.start, reach.goal, reach.duration, **options
                )
            )
            run = _run(arm, setting, number, plan, seconds)
            text = f"{arm} {number}, {setting}: {run.status}, {run.steps} steps, {seconds:.2f} s"
            print(f"{text}, excess {run.excess:.0e}", file=sys.stderr, flush=True)
            rows.append(run)
    return rows


def _run(arm: str, setting: str, number: int, plan: hovi.Solution, seconds: float) -> Run:
    problem, motion = plan.problem, plan.trajectory
    assert problem is not None
    assert problem.limits is not None
    scene = problem.scene
    point = cold_point_solve(problem)
    grid = motion.grid
    return Run(
        arm,
        setting,
        number,
        str(plan.status),
        plan.message,
        seconds,
        grid.intervals,
        sum(len(scheme.points) for scheme in grid.schemes),
        plan.nit,
        plan.cost,
        largest_excess(scene, motion, problem.limits),
        seconds / point.seconds if point.success else np.nan,
    )


def row(name: str, runs: list[Run]) -> list[object]:
    """A row of the table: one arm with one setting."""
    seconds = [run.seconds for run in runs]
    found = [run.excess for run in runs if run.status == "minimum"]
    ratios = [run.ratio for run in runs if np.isfinite(run.ratio)]
    return [
        name,
        f"{sum(run.good for run in runs)} of {len(runs)}",
        middle_and_most(seconds),
        f"{max(seconds) / float(np.median(seconds)):.1f}",
        middle_and_most(ratios),
        middle_and_most([run.intervals for run in runs], ".0f"),
        middle_and_most([run.points for run in runs], ".0f"),
        middle_and_most([run.steps for run in runs], ".0f"),
        f"{max(found, default=np.nan):.0e}",
    ]


def main() -> None:
    """Print the table of plans, or against Ipopt."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--armature", type=float, default=0.0, help="of every joint, in [kg m^2]")
    parser.add_argument("--time-limit", type=float, default=600.0, help="of a plan, in [s]")
    parser.add_argument("--ipopt", action="store_true", help="compare with Ipopt instead")
    parser.add_argument("--kernels", metavar="FOLDER", help="where compiled kernels are kept")
    given = parser.parse_args()
    arms = given.arms or list(ARMS)
    rotors = f", rotors of {given.armature:g} kg m²" if given.armature else ""
    print(f"{given.count} reaches per arm, seed {given.seed}{rotors}, one thread.\n")
    if given.ipopt:
        against_ipopt(arms, given.armature, given.count, given.seed, given.kernels)
    else:
        plans(arms, given.armature, given.count, given.seed, given.time_limit)
    print_machine(threads=1)


def plans(arms: list[str], armature: float, count: int, seed: int, time_limit: float) -> None:
    """Print the table of plans, and every plan that is no minimum or passes a limit."""
    table, bad = [], []
    for arm in arms:
        runs = alone(measure, arm, armature, count, seed, time_limit)
        bad += [run for run in runs if not run.good]
        for setting in SETTINGS:
            name = f"`{arm}`, {setting}"
            table.append(row(name, [run for run in runs if run.setting == setting]))
    columns = ["arm", "minima within limits", "CPU s: median, max", "max / median"]
    columns += ["time / point solve: median, max", "intervals", "points", "steps"]
    print_table([*columns, "largest excess of a minimum"], table)
    for run in bad:
        print(f"- `{run.arm}` {run.number}, {run.setting}: {run.status} after {run.seconds:.2g} s")
        print(f"  (excess {run.excess:.0e}): {run.message}")
    print()


if __name__ == "__main__":
    main()
