"""Shared by the benchmarks of limits: Ipopt on compiled kernels, with limits at the points.

The discrete problem is hovi's: the same curves, quadrature points and initial guess. Limits may
hold at further samples of every interval, too. Building and compiling are not timed.
`against_ipopt` is the table of `limited_reaches.py --ipopt`.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from measuring import alone, print_table
from random_arms import (
    PointSolve,
    arm_scene,
    cold_point_solve,
    limited_problem,
    middle_and_most,
    outside,
    random_reaches,
    timed,
)

import hovi
from hovi.accuracy.peers.collocation import Collocation
from hovi.accuracy.peers.collocation_table import collocation_table, with_points
from hovi.accuracy.peers.limited_program import LimitedKernels, LimitedProgram, limited_kernels
from hovi.accuracy.peers.point_program import LIBRARY, compiled_functions, loaded_functions
from hovi.discrete.guess import Curve, cubic
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

MORE_SAMPLES = (0.0, 0.2, 0.5, 0.8)
"""Four more samples of an interval, with the next one's first at its end."""
CHECKS = 100
"""Samples per interval at which the limits of Ipopt's motion are checked."""
SAMPLED, FINE = ("kinova",), 64
"""Arms that are also compared on these intervals with MORE_SAMPLES."""
CHEAPER = 1e-3
"""Relative difference of costs beyond which a minimum is cheaper."""


@dataclass(frozen=True)
class IpoptRun:
    """A solve: processor time in [s], and the largest excess over a limit between the points."""

    success: bool
    status: str
    steps: int
    cost: float
    seconds: float
    excess: float


def compiled_kernels(scene: hovi.Scene, folder: Path) -> LimitedKernels:
    """The kernels of a scene, compiled into a folder of their own unless they are there."""
    kernels = limited_kernels(casadi_functions(scene.model).inverse_dynamics)
    own = folder / hashlib.sha256(kernels.second.serialize().encode()).hexdigest()[:16]
    own.mkdir(parents=True, exist_ok=True)
    change = loaded_functions if (own / LIBRARY).exists() else compiled_functions
    return kernels.passed_through(lambda functions: change(functions, own))


def ipopt_solve(
    problem: hovi.TrajectoryProblem,
    kernels: LimitedKernels,
    samples: tuple[float, ...] = (),
    guess: Curve | None = None,
) -> IpoptRun:
    """Ipopt on a problem on a uniform grid with a Galerkin table, by default from the cubic."""
    ends, T, limits = problem.ends, problem.grid.duration, problem.limits
    assert limits is not None
    collocation = _collocation(problem, samples)
    w = collocation.unknowns(guess or cubic(problem.robot, ends, T), ends)
    free = np.where(collocation.fixed[:, None], 0.0, np.inf)
    program = LimitedProgram(collocation.program, limits.lower, limits.upper)
    solver, bounds = program.solver(kernels), program.bounds
    bounds |= {"lbx": (w - free).ravel(), "ubx": (w + free).ravel()}
    seconds, found = timed(lambda: solver(x0=w.ravel(), **bounds))
    stats = solver.stats()
    return IpoptRun(
        success=bool(stats["success"]),
        status=str(stats["return_status"]),
        steps=int(stats["iter_count"]),
        cost=float(found["f"]),
        seconds=seconds,
        excess=_excess(problem, collocation, found["x"].full().ravel()),
    )


def _collocation(problem: hovi.TrajectoryProblem, samples: tuple[float, ...]) -> Collocation:
    """The method whose curves and quadrature are those of the problem's Galerkin table."""
    grid, scheme = problem.grid, problem.grid.schemes[0]
    table = with_points(
        collocation_table(f"lg-{scheme.inner_modes + 2}"),
        np.append(scheme.points, samples),
        np.append(scheme.weights, np.zeros(len(samples))),
    )
    return Collocation(table, grid.intervals, grid.duration, problem.robot.nv)


def _excess(problem: hovi.TrajectoryProblem, method: Collocation, w: Array) -> float:
    """Largest excess over a limit at many samples, as a fraction of its range."""
    s = np.linspace(0.0, 1.0, CHECKS)
    dense = Collocation(
        with_points(method.table, s, np.zeros(CHECKS)),
        method.intervals,
        method.duration,
        method.joints,
    )
    x = np.array(dense.program.points @ w).reshape(-1, 3, method.joints)
    assert problem.limits is not None
    return outside(problem.scene, problem.limits, x[:, 0], x[:, 1], x[:, 2])


@dataclass(frozen=True)
class Comparison:
    """A plan, and the point solve of hovi, against Ipopt on the same reach."""

    arm: str
    case: str
    number: int
    plan_seconds: float
    plan_cost: float
    point: PointSolve
    ipopt: IpoptRun


def compare(arm: str, armature: float, count: int, seed: int, folder: str) -> list[Comparison]:
    """Every reach of an arm against Ipopt."""
    scene = arm_scene(arm, armature)
    kernels, rows = compiled_kernels(scene, Path(folder)), []
    for number, reach in enumerate(random_reaches(scene, count, seed)):

        def plan(reach=reach, **options: object) -> tuple[float, hovi.Solution]:
            ends = reach.start, reach.goal, reach.duration
            return timed(
                lambda: hovi.plan(scene, *ends, processes=1, self_collision=False, **options)
            )

        plans = {"16 intervals": plan(intervals=16)}
        own = plans["16 intervals"][1].trajectory.grid.schemes[0]
        cases = [("16 intervals", 16, table, ()) for table in dict.fromkeys((galerkin(2), own))]
        if arm in SAMPLED:
            plans["defaults"] = plan()
            cases.append(("defaults", FINE, galerkin(2), MORE_SAMPLES))
        for setting, intervals, table, samples in cases:
            seconds, found = plans[setting]
            problem = limited_problem(scene, reach, intervals, table)
            peer = ipopt_solve(problem, kernels, samples)
            case = f"{setting} / {intervals} x {len(table.points) + len(samples)}"
            point = cold_point_solve(problem)
            rows.append(Comparison(arm, case, number, seconds, found.cost, point, peer))
            text = f"{arm} {number}, {case}: {seconds:.2f} s, {found.cost:.6g}; Ipopt"
            print(f"{text} {peer.seconds:.2f} s, {peer.cost:.6g}", file=sys.stderr, flush=True)
    return rows


def compared(rows: list[Comparison]) -> list[object]:
    """A row of the table: one arm and case."""
    good = [row for row in rows if row.ipopt.success]
    points = [row for row in good if row.point.success]
    gain = np.array([row.point.cost / row.ipopt.cost - 1 for row in points])
    costs = [abs(row.plan_cost / row.ipopt.cost - 1) for row in good]
    return [
        f"`{rows[0].arm}`, {rows[0].case}",
        f"{len(good)} of {len(rows)}",
        middle_and_most([row.ipopt.seconds for row in good]),
        middle_and_most([row.plan_seconds / row.ipopt.seconds for row in good]),
        middle_and_most([row.point.seconds / row.ipopt.seconds for row in points]),
        middle_and_most([row.ipopt.steps for row in good], ".0f"),
        middle_and_most([row.point.steps for row in points], ".0f"),
        middle_and_most(costs, ".0e"),
        f"{np.sum(gain < -CHEAPER)}, {np.sum(gain > CHEAPER)}",
        f"{max((row.ipopt.excess for row in good), default=np.nan):.0e}",
    ]


def against_ipopt(
    arms: list[str], armature: float, count: int, seed: int, folder: str | None
) -> None:
    """Print the table against Ipopt, and the reaches in which one finds the cheaper minimum."""
    rows: list[Comparison] = []
    with tempfile.TemporaryDirectory() as fresh:
        for arm in arms:
            rows += alone(compare, arm, armature, count, seed, folder or fresh)
    table = []
    for name in dict.fromkeys((row.arm, row.case) for row in rows):
        table.append(compared([row for row in rows if (row.arm, row.case) == name]))
    columns = ["arm, plan / Ipopt's intervals x points", "Ipopt's minima"]
    columns += ["Ipopt's CPU s: median, max", "plan / Ipopt: median, max"]
    columns += ["point solve / Ipopt: median, max", "Ipopt's steps", "point solve's steps"]
    columns += ["cost of plan / Ipopt - 1: median, max", "cheaper: point solve, Ipopt"]
    print_table([*columns, "Ipopt's largest excess"], table)
    for row in rows:
        name = f"- `{row.arm}` {row.number}, {row.case}"
        costs = f"Ipopt {row.ipopt.cost:.7g}, point solve {row.point.cost:.7g}"
        costs += f", plan {row.plan_cost:.7g}"
        if not (row.ipopt.success and row.point.success):
            word = "found a minimum" if row.point.success else "found none"
            print(f"{name}: Ipopt {row.ipopt.status}, the point solve {word}; {costs}")
        elif abs(row.point.cost / row.ipopt.cost - 1) > CHEAPER:
            who = "Ipopt" if row.point.cost > row.ipopt.cost else "the point solve"
            print(f"{name}: {who} is cheaper: {costs}")
    print()
