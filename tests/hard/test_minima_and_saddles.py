"""Hard cases 8 to 16: saddles, distant guesses, long durations, long chains, infeasibility."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from hard import naive
from hard.case import Case, Outcome, parameters
from hard.scenes import (
    HANG_JET,
    REACH,
    REACH_JET,
    START,
    UP,
    UP_JET,
    arm,
    hanging,
    links,
    problem,
    summary,
    uneven,
)
from hovi import Solution, Status, plan, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import HoviWarning
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.dense_action import DenseAction
from oracles.on_grid import solve_on_grid
from samples.paper_arm import HANG, REACH_COST

SCHEMES = "taylor-midpoint", "hermite-simpson", "galerkin-0", "galerkin-2"
LEVEL = np.zeros(4)
GRID: dict[str, Any] = {"scheme": "galerkin-2", "intervals": 16}


def minima(solutions: Sequence[Solution], *most: float) -> Outcome:
    """Whether all are minima with costs of at most `most`."""
    good = all(s.status is Status.MINIMUM and s.n_neg == 0 for s in solutions)
    cheap = all(s.cost <= cost for s, cost in zip(solutions, most, strict=False))
    return Outcome(summary(solutions), good and cheap)


def stationary(solutions: Sequence[Solution]) -> Outcome:
    """Whether all are minima of the discrete action, those included that their grid cannot carry.

    A light link spins: no grid resolves that, and the status says so.
    """
    told = (Status.MINIMUM, Status.UNRESOLVED)
    return Outcome(summary(solutions), all(s.status in told and s.n_neg == 0 for s in solutions))


def planned(scene: Scene, goal: Any, duration: float, **options: Any) -> Solution:
    """Plan from hanging, without limits, in one process."""
    start = hanging(scene)
    return plan(
        scene,
        start,
        goal,
        duration,
        **({"limits": "none", "processes": 1} | options),
        self_collision=False,
    )


def naive_runs(goal: np.ndarray, cases: Sequence[tuple[float, int]]) -> Callable[[], str]:
    """The literal implementation from hanging, for pairs of duration and intervals."""

    def run() -> str:
        parts = []
        for T, N in cases:
            found = naive.solve(naive.Problem.cubic(HANG_JET, goal, T, N), 1e-6)
            inertia = f", n_neg = {found.problem.n_neg}" if found.stopped == "converged" else ""
            parts.append(f"T = {T:g}: {found.summary}{inertia}")
        return "; ".join(parts)

    return run


def reaches() -> Outcome:
    found = [
        solve_on_grid(problem(arm(), START, REACH, 1.0, N, scheme))
        for N in (16, 32, 100)
        for scheme in SCHEMES
    ]
    best = solve_on_grid(problem(arm(), START, REACH, 1.0, 32))
    good = all(s.status is Status.MINIMUM and s.n_neg == 0 and s.nit <= 15 for s in found)
    close = abs(best.cost / REACH_COST - 1) <= 1e-9
    most = max(s.nit for s in found)
    shown = f"{len(found)} minima in at most {most} steps, J = {best.cost:.10f}"
    return Outcome(shown, good and close)


def naive_hold() -> str:
    found = naive.solve(naive.Problem.cubic(LEVEL, LEVEL, 10.0, 32), 1e-6)
    return f"{found.summary}, n_neg = {found.problem.n_neg}"


def hold() -> Outcome:
    level = State([0.0, 0.0])
    held = solve_on_grid(problem(arm(), level, level, 10.0, 32), escape_saddles=False)
    left = solve_on_grid(problem(arm(), level, level, 10.0, 32))
    known = held.status is Status.SADDLE and held.n_neg == 25 and abs(held.cost - 300.59) < 0.01
    good = left.status is Status.MINIMUM and left.n_neg == 0 and left.cost < 100
    return Outcome(summary([held, left]), known and good)


def swing_ups() -> Outcome:
    found = [planned(arm(), UP, T, intervals=32, starts=8) for T in (1.0, 5.0)]
    return minima(found, 67.3475, 3.3505)


def paper_swing_up() -> Outcome:
    return minima([planned(arm(), UP, 10.0, intervals=60, starts=48)], 0.7341)


def naive_ur5() -> str:
    task = load_task(example("ur5_reach"))
    found = plan(
        task.scene, task.start, task.goal, task.duration, limits="none", self_collision=False
    )
    return f"the cubic guess leads to J = {found.cost:.2f}"


def ur5_reach() -> Outcome:
    task = load_task(example("ur5_reach"))
    options: dict[str, Any] = {"limits": "none", "starts": 32, "processes": 1}
    return minima(
        [plan(task.scene, task.start, task.goal, task.duration, **options, self_collision=False)],
        56.15,
    )


def turns(
    *counts: int, starts: int, most: Sequence[float], intervals: int = 60
) -> Callable[[], Outcome]:
    def run() -> Outcome:
        goals = [State(-HANG + [2 * np.pi * k, 0.0]) for k in counts]
        options = {"intervals": intervals, "starts": starts}
        return minima([planned(arm(), g, 10.0, **options) for g in goals], *most)

    return run


def naive_turns() -> str:
    parts = []
    for k in (1, 5, 20):
        goal = UP_JET + np.array([2 * np.pi * k, 0, 0, 0])
        parts.append(
            f"k = {k}: {naive.solve(naive.Problem.cubic(HANG_JET, goal, 10.0, 200)).summary}"
        )
    return "; ".join(parts)


def long_times() -> Outcome:
    return stationary([planned(arm(), UP, T, intervals=120) for T in (50.0, 100.0)])


def resolved_long_time() -> Outcome:
    """On a grid that resolves the swings, many iterations follow a curved valley."""
    return minima([planned(arm(), UP, 100.0, intervals=800)])


def chains(*counts: int) -> Callable[[], Outcome]:
    """Reach a bent configuration in two seconds, and upright in three."""

    def run() -> Outcome:
        found = []
        for count in counts:
            scene = links(count)
            bent = np.full(count, 0.3)
            bent[0] = 0.2
            up = -hanging(scene)
            found += [planned(scene, bent, 2.0, **GRID), planned(scene, up, 3.0, **GRID)]
        return stationary(found)

    return run


def mass_ratios() -> Outcome:
    found = []
    for masses in ((1.0, 1e-6), (1.0, 1e6), (1.0, 1e-6, 1.0), (1.0, 1e6, 1.0)):
        scene = uneven(masses)
        up = -hanging(scene)
        reach = np.array([0.3, 0.7, 0.2])[: len(masses)]
        found += [planned(scene, reach, 1.0, **GRID), planned(scene, up, 3.0, **GRID)]
    return stationary(found)


def extreme_masses() -> Outcome:
    scene = uneven((1e6, 1e-6))
    ends = ([0.3, 0.7], 1.0), (-hanging(scene), 3.0)
    return stationary([planned(scene, *end, **GRID) for end in ends])


def direct(*scenes: Callable[[], Scene]) -> Callable[[], str]:
    """Swing-ups in three seconds, by full Newton steps from the cubic guess."""

    def run() -> str:
        parts = []
        for make in scenes:
            scene = make()
            ends = State(hanging(scene)), State(-hanging(scene))
            parts.append(naive.full_newton(problem(scene, *ends, 3.0, 16, "taylor-midpoint")))
        return "; ".join(parts)

    return run


def naive_elbow() -> str:
    cost = naive.Cost(elbow=1000.0)
    return naive.solve(naive.Problem.cubic(HANG_JET, UP_JET, 10.0, 200, cost)).summary


def elbow() -> Outcome:
    task = load_task(example("two_link_elbow"))
    grid = Grid.uniform(task.duration, 100, galerkin(2))
    found = plan(task.scene, task.start, task.goal, task.duration, limits="none", starts=4,
                 intervals=grid.intervals, processes=1)  # fmt: skip
    angle = np.degrees(found.trajectory.sample(np.linspace(0, task.duration, 5001)).q[:, 1])
    within = angle.min() >= -0.5 and angle.max() <= 170.5
    shown = f"{summary([found])}, elbow in {angle.min():.2f} to {angle.max():.2f} degrees"
    return Outcome(shown, minima([found], 3.66).passed and bool(within))


def naive_penalty() -> str:
    parts = []
    for rho in (1e2, 1e4, 1e6):
        cost = naive.Cost(penalty=rho)
        run = naive.solve(naive.Problem.cubic(LEVEL, LEVEL, 2.0, 32, cost), 1e-4)
        parts.append(f"rho = {rho:g}: {run.stopped} after {run.steps} steps, {torque(run):.3f} N m")
    return "; ".join(parts)


def torque(run: naive.Run) -> float:
    """The shoulder's torque in the first interval, in [N m]."""
    x, h = run.problem.x, run.problem.h
    (q0, v0), (q1, v1) = np.split(x[0], 2), np.split(x[1], 2)
    a = 2 / h**2 * (q1 - q0 - h * v0)
    return float(naive.torque((q0 + q1) / 2, (v0 + v1) / 2, a)[0])


def weak_motor() -> Outcome:
    limits = {"base": "none", "tau": 2.0, "q": [[-0.05, 0.05], [-0.05, 0.05]]}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "holding the robot still", HoviWarning)
        found = plan(arm(), [0.0, 0.0], [0.0, 0.0], 2.0, limits=limits, self_collision=False)
    named = all(word in found.message for word in ("shoulder", "torque", "at t = "))
    return Outcome(
        f"{found.status}: {found.message[:160]}", found.status is Status.INFEASIBLE and named
    )


CONJUGATE = {6.2: 0, 6.4: 1, 9.1: 2, 12.7: 3}
"""Horizons T and the numbers of roots of 2 - 2 cos T = T sin T below them: conjugate points."""


def oscillator(T: float) -> TrajectoryProblem:
    """The action of a^2/2 - v^2/2 over T on 64 intervals, between two states at rest."""
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    L = CasadiLagrangian([q, v, a], (ca.sumsqr(a) - ca.sumsqr(v)) / 2)
    ld = DiscreteLagrangian(L, Grid.uniform(T, 64, galerkin(2)))
    return TrajectoryProblem(ld, State([0.0]), State([0.1]))


def naive_conjugate() -> str:
    parts = []
    for T in CONJUGATE:
        given = oscillator(T)
        H = DenseAction(given, given.guess("cubic")).hessian
        b = np.random.default_rng(0).normal(size=len(H))
        residual = np.abs(H @ np.linalg.solve(H, b) - b).max() / np.abs(b).max()
        parts.append(f"residual {residual:.0e} at T = {T}")
    return "; ".join(parts) + ": converged after one step each"


def conjugate_points() -> Outcome:
    found = {T: solve(oscillator(T), seek="stationary") for T in CONJUGATE}
    shown = ", ".join(f"{s.status} with n_neg = {s.n_neg} at T = {T}" for T, s in found.items())
    good = all(found[T].success and found[T].n_neg == count for T, count in CONJUGATE.items())
    return Outcome(shown, good)


CASES = (
    Case(
        "8",
        "reaches from the cubic guess are minima on every grid and by every scheme",
        naive_runs(REACH_JET, [(1.0, 50), (1.0, 200)]),
        reaches,
        "n_neg = 0 in at most 15 steps, J = 20.2088008225",
    ),
    Case(
        "9",
        "holding the arm horizontal is recognized as a saddle and left",
        naive_hold,
        hold,
        "a saddle of J = 300.59 with n_neg = 25, and a minimum below 100",
    ),
    Case(
        "10",
        "swing-ups in one and in five seconds are minima",
        naive_runs(UP_JET, [(1.0, 100), (5.0, 100)]),
        swing_ups,
        "n_neg = 0, J at most 67.3475 and 3.3505",
    ),
    Case(
        "11a",
        "the paper's swing-up is found from many starts",
        naive_runs(UP_JET, [(10.0, 1000)]),
        paper_swing_up,
        "n_neg = 0, J at most 0.7341",
    ),
    Case(
        "11b",
        "the cheapest reach of the UR5 is found from many starts",
        naive_ur5,
        ur5_reach,
        "n_neg = 0, J at most 56.15",
    ),
    Case(
        "12a",
        "motions of 1 and 5 turns are found from many starts",
        naive_turns,
        turns(1, 5, starts=16, most=(1.388, 12.04)),
        "n_neg = 0, J at most 1.388 and 12.04",
    ),
    Case(
        "12b",
        "a motion of 20 turns is found from one start",
        naive_turns,
        turns(20, starts=1, most=(), intervals=240),
        "n_neg = 0",
    ),
    Case(
        "13a",
        "swing-ups in 50 and 100 seconds are minima",
        naive_runs(UP_JET, [(50.0, 120), (100.0, 120)]),
        long_times,
        "n_neg = 0",
    ),
    Case(
        "13b",
        "chains of 3 and 10 links reach and swing up",
        direct(lambda: links(3), lambda: links(10)),
        chains(3, 10),
        "n_neg = 0",
    ),
    Case(
        "13c",
        "a chain of 30 links reaches and swings up",
        direct(lambda: links(30)),
        chains(30),
        "n_neg = 0",
        long=True,
    ),
    Case(
        "13d",
        "links of a million to one and one to a million reach and swing up",
        direct(lambda: uneven((1.0, 1e-6)), lambda: uneven((1.0, 1e6))),
        mass_ratios,
        "n_neg = 0",
    ),
    Case(
        "13e",
        "links of a million million to one reach and swing up",
        direct(lambda: uneven((1e6, 1e-6))),
        extreme_masses,
        "n_neg = 0",
        long=True,
    ),
    Case(
        "13f",
        "a swing-up in 100 seconds is a minimum on 800 intervals",
        naive_runs(UP_JET, [(100.0, 800)]),
        resolved_long_time,
        "n_neg = 0",
        long=True,
    ),
    Case(
        "14",
        "the elbow is kept in its range by a smoothed potential",
        naive_elbow,
        elbow,
        "J at most 3.66, the elbow within 0.5 degrees of 0 to 170",
    ),
    Case(
        "15",
        "a hold beyond the motor's torque is infeasible",
        naive_penalty,
        weak_motor,
        "infeasible, with the joint and the time",
    ),
    Case(
        "16",
        "n_neg counts the conjugate points that a motion has passed",
        naive_conjugate,
        conjugate_points,
        "0, 1, 2, 3 at T = 6.2, 6.4, 9.1, 12.7 for a^2/2 - v^2/2",
    ),
)


@pytest.mark.parametrize("case", parameters(CASES))
def test_minima_and_saddles(case: Case) -> None:
    outcome = case.run()
    assert outcome.passed, f"{outcome.shown}; the requirement: {case.requirement}"
