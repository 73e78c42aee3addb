"""Do plans meet the accuracy that they claim? Tolerances from 1e-2 to 1e-6 on six arms.

Four random reaches of each arm, drawn as in resolved_reaches.py, within the limits of the URDF, and
half as far without limits, each to five tolerances. No other table of accuracies has these arms.
The true error of the cost is its distance from a solve on a finer grid from the same motion: every
interval halved with four more modes, or with limits cut into four, with limits that hold to a tenth
of hovi's own tolerance, which alone moves the cost by up to 1e-5.

    python tolerance_claims.py [ARM ...] [--count 4] [--seed 0]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace

import numpy as np
from measuring import print_machine, print_table
from twelve_arms import load, reaches

import hovi
from hovi.planning.solver.solver import solve_on_grid

ARMS = ("so100", "bravo7_no_ee", "tiago", "baxter", "alex_nub_hands", "kinova")
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
TIME_LIMIT = 300.0
"""Time limit of a plan, in [s]."""
FACTOR = 3.0
"""Ratio of estimate and true error up to which they agree."""
TIGHTER = 0.1
"""Tolerance of limits of the reference, over the plan's."""
LEAST_ERROR = 1e-13
"""Relative errors below this count as equal, as rounding hides them."""


@dataclass(frozen=True)
class Claim:
    """What a plan claims of its cost, and the true error; NaN if unknown."""

    arm: str
    limits: str
    tolerance: float
    status: str
    reached: bool
    estimate: float
    true: float

    @property
    def is_false(self) -> bool:
        """Whether a reached tolerance is missed."""
        return self.reached and self.true > self.tolerance

    @property
    def is_near(self) -> bool:
        """Whether estimate and true error agree within FACTOR."""
        low, high = sorted(max(error, LEAST_ERROR) for error in (self.estimate, self.true))
        return high <= FACTOR * low


def measure(arm: str, limits: str, count: int, seed: int) -> list[Claim]:
    """The claims of an arm."""
    scene, claims = load(arm), []
    for start, goal, T in reaches(scene, count, seed):
        if limits == "none":
            goal = scene.robot.integrate(start, 0.5 * scene.robot.difference(start, goal))
        for tolerance in TOLERANCES:
            plan = hovi.plan(
                *(scene, start, goal, T),
                limits=limits,
                tolerance=tolerance,
                time_limit=TIME_LIMIT,
                self_collision=False,
            )
            reached = plan.accuracy is not None and plan.accuracy.reached
            true = _true_error(plan) if plan.success else np.nan
            estimate = np.nan if plan.error_estimate is None else plan.error_estimate
            row = Claim(arm, limits, tolerance, str(plan.status), reached, estimate, true)
            claims.append(row)
            print(row, file=sys.stderr, flush=True)
    return claims


def _true_error(plan: hovi.Solution) -> float:
    """The relative distance of the cost from that of a finer solution near the plan."""
    problem, grid = plan.problem, plan.problem.grid.halved()
    if not problem.limited:
        reference = problem.on(grid.enriched(4))
    else:
        limits = replace(problem.limits, tolerance=TIGHTER * problem.limits.tolerance)
        reference = replace(problem, limits=limits).on(grid.halved())
    finer = solve_on_grid(reference, plan.trajectory, max_iterations=2000)
    return abs(plan.cost / finer.cost - 1) if finer.success else np.nan


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*")
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    claims = [
        claim
        for limits in ("none", "urdf")
        for arm in args.arms or ARMS
        for claim in measure(arm, limits, args.count, args.seed)
    ]
    columns = ["limits", "tolerance", "minima", "reached", "missed", f"within {FACTOR:g}"]
    kinds = [(limits, tolerance) for limits in ("none", "urdf") for tolerance in TOLERANCES]
    print_table(columns, [_summary(claims, *kind) for kind in kinds])
    print(f"{len(claims)} plans, {sum(c.is_false for c in claims)} of them miss what they claim;")
    print(f"estimate and true error within {FACTOR:g}: {_agreement(claims)}.\n")
    print_machine(threads=1)
    raise SystemExit(any(c.is_false for c in claims))


def _summary(claims: list[Claim], limits: str, tolerance: float) -> list[object]:
    """A row of the table."""
    own = [c for c in claims if (c.limits, c.tolerance) == (limits, tolerance)]
    return [
        limits,
        f"{tolerance:.0e}",
        f"{sum(c.status == 'minimum' for c in own)} of {len(own)}",
        sum(c.reached for c in own),
        sum(c.is_false for c in own),
        _agreement(own),
    ]


def _agreement(claims: list[Claim]) -> str:
    """How many of the known true errors agree with their estimate."""
    known = [c for c in claims if np.isfinite(c.true)]
    return f"{sum(c.is_near for c in known)} of {len(known)}"


if __name__ == "__main__":
    main()
