"""Are the minima of hovi minima? Random reaches of twelve arms with defaults, judged independently.

Start and goal are drawn uniformly within the position limits, at most half a turn from the neutral
configuration, among pairs that can be held with 0.9 of the torque limits. T is 1.5 to 3 times the
time that the slowest joint needs at its velocity limit. A success is denied if
- the integral of 1/2 |tau|^2 along its curve, with torques of pin.rnea from sampled (q, v, a) at 48
  Gauss points per interval, differs from its cost by more than 1 %;
- a solve on a grid four times finer, started from it, is no minimum within 1 % of its cost: neither
  with `galerkin-2` on four times as many equal intervals, which may resolve less of the motion than
  its own, nor on its own intervals cut into four;
- a limit is exceeded by more than 2e-6 of its range at one of 50,001 times.

    python resolved_reaches.py [ARM ...] [--count 25] [--seed 0] [--limits urdf|none] [--jobs 1]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from measuring import print_machine, print_table
from outside_judge import MAX_DIFFERENCE, MAX_EXCESS, excess, integral, oracle_model, torques
from twelve_arms import ARMS, load, reaches

import hovi
from hovi.planning.solver.solver import solve_on_grid
from hovi.schemes import galerkin

TIME_LIMIT = 600.0
COMMON = {"self_collision": False, "time_limit": TIME_LIMIT, "processes": 1}
"""Time limit of a plan, in [s]."""
SAMPLES = 50_001
"""Times at which limits are checked."""


@dataclass(frozen=True)
class Reach:
    """The result of one reach.

    nit: steps of the optimiser. seconds: of CPU. denied: why the success is denied, or "".
    spin: largest velocity of a joint, over (half a turn + its distance) / T.
    """

    arm: str
    limits: str
    number: int
    status: str
    nit: int
    seconds: float
    denied: str
    spin: float
    message: str


def beyond_limits(scene: hovi.Scene, trajectory: hovi.Trajectory) -> float:
    """Largest excess over a limit, as a fraction of its range; unlimited joints are left out."""
    robot = scene.robot
    motion = trajectory.sample(np.linspace(0.0, trajectory.duration, SAMPLES))
    tau = torques(oracle_model(robot.model), motion)
    bounds = [
        (motion.v, -robot.velocity_limit, robot.velocity_limit),
        (tau, -robot.effort_limit, robot.effort_limit),
    ]
    if robot.vector_joints:
        bounds.append((motion.q, robot.lower, robot.upper))
    return max(0.0, *(excess(*each) for each in bounds))


def denial(scene: hovi.Scene, limits: str, plan: hovi.Solution) -> str:
    """Why a success is denied, or ""."""
    difference = integral(oracle_model(scene.robot.model), plan.trajectory) / plan.cost - 1
    if abs(difference) > MAX_DIFFERENCE:
        return f"integral {difference:+.1e}"
    beyond = beyond_limits(scene, plan.trajectory) if limits == "urdf" else 0.0
    if beyond > MAX_EXCESS:
        return f"limits {beyond:.1e}"
    grid = plan.trajectory.grid
    finer = _solved(plan, hovi.Grid.uniform(grid.duration, 4 * grid.intervals, galerkin(2)))
    if not _confirms(finer, plan):
        finer = _solved(plan, _quarters(grid))
    if _confirms(finer, plan):
        return ""
    return f"finer {finer.status} {finer.cost / plan.cost - 1:+.1e}"


def _solved(plan: hovi.Solution, grid: hovi.Grid) -> hovi.Solution:
    """A solve from the plan's motion on another grid."""
    return solve_on_grid(plan.problem.on(grid), plan.trajectory, max_iterations=2000)


def _confirms(finer: hovi.Solution, plan: hovi.Solution) -> bool:
    """Whether a finer solution is a minimum of nearly the same cost."""
    return finer.success and abs(finer.cost / plan.cost - 1) <= MAX_DIFFERENCE


def _quarters(grid: hovi.Grid) -> hovi.Grid:
    """The grid with every interval cut into four."""
    for _ in range(2):
        grid = grid.halved()
    return grid


def measure(arm: str, limits: str, number: int, count: int, seed: int) -> Reach:
    """Plan and judge one reach."""
    scene = load(arm)
    *ends, T = reaches(scene, count, seed)[number]
    began = time.process_time()
    plan = hovi.plan(scene, *ends, T, limits=limits, **COMMON)
    seconds = time.process_time() - began
    denied = denial(scene, limits, plan) if plan.success else ""
    velocity = np.abs(plan.trajectory.sample(np.linspace(0, T, 2001)).v).max(axis=0)
    unit = (np.pi + np.abs(scene.robot.difference(*ends))) / T
    spin = float(np.max(velocity / unit))
    status = str(plan.status)
    text = f"{arm} {limits} {number}: T {T:.2f} {status} {plan.nit} steps {seconds:.2f} s"
    print(f"{text} spin {spin:.1f} {denied}", file=sys.stderr, flush=True)
    return Reach(arm, limits, number, status, plan.nit, seconds, denied, spin, plan.message)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*")
    parser.add_argument("--count", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limits", choices=["urdf", "none"])
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    arms, kinds = args.arms or list(ARMS), [args.limits] if args.limits else ["urdf", "none"]
    jobs = [(arm, kind, i) for kind in kinds for arm in arms for i in range(args.count)]
    with ProcessPoolExecutor(args.jobs) as pool:
        futures = [pool.submit(measure, *job, args.count, args.seed) for job in jobs]
        rows = [future.result() for future in futures]
    for kind in kinds:
        print(f"\nLimits: {kind}\n")
        _print(kind, arms, rows)
    print_machine(threads=1)
    raise SystemExit(any(row.denied for row in rows))


def _print(kind: str, arms: list[str], rows: list[Reach]) -> None:
    """The table by arm, and a line for every denied success."""
    own = [row for row in rows if row.limits == kind]
    table = [_summary(arm, [row for row in own if row.arm == arm]) for arm in arms]
    columns = ["arm", "minima", "others", "denied", "steps", "seconds of CPU"]
    print_table(columns, [*table, _summary("all", own)])
    for row in own:
        if row.denied:
            print(f"- denied: `{row.arm}` {row.number}: {row.denied}")


def _summary(name: str, rows: list[Reach]) -> list[object]:
    """A row of the table."""
    others = Counter(row.status for row in rows if row.status != "minimum")
    steps, seconds = [row.nit for row in rows], [row.seconds for row in rows]
    return [
        f"`{name}`",
        f"{len(rows) - others.total()} of {len(rows)}",
        ", ".join(f"{n} {status}" for status, n in others.items()) or "-",
        sum(bool(row.denied) for row in rows),
        f"{np.median(steps):.0f}, {max(steps)}",
        f"{np.median(seconds):.2f}, {max(seconds):.2f}",
    ]


if __name__ == "__main__":
    main()
