"""Replanning within limits: the goal moves, or the motion goes on from 10 ms further along it.

In the last rows `Solution.advance` shifts the motion along its time, undisturbed, or after a push:
by up to 1e-4 rad and 1e-3 rad/s in every joint.

Every answer is checked at 50,000 samples with torques of pin.rnea, and its cost is compared with a
cold solve on its grid, if both are the same motion. A minimum that vanished is one from which the
answer is far away, or where there is none: such answers are counted and left out of the quantiles.
With the Python of an environment with Crocoddyl (see work_precision.py), given here or by
HOVI_CROCODDYL_PYTHON, a row of its BoxFDDP for the same goals.

    python limited_replanning.py [--laps 40] [--crocoddyl PYTHON]
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from measuring import alone, print_machine, print_table
from random_arms import largest_excess, timed
from replanning import goals

import hovi
from hovi.accuracy import Setting
from hovi.accuracy.guess_motion import guess_curve
from hovi.accuracy.peers.external_method import scene_request
from hovi.accuracy.peers.worker_client import Worker
from hovi.planning.solver.solver import solve_on_grid

Array = npt.NDArray[np.float64]

SCENES = ("ur5_reach_limited", "panda_reach_limited")
MOVES = (0.005, 0.05)
AHEAD = 0.01
"""How far the motion goes on, in [s]."""
PUSHES = 0.0, 1e-4
"""Sizes of the disturbances then, in [rad], and per 0.1 s."""
FAR = 20.0
"""Distance from the last motion, in moves, beyond which the minimum has vanished."""
SAME = 1e-3
"""Distance of q of two motions, in [rad], up to which they are the same minimum."""
KNOTS = 40
"""Of BoxFDDP: those of ur5_reach_limited."""


def measure(scene: str, move: float, laps: int) -> dict[str, object]:
    """Answers to a row of changes of the goal; move: their size, in [rad]."""
    task = hovi.load_task(hovi.example(scene))
    solution = hovi.plan_task(task)
    assert solution.success, solution.message
    rows = []
    for goal in goals(np.asarray(task.goal.q), move, laps):
        last = solution
        seconds, solution = timed(lambda last=last, goal=goal: last.replan(goal=hovi.State(goal)))
        rows.append(_answer(last, solution, seconds, 0.0, FAR * move))
        if not solution.success:
            print(f"{scene}, {move}: {solution.message}", file=sys.stderr, flush=True)
            solution = last
    return _summary(rows)


def measure_advance(scene: str, push: float, laps: int) -> dict[str, object]:
    """Answers to a row of pushes on the way; push: their size, in [rad], and per 0.1 s."""
    solution = hovi.plan_task(hovi.load_task(hovi.example(scene)))
    assert solution.success, solution.message
    rows, random, passed = [], np.random.default_rng(0), 0.0
    for _ in range(laps):
        last, passed = solution, passed + AHEAD
        state = _pushed(last, passed, push, random)
        seconds, solution = timed(partial(last.advance, passed, state))
        rows.append(_answer(last, solution, seconds, passed, FAR * max(push, SAME)))
        if solution.success:
            passed = 0.0
        else:
            print(f"{scene}, push {push}: {solution.message}", file=sys.stderr, flush=True)
            solution = last
    return _summary(rows)


def _pushed(
    solution: hovi.Solution, t: float, push: float, random: np.random.Generator
) -> hovi.State:
    """The state of a motion at a time after a push, within the velocity limits."""
    x, limits = solution.trajectory.sample(np.array([t])), solution.problem.limits
    dq, dv = push * random.uniform(-1, 1, (2, x.q.shape[1]))
    return hovi.State(x.q[0] + dq, np.clip(x.v[0] + 10 * dv, limits.lower[1], limits.upper[1]))


def _answer(
    last: hovi.Solution, now: hovi.Solution, seconds: float, shift: float, largest: float
) -> dict[str, float]:
    """One answer: what it took, what it exceeds, and how its cost differs from a cold solve's.

    shift: of the motion along its time, in [s]. largest: distance within which it is the same one.
    """
    problem = now.problem
    assert problem is not None
    assert problem.limits is not None
    moved = distance(last.trajectory, now.trajectory, shift)
    return {
        "steps": now.nit,
        "seconds": seconds,
        "vanished": not now.success or moved > largest,
        "excess": largest_excess(problem.scene, now.trajectory, problem.limits),
        "difference": cold_difference(now),
    }


def cold_difference(solution: hovi.Solution) -> float:
    """Relative difference of the cost from a cold solve on the same grid; nan if elsewhere.

    From the cubic guess, or from the motion itself if that leads elsewhere.
    """
    for guess in ("cubic", solution.trajectory.path):
        cold = solve_on_grid(solution.problem, guess)
        if cold.success and distance(cold.trajectory, solution.trajectory) < SAME:
            return abs(solution.cost / cold.cost - 1)
    return np.nan


def distance(a: hovi.Trajectory, b: hovi.Trajectory, shift: float = 0.0) -> float:
    """The largest difference of q(t + shift) of a and q(t) of b, in [rad]."""
    t = np.linspace(0.0, min(a.duration - shift, b.duration), 201)
    return float(np.abs(a.sample(t + shift).q - b.sample(t).q).max())


def _summary(rows: list[dict[str, float]]) -> dict[str, object]:
    kept = [row for row in rows if not row["vanished"]]
    differences = [row["difference"] for row in kept if np.isfinite(row["difference"])]
    return {
        "steps": quantiles([row["steps"] for row in kept], ".0f"),
        "ms": quantiles([1e3 * row["seconds"] for row in kept], ".3g"),
        "vanished": f"{len(rows) - len(kept)} of {len(rows)}",
        "excess": f"{max(row['excess'] for row in rows):.0e}",
        "cost": f"{max(differences):.0e} ({len(differences)})" if differences else "-",
    }


def quantiles(values: list[float], form: str) -> str:
    """The median and the 90 % point as text."""
    if not values:
        return "-"
    return ", ".join(f"{np.quantile(values, fraction):{form}}" for fraction in (0.5, 0.9))


def measure_box_fddp(scene: str, move: float, laps: int, python: str) -> dict[str, object]:
    """Crocoddyl's BoxFDDP for the same goals: limits on torques only."""
    task = hovi.load_task(hovi.example(scene))
    planned = hovi.plan_task(task)
    problem = planned.problem
    assert problem is not None
    guess = guess_curve("near", problem, planned.trajectory)
    options = {"control": "zero", "torque_limits": problem.limits.upper[3].tolist()}
    setting = Setting(problem, guess, guess, clock="processor")
    worker = Worker(Path(python), "crocoddyl_worker")
    try:
        worker.ask(scene_request(setting) | {"options": options})
        t = np.linspace(0.0, problem.grid.duration, 2 * KNOTS + 1)
        q, v, a = (x.tolist() for x in guess(t))
        worker.ask({"prepare": KNOTS, "guess": {"q": q, "v": v, "a": a}})
        worker.ask({"solve": KNOTS})
        answers = [
            worker.ask({"solve": KNOTS, "goal": [*goal, *np.zeros(len(goal))]})
            for goal in goals(np.asarray(task.goal.q), move, laps)
        ]
    finally:
        worker.close()
    good = [answer for answer in answers if answer["success"]]
    return {
        "steps": quantiles([answer["steps"] for answer in good], ".0f"),
        "ms": quantiles([1e3 * answer["seconds"] for answer in good], ".3g"),
        "vanished": f"{len(answers) - len(good)} of {len(answers)}",
        "excess": f"velocity {_speed_excess(good, problem.limits):.0e}",
        "cost": "-",
    }


def _speed_excess(answers: list[dict[str, object]], limits: hovi.Limits) -> float:
    """Largest excess over a velocity limit at the knots, as a fraction of its range."""
    v = np.abs([answer["v"] for answer in answers]).max(axis=(0, 1), initial=0.0)
    return float(np.max((v - limits.upper[1]) / (2 * limits.upper[1])))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--laps", type=int, default=40)
    parser.add_argument("--crocoddyl", default=os.environ.get("HOVI_CROCODDYL_PYTHON"))
    given = parser.parse_args()
    table = []

    def add(name: str, function: Callable[..., dict[str, object]], *arguments: object) -> None:
        table.append([name, *alone(function, *arguments).values()])

    for scene in SCENES:
        for move in MOVES:
            name = f"`{scene}`, goal moved by {move:g} rad"
            add(name, measure, scene, move, given.laps)
            if given.crocoddyl:
                peer = f"the same, BoxFDDP, {KNOTS} knots, torque limits only"
                add(peer, measure_box_fddp, scene, move, given.laps, given.crocoddyl)
        for push in PUSHES:
            pushed = f" after a push of {push:g} rad" if push else ""
            name = f"`{scene}`, {1e3 * AHEAD:g} ms along the motion{pushed}"
            add(name, measure_advance, scene, push, given.laps)
    print(f"`replan` and `advance` within limits, {given.laps} changes in a row, one thread.\n")
    columns = ["scene", "steps: median, 90 %", "CPU ms: median, 90 %", "vanished or no minimum"]
    columns += ["largest excess, of the range", "cost / cold solve's - 1: largest (compared)"]
    print_table(columns, table)
    print_machine(threads=1)


if __name__ == "__main__":
    main()
