"""Motions of least effort and jerk: the weight, hovi against Ipopt, and smooth moves of a Panda.

- The move of panda_lift.toml with several weights of the jerk.
- The reach of ur5_reach.toml with a cost on the jerk: hovi against CasADi and Ipopt with the jerk
  as control, in the same transcription, on grids with an error of 1e-7 and 1e-9 of the cost.
- Random moves of a Panda that lifts 2 kg, with smooth = true, within the limits that its maker
  publishes on q, v, a, jerk, torque and torque rate; everything is checked at 50,001 samples.

    python jerk_cost.py [weights] [ipopt] [moves] [--moves 20] [--seed 0]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from measuring import alone, best_time, print_machine, print_table
from transcription import Transcription

import hovi
from hovi.dynamics.torque_rate import TorqueRate
from hovi.planning.problem.limits import as_limits
from hovi.planning.solver.solver import solve_on_grid
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]

WEIGHT = 0.003
"""Of the jerk in the comparison: about (0.01 T M)^2 of the UR5."""
GRIDS = ((2, 12), (2, 16), (3, 12), (3, 16), (4, 12), (4, 16), (4, 24))
"""Inner modes and intervals."""
ACCURACIES = (1e-7, 1e-9)
SAMPLES = 50_001
ACCELERATIONS = [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]
"""The limits on a of the set "panda"."""
ARM = "panda"
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]
LIMITS = "panda"
"""The limit set of the arm."""
FRACTIONS = (0.002, 0.005, 0.01, 0.02, 0.05)
"""Smoothing times of the heaviest joint, of the duration; `smooth` has the middle one."""
STATIC_FRACTION, DURATIONS = 0.9, (1.5, 3.0)
"""Largest static torque at the ends, of its limit; durations, in times at the velocity limits."""


def reach() -> tuple[hovi.Scene, hovi.State, hovi.State, float]:
    """The reach of ur5_reach.toml with a cost on the jerk."""
    task = hovi.load_task(hovi.example("ur5_reach"))
    effects = [*task.scene.effects, hovi.effects.JerkCost(WEIGHT)]
    assert isinstance(task.goal, hovi.State)
    assert isinstance(task.duration, float)
    return hovi.Scene(task.scene.robot, effects), task.start, task.goal, task.duration


def problem_on(modes: int, intervals: int) -> hovi.TrajectoryProblem:
    """The reach on a grid of order 3."""
    scene, start, goal, T = reach()
    grid = hovi.Grid.uniform(T, intervals, galerkin(modes, 3))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, start, goal)


def compared(modes: int, intervals: int, reference: float) -> dict[str, float]:
    """Costs, steps and times of hovi and of Ipopt on one grid, from the Hermite polynomial."""
    problem = problem_on(modes, intervals)
    path = problem.guess("cubic")
    ours = solve_on_grid(problem, path)
    assert ours.success, ours.message
    row = {"steps": ours.nit, "seconds": best_time(lambda: solve_on_grid(problem, path))}
    row["error"] = abs(ours.cost / reference - 1)
    transcription = Transcription(problem)
    guess = transcription.arguments("cubic")
    with tempfile.TemporaryDirectory() as folder:
        for name, solver in (
            ("compiled", transcription.compiled(Path(folder))),
            ("interpreted", transcription.interpreted()),
        ):
            found = solver(**guess)
            assert solver.stats()["success"], solver.stats()["return_status"]
            row[name] = best_time(lambda solver=solver: solver(**guess))
            row["ipopt steps"] = solver.stats()["iter_count"]
            row["same"] = abs(float(found["f"]) / ours.cost - 1)
    return row


def compare() -> None:
    """The table of the comparison."""
    finest = solve_on_grid(problem_on(8, 48))
    rows, results = [], []
    for modes, intervals in GRIDS:
        row = alone(compared, modes, intervals, finest.cost)
        results.append(row)
        rows.append(
            [
                f"`galerkin-{modes}-k3`, {intervals}",
                f"{row['error']:.0e}",
                f"{row['steps']:.0f}",
                f"{1e3 * row['seconds']:.2f}",
                f"{row['ipopt steps']:.0f}",
                f"{row['compiled'] / row['seconds']:.1f}",
                f"{row['interpreted'] / row['seconds']:.1f}",
                f"{row['same']:.0e}",
            ]
        )
    header = [
        *("scheme, intervals", "error of the cost", "steps", "hovi [ms]", "steps of Ipopt"),
        *("time / hovi's, compiled", "interpreted", "difference of costs"),
    ]
    print_table(header, rows)
    for accuracy in ACCURACIES:
        fit = [row for row in results if row["error"] <= accuracy]
        ours = min(row["seconds"] for row in fit)
        print(
            f"- At {accuracy:.0e} on the cheapest grid of each: Ipopt, compiled, takes "
            f"{min(row['compiled'] for row in fit) / ours:.1f} times hovi's time."
        )
    print()


def moves(count: int, seed: int) -> None:
    """The table of the smooth moves."""
    rows = [alone(moved, number, seed) for number in range(count)]
    header = [
        *("move", "T [s]", "status", "steps", "wall [s]", "intervals", "error estimate"),
        *("largest acceleration at an end [rad/s^2]", "largest excess over a limit, of its range"),
    ]
    table = [
        [
            str(number),
            f"{row['T']:.2f}",
            row["status"],
            str(row["nit"]),
            f"{row['seconds']:.2f}",
            str(row["intervals"]),
            f"{row['estimate']:.0e}",
            f"{row['ends']:.0e}",
            f"{row['excess']:.0e}",
        ]
        for number, row in enumerate(rows)
    ]
    print_table(header, table)
    seconds = [row["seconds"] for row in rows]
    minima = sum(row["status"] == "minimum" for row in rows)
    print(
        f"- {minima} minima of {count}; median {np.median(seconds):.2f} s, longest "
        f"{max(seconds):.2f} s."
    )


def moved(number: int, seed: int) -> dict[str, object]:
    """One random move: planned once to load everything, then timed and checked."""
    robot = hovi.load_robot(ARM, locked=FINGERS)
    payload = hovi.effects.Payload("panda_hand_tcp", 2.0)
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), payload])
    limits = as_limits(robot, LIMITS, order=3)
    start, goal, T = _draw(scene, limits, np.random.default_rng([seed, number]))
    hovi.plan(scene, start, start + 0.01, 1.0, limits=limits, smooth=True, self_collision=False)
    began = time.perf_counter()
    found = hovi.plan(scene, start, goal, T, limits=limits, smooth=True, self_collision=False)
    seconds = time.perf_counter() - began
    motion = found.trajectory
    assert motion.scene is not None
    t = np.linspace(0.0, motion.duration, SAMPLES)
    q, v, a, j = motion.jet(t, 3)
    tau = scene.inverse_dynamics(q, v, a)
    rate = TorqueRate(motion.scene.torques, q, v, a, j).value()
    excess = float(limits.excess(np.stack([q, v, a, tau, j, rate], axis=1)).max())
    return {
        **{"T": T, "status": str(found.status), "nit": found.nit, "seconds": seconds},
        **{"intervals": motion.grid.intervals, "estimate": found.error_estimate or np.nan},
        **{"ends": float(np.abs(a[[0, -1]]).max()), "excess": excess},
    }


def _draw(
    scene: hovi.Scene, limits: hovi.Limits, random: np.random.Generator
) -> tuple[Array, Array, float]:
    """Two configurations that the arm can hold, and a duration."""
    lower, upper = limits.lower[0], limits.upper[0]
    inner = 0.1 * (upper - lower)
    zero = np.zeros((1, scene.robot.nv))
    while True:
        ends = random.uniform(lower + inner, upper - inner, (2, scene.robot.nv))
        static = [np.abs(scene.inverse_dynamics(q[None], zero, zero)[0]) for q in ends]
        if (np.max(static, axis=0) < STATIC_FRACTION * limits.upper[3]).all():
            shortest = float(np.max(np.abs(ends[1] - ends[0]) / limits.upper[1]))
            return ends[0], ends[1], max(random.uniform(*DURATIONS) * shortest, 0.5)


def weights() -> None:
    """The table of weights, on the lift."""
    task = hovi.load_task(hovi.example("panda_lift"))
    data = task.scene.model.createData()
    ends = (task.start.q, task.goal.q)  # type: ignore[union-attr]
    M = max(np.linalg.eigvalsh(pin.crba(task.scene.model, data, np.asarray(q))).max() for q in ends)
    net = np.abs(np.subtract(*ends))
    plans = [
        ("least effort", task.scene, "urdf"),
        ("least effort, a limited", task.scene, {"base": "urdf", "a": ACCELERATIONS}),
    ]
    for fraction in FRACTIONS:
        cost = hovi.effects.JerkCost(float((fraction * task.duration * M) ** 2))
        scene = hovi.Scene(task.scene.robot, [*task.scene.effects, cost])
        plans.append((f"T / {1 / fraction:.0f}", scene, "panda"))
    rows = []
    for name, scene, limits in plans:
        began = time.perf_counter()
        found = hovi.plan(scene, *ends, task.duration, limits=limits, self_collision=False)
        seconds = time.perf_counter() - began
        largest = hovi.extremes(found.trajectory)
        t = np.linspace(0.0, task.duration, 5_001)
        travel = np.abs(np.diff(found.trajectory.sample(t).q, axis=0)).sum(axis=0)
        rows.append(
            [
                *(name, str(found.status), f"{found.effort:.1f}"),
                f"{largest.acceleration.value:.1f}",
                f"{np.abs(largest.acceleration.start).max():.2g}",
                f"{largest.jerk.value:.0f}",
                f"{travel[6]:.2f}",
                f"{(travel - net)[:6].max():.2f}",
                f"{seconds:.2f}",
            ]
        )
    header = [
        *("sqrt(w) / M", "status", "effort", "largest a [rad/s^2]", "at the start"),
        *("largest jerk [rad/s^3]", "way of joint 7 [rad]", "largest detour of another [rad]"),
        "wall [s]",
    ]
    print_table(header, rows)


def main() -> None:
    """Print the chosen tables, or all."""
    tables = {"weights": weights, "ipopt": compare}
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="*", choices=[*tables, "moves", []])
    parser.add_argument("--moves", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    for name in given.tables or [*tables, "moves"]:
        if name == "moves":
            moves(given.moves, given.seed)
        else:
            tables[name]()
    print_machine()


if __name__ == "__main__":
    main()
