"""A UR5 along its velocity limits, planned again from noisy measurements at every step.

The arm goes from one side to the other in little more than the least time, so that some joint is at
its velocity limit nearly all the time. Every 10 ms `Solution.advance` goes on from the motion's own
state with noise of 1e-5 rad and 1e-3 rad/s, as a sensor would give it; when little of the motion is
left, or the arm brakes, the motion to the other side begins. A call counts as new if its motion
starts at the given state and is usable, as braking if it comes to rest from there instead, and as
neither otherwise. Excesses are those that the start forces, and what 2,000 samples of each tenth
motion are over the limits, relative to their ranges, beyond what is excused. With a time limit a
call is late if it ends after 1.2 times that, and calls count only where their processor time is at
least 0.9 of their wall time, as the machine does something else in the others.

    python receding_noise.py [--calls 10000] [--limits 0.02 0.05 0.1] [--seed 0]
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Sequence

import numpy as np
from measuring import alone, print_machine, print_table

import hovi
from hovi.planning.solver.receding.braking import BRAKES

HOME = np.array([0.0, -1.2, 1.5, -0.3, 0.5, 0.0])
AWAY = HOME + np.array([2.6, 1.0, -1.5, 2.0, 1.0, 2.6])
DURATION, STEP, REST = 1.2, 0.01, 0.3
"""Of a motion from side to side, of a call, and what is left when the next one begins, in [s]."""
NOISE = 1e-5, 1e-3
"""Of positions in [rad], and of velocities in [rad/s]."""
POINTS = 10_000
"""Of the kernel, whose time is printed next to those of the calls."""
CHECKED, SAMPLES = 10, 2_000
"""Every which motion is checked, and at how many samples."""


def over(solution: hovi.Solution) -> float:
    """The largest excess over a limit at samples beyond what is excused, relative to its range."""
    motion, worst = solution.trajectory, 0.0
    t = np.linspace(0.0, motion.duration, SAMPLES)
    sample, limits = motion.sample(t), solution.problem.limits
    for row, kind in enumerate(("q", "v", "a", "tau")):
        y = getattr(sample, kind)
        beyond = np.maximum(y - limits.upper[row], limits.lower[row] - y)
        for each in solution.excused:
            if each.limit == kind:
                joint = motion.coordinate_names.index(each.joint)
                beyond[t < each.until, joint] -= each.excess
        worst = max(worst, float((beyond / limits.ranges[row]).max()))
    return worst


def measured(limit: float | None, calls: int, seed: int) -> dict[str, object]:
    """Counts, excesses and times of some calls. limit: of time, in [s]; None for none."""
    warnings.simplefilter("ignore")
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    laps = [
        hovi.plan(scene, *ends, DURATION, self_collision=False)
        for ends in ((HOME, AWAY), (AWAY, HOME))
    ]
    goals, rng = [hovi.State(AWAY), hovi.State(HOME)], np.random.default_rng(seed)
    kinds, forced, found, times = [], [], [], []
    lap, motion, passed = 0, laps[0], 0.0
    for call in range(calls):
        if motion.trajectory.duration - passed < REST:
            lap = 1 - lap
            motion, passed = laps[lap], 0.0
        passed += STEP
        at = motion.trajectory.sample([passed])
        q = at.q[0] + NOISE[0] * rng.standard_normal(6)
        state = hovi.State(q, at.v[0] + NOISE[1] * rng.standard_normal(6))
        wall, processor = time.perf_counter(), time.process_time()
        new = motion.advance(passed, state, goals[lap], time_limit=limit)
        times.append((time.perf_counter() - wall, time.process_time() - processor))
        kinds.append(kind_of(new, q))
        forced.append(max((each.excess for each in new.excused), default=0.0))
        if kinds[-1] == "neither":
            continue  # on with the last motion
        if call % CHECKED == 0:
            found.append(over(new))
        if kinds[-1] == "braking":
            lap = 1 - lap
        motion, passed = (new if kinds[-1] == "new" else laps[lap]), 0.0
    return {"kinds": kinds, "forced": forced, "found": found, "times": times, "kernel": kernel()}


def kind_of(solution: hovi.Solution, q: np.ndarray) -> str:
    """What became of a call from a configuration."""
    starts = np.abs(solution.trajectory.q[0] - q).max() <= 1e-5
    if not (starts and solution.usable):
        return "neither"
    return "braking" if BRAKES in solution.message else "new"


def kernel() -> float:
    """The processor time of the UR5 kernel at 10,000 points, in [s]."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    lagrangian, rng = scene.effort_lagrangian(), np.random.default_rng(0)
    q, v, a = rng.uniform(-1, 1, (3, POINTS, 6))
    times = []
    for _ in range(10):
        began = time.process_time()
        lagrangian.evaluate(q, v, a)
        times.append(time.process_time() - began)
    return min(times)


def row(limit: float | None, of: dict[str, object]) -> list[str]:
    """A row of the table."""
    kinds, times = np.array(of["kinds"]), np.array(of["times"])
    forced, found = np.array(of["forced"]), np.array(of["found"])
    counted = times[:, 1] >= (-np.inf if limit is None else 0.9) * times[:, 0]
    kinds, times, forced = kinds[counted], times[counted], forced[counted]
    late = times[:, 0] > 1.2 * (np.inf if limit is None else limit)
    percent = [f"{100 * np.mean(kinds == each):.2f}" for each in ("new", "braking", "neither")]
    median, most = np.quantile(times[:, 1], [0.5, 0.99])
    return [
        "none" if limit is None else f"{1e3 * limit:g} ms",
        f"{len(kinds)}",
        *percent,
        f"{100 * (forced > 0).mean():.0f}",
        f"{forced.max():.1e}",
        f"{max(found.max(initial=0.0), 0.0):.0e}",
        f"{1e3 * median:.0f}, {1e3 * most:.0f}",
        f"{median / of['kernel']:.1f}",
        "-" if limit is None else f"{100 * late.mean():.1f}",
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--calls", type=int, default=10_000)
    parser.add_argument(
        "--limits", type=float, nargs="*", default=[0.02, 0.05, 0.1], help="In [s]."
    )
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    print_machine(1)
    limits = [None, *given.limits]
    rows = [row(each, alone(measured, each, given.calls, given.seed)) for each in limits]
    header = [
        "time limit",
        "calls",
        "new, %",
        "braking, %",
        "neither, %",
        "led back, %",
        "largest forced excess, rad/s",
        "over, of the range",
        "time, ms: median, 99 %",
        "median / kernel",
        "late, %",
    ]
    print_table(header, rows)


if __name__ == "__main__":
    main()
