"""Hard cases 1 to 7: rounding with small steps and with many steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from hard import naive
from hard.case import Case, Outcome, at_most, parameters
from hard.scenes import HANG_JET, REACH, REACH_JET, START, UP, UP_JET, arm, problem, summary
from hovi import Solution, Status
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import flow
from hovi.scene.standard_lagrangians import spline
from hovi.schemes import galerkin
from laws.test_splines import exact_recursion
from oracles.on_grid import solve_on_grid
from samples.long_flows import noether_errors, spline_error
from samples.paper_arm import HANG, REACH_COST

STEPS = 10.0 ** -np.arange(1, 9)
Q, V, A, J = 0.7, -0.3, 1.3, 0.4  # of a cubic


def naive_acceleration() -> str:
    found = []
    for h in STEPS:
        q1 = Q + h * V + h**2 * A / 2 + h**3 * J / 6
        found.append(abs(2 / h**2 * (q1 - Q - h * V) / (A + h * J / 3) - 1))
    return ", ".join(f"{found[i]:.1g} at h = {STEPS[i]:g}" for i in (2, 4, 7))


def propagated_acceleration() -> Outcome:
    errors = []
    for h in STEPS:
        ld = SchemeLagrangian(spline(1), galerkin(0), h)
        z = flow(ld, [[Q], [V]], [[-J], [A]], 1).z[0, 0, 0]
        errors.append(abs(2 * z / (A + h * J / 3) - 1))
    return at_most(max(errors), 1e-15)


def newton_reach(intervals: int) -> naive.Problem:
    return naive.Problem.cubic(HANG_JET, REACH_JET, 1.0, intervals)


def naive_floor() -> str:
    runs = {N: naive.solve(newton_reach(N), max_steps=12) for N in (100, 1000, 5000)}
    return "; ".join(f"residual {run.residual:.1g} at N = {N}" for N, run in runs.items())


def reference() -> Solution:
    """The reach on 200 intervals, accurate to round-off."""
    return solve_on_grid(problem(arm(), START, REACH, 1.0, 200, "galerkin-3"))


def fine_reach(intervals: int) -> Callable[[], Outcome]:
    def run() -> Outcome:
        exact = reference().trajectory
        found = solve_on_grid(problem(arm(), START, REACH, 1.0, intervals))
        share = intervals // 200
        errors = [
            np.abs(getattr(found.trajectory, name)[::share] - getattr(exact, name)).max()
            for name in ("q", "v")
        ]
        good = found.status is Status.MINIMUM and found.nit <= 15 and max(errors) <= 1e-10
        return Outcome(f"{found.nit} steps, q and v right to {max(errors):.1g}", bool(good))

    return run


def naive_recursion() -> str:
    parts = []
    for N in (10_000, 1_000_000):
        h = 1.0 / N
        exact = np.array([[Q + V * t + A * t**2 / 2 + J * t**3 / 6, V + A * t + J * t**2 / 2]
                          for t in (0.0, h, 1.0)])  # fmt: skip
        x, y, R = exact[0], exact[1], exact_recursion(h)
        for _ in range(N - 1):
            x, y = y, R @ np.concatenate([x, y])
        parts.append(f"off by {abs(y[0] - exact[2, 0]):.1g} after {N:.0e} steps")
    return "; ".join(parts)


def long_spline(steps: int) -> Callable[[], Outcome]:
    return lambda: at_most(spline_error(steps, 1.0 / steps), 1e-11)


def naive_step_test() -> str:
    # |step| <= 1e-10 |x|, with the iterate itself as the scale
    runs = naive.Problem.cubic(HANG_JET, UP_JET, 10.0, 1000)
    largest = 0.0
    with np.errstate(all="ignore"):
        for steps in range(200):
            _, residual, blocks = runs.expansion
            if not np.isfinite(residual).all():
                return f"NaN after {steps} steps, |q| up to {largest:.1g}"
            step = runs.newton(residual, blocks)
            largest = np.abs(runs.x).max()
            if np.abs(step).max() <= 1e-10 * largest:
                return f"|q| = {largest:.1g} called converged after {steps} steps"
    return f"still running, |q| = {largest:.1g}"


def bounded_swing_up() -> Outcome:
    found = solve_on_grid(problem(arm(), START, UP, 10.0, 100))
    largest = np.abs(found.trajectory.q).max()
    good = found.status is Status.MINIMUM and largest < 100 and np.isfinite(found.cost)
    return Outcome(f"{summary([found])}, |q| <= {largest:.2g}", bool(good))


TIMES = {1e-3: 3.1359672e10, 1e-2: 3.12936e7, 1e-1: 3.0494e4}


def naive_short() -> str:
    runs = [naive.solve(naive.Problem.cubic(HANG_JET, REACH_JET, T, 100)) for T in TIMES]
    return "; ".join(f"{run.summary}, residual {run.residual:.1g}" for run in runs)


def short_times() -> Outcome:
    found = [solve_on_grid(problem(arm(), START, REACH, T, 32)) for T in TIMES]
    good = all(s.status is Status.MINIMUM and s.nit <= 15 for s in found)
    close = [abs(s.cost / cost - 1) <= 2e-5 for s, cost in zip(found, TIMES.values(), strict=True)]
    return Outcome(summary(found), good and all(close))


def naive_rest() -> str:
    run = naive.Problem.cubic(HANG_JET, HANG_JET, 3.0, 100)
    cost, residual, blocks = run.expansion
    with np.errstate(all="ignore"):
        share = np.abs(residual).max() / cost
    step = run.newton(residual, blocks)
    return f"residual over cost {share:.1g}, and a step of {np.abs(step).max():.1g} follows"


def rest() -> Outcome:
    found = solve_on_grid(problem(arm(), START, START, 3.0, 32))
    good = found.success and found.nit <= 1 and abs(found.cost) < 1e-25
    return Outcome(summary([found]), good)


def naive_noether() -> str:
    parts = []
    for N in (200, 10_000):
        best = solve_on_grid(
            problem(arm(False), START, REACH, 1.0, N, "taylor-midpoint")
        ).trajectory
        nodes = naive.Problem(np.hstack([best.q, best.v]), 1.0 / N, naive.Cost(gravity=False))
        p = nodes.momenta[:, 0]
        parts.append(f"spread {np.ptp(p) / np.abs(p).max():.1g} at N = {N}")
    return "; ".join(parts)


def noether_of_the_flow(steps: int) -> Callable[[], Outcome]:
    def run() -> Outcome:
        propagated, minus, plus = noether_errors(arm(False), steps)
        reevaluated = max(minus, plus) / steps
        shown = f"propagated {propagated:.1g}; re-evaluated {reevaluated:.1g}/h"
        return Outcome(shown, propagated <= 1e-12 and reevaluated <= 1e-13)

    return run


def noether_of_the_reach(intervals: int) -> Callable[[], Outcome]:
    """Noether's momentum along a planned motion, with momenta from the boundary value problem."""

    def run() -> Outcome:
        posed = problem(arm(False), START, REACH, 1.0, intervals)
        motion = solve_on_grid(posed).trajectory
        p, size = motion.momenta, np.abs(motion.momenta).max(axis=(0, 2))[:, None]
        D = posed.ld.derivatives(motion.path)
        spread = np.ptp(p[:, 0, 0]) / np.abs(p[:, 0, 0]).max()
        reevaluated = max(
            np.abs((D[:, 2:] - p[1:]) / size).max(), np.abs((D[:, :2] + p[:-1]) / size).max()
        )
        shown = f"propagated {spread:.1g}; re-evaluated {reevaluated / intervals:.1g}/h"
        return Outcome(shown, bool(spread <= 1e-12 and reevaluated <= 1e-13 * intervals))

    return run


CASES = (
    Case(
        "1",
        "the acceleration of an interval keeps its digits at every step length",
        naive_acceleration,
        propagated_acceleration,
        "relative error at most 1e-15 from h = 0.1 to 1e-8",
    ),
    Case(
        "2a",
        "a reach on 2,000 intervals converges to the accurate motion",
        naive_floor,
        fine_reach(2000),
        "at most 15 steps, q and v right to 1e-10",
    ),
    Case(
        "2b",
        "a reach on 100,000 intervals converges to the accurate motion",
        naive_floor,
        fine_reach(100_000),
        "at most 15 steps, q and v right to 1e-10",
        long=True,
    ),
    Case(
        "3a",
        "a spline stays accurate over 3,000 short steps",
        naive_recursion,
        long_spline(3_000),
        "off by at most 1e-11",
    ),
    Case(
        "3b",
        "a spline stays accurate over a million short steps",
        naive_recursion,
        long_spline(1_000_000),
        "off by at most 1e-11",
        long=True,
    ),
    Case(
        "4",
        "a diverging motion is not reported as converged",
        naive_step_test,
        bounded_swing_up,
        "a minimum of finite cost, |q| < 100",
    ),
    Case(
        "5",
        "reaches in a millisecond to a tenth of a second are minima",
        naive_short,
        short_times,
        "J = 3.13597e10, 3.12936e7, 3.0494e4 within 2e-5, n_neg = 0, at most 15 steps",
    ),
    Case(
        "6",
        "staying at rest converges in one step",
        naive_rest,
        rest,
        "a minimum of cost below 1e-25 in at most one step",
    ),
    Case(
        "7a",
        "without gravity the shoulder's momentum is constant along a flow of 1,000 steps",
        naive_noether,
        noether_of_the_flow(1000),
        "propagated 1e-12; re-evaluated from the stored z 1e-13/h",
    ),
    Case(
        "7b",
        "without gravity the shoulder's momentum is constant along a flow of 10,000 steps",
        naive_noether,
        noether_of_the_flow(10_000),
        "propagated 1e-12; re-evaluated from the stored z 1e-13/h",
        long=True,
    ),
    Case(
        "7c",
        "without gravity it is constant along a planned motion on 2,000 intervals",
        naive_noether,
        noether_of_the_reach(2000),
        "propagated 1e-12; re-evaluated from the stored z 1e-13/h",
    ),
    Case(
        "7d",
        "without gravity it is constant along a planned motion on 100,000 intervals",
        naive_noether,
        noether_of_the_reach(100_000),
        "propagated 1e-12; re-evaluated from the stored z 1e-13/h",
        long=True,
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_rounding(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"


def test_the_reference_of_the_fine_reaches_is_the_known_minimum() -> None:
    assert reference().cost == pytest.approx(REACH_COST, rel=1e-10)
    np.testing.assert_array_equal(reference().trajectory.q[0], HANG)
