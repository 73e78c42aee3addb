"""Is what hovi calls a minimum one? Random reaches of twelve arms, all defaults, judged outside.

Start and goal are drawn uniformly within the position limits, at most one turn, among pairs that
can be held with 0.9 of the torque limits; T is 1.5 to 3 times that of the slowest joint at its
velocity limit. A success is denied if
- the integral of 1/2 |tau|^2 along its curve, with torques of pin.rnea from sampled (q, v, a), by
  48 Gauss points per interval, differs from its cost by more than 1 %;
- a solve on a grid four times finer, started from it, is no minimum within 1 % of its cost: neither
  on four times as many equal intervals with `galerkin-2`, which may carry less of the motion than
  its own, nor on its own intervals cut into four;
- a limit is exceeded by more than 2e-6 of its range at one of 50,001 instants.

    python resolved_reaches.py [ARM ...] [--count 25] [--seed 0] [--limits urdf|none] [--jobs 1]
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from measuring import print_machine, print_table

import hovi
from hovi.planning.solver.solver import solve_on_grid
from hovi.schemes import galerkin

ANY_BUT_FINGERS = r"(?!.*(finger|[Gg]ripper)).*"
ARMS = {
    "ur5": ANY_BUT_FINGERS,
    "ur10": ANY_BUT_FINGERS,
    "panda": ANY_BUT_FINGERS,
    "z1": ANY_BUT_FINGERS,
    "xarm7": ANY_BUT_FINGERS,
    "kinova": ANY_BUT_FINGERS,
    "talos_arm": ANY_BUT_FINGERS,
    "so100": r"(shoulder|elbow|wrist)_.*",
    "bravo7_no_ee": ANY_BUT_FINGERS,
    "tiago": r"arm_\d_joint",
    "baxter": r"left_[swe]\d",
    "alex_nub_hands": r"Left(?!Gripper).*",
}
"""Robots of example-robot-data, and the joints that move; the others are locked."""
HOLDING_SHARE, TIME_LIMIT = 0.9, 600.0
DENIED, EXCESS, INSTANTS, GAUSS = 1e-2, 2e-6, 50_001, 48


@dataclass(frozen=True)
class Reach:
    """The result of one reach."""

    arm: str
    limits: str
    number: int
    status: str
    nit: int
    seconds: float
    denied: str
    whirl: float
    message: str


def load(arm: str) -> hovi.Scene:
    """The arm under gravity, with all other joints locked."""
    names = list(hovi.load_robot(arm).model.names)[1:]
    locked = [name for name in names if not re.fullmatch(ARMS[arm], name)]
    return hovi.Scene(hovi.load_robot(arm, locked=locked), effects=[hovi.effects.Gravity()])


def reaches(scene: hovi.Scene, count: int, seed: int) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Start, goal and duration of every reach."""
    robot = scene.robot
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        start, goal = (_draw(robot, rng) for _ in range(2))
        held = np.abs(_static(scene, np.array([start, goal]))) <= HOLDING_SHARE * robot.effort_limit
        way = np.abs(robot.difference(start, goal))
        share = rng.uniform(1.5, 3.0)
        if held.all():
            T = share * np.max(way / np.clip(robot.velocity_limit, 0.1, 10.0))
            found.append((start, goal, float(T)))
    return found


def _draw(robot: hovi.Robot, rng: np.random.Generator) -> np.ndarray:
    """A configuration within +-pi of the neutral one and within the limits."""
    model = robot.model
    angle = np.empty(model.nv)
    for joint in model.joints[1:]:
        bounds = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        low, high = bounds if joint.nq == 1 else (-np.pi, np.pi)
        angle[joint.idx_v] = rng.uniform(max(low, -np.pi), min(high, np.pi))
    return np.asarray(pin.integrate(model, pin.neutral(model), angle))


def _static(scene: hovi.Scene, q: np.ndarray) -> np.ndarray:
    zero = np.zeros((len(q), scene.robot.nv))
    return scene.inverse_dynamics(q, zero, zero)


def outside_model(scene: hovi.Scene) -> pin.Model:
    """The robot's model with the scene's gravity and armature, for pin.rnea."""
    model = scene.robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.armature = np.zeros(model.nv)
    return model


def torques(model: pin.Model, motion: object) -> np.ndarray:
    """pin.rnea at samples (q, v, a)."""
    data = model.createData()
    rows = zip(motion.q, motion.v, motion.a, strict=True)
    return np.array([pin.rnea(model, data, *row) for row in rows])


def integral(scene: hovi.Scene, trajectory: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 along the curve."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    t, h = np.asarray(trajectory.t), np.diff(trajectory.t)[:, None]
    tau = torques(outside_model(scene), trajectory.sample((t[:-1, None] + h * (x + 1) / 2).ravel()))
    return float(np.sum((h * w / 2).ravel() * 0.5 * np.sum(tau**2, axis=1)))


def excess(scene: hovi.Scene, trajectory: hovi.Trajectory) -> float:
    """Largest excess over a limit, relative to its range."""
    robot = scene.robot
    motion = trajectory.sample(np.linspace(0.0, trajectory.duration, INSTANTS))
    rows = [
        (motion.v, -robot.velocity_limit, robot.velocity_limit),
        (torques(outside_model(scene), motion), -robot.effort_limit, robot.effort_limit),
    ]
    if robot.vector_joints:
        rows.append((motion.q, robot.lower, robot.upper))
    worst = 0.0
    for y, low, high in rows:
        wide = np.isfinite(low) & np.isfinite(high) & (high > low) & (high - low < 1e6)
        outside = np.maximum(y - high, low - y)[:, wide] / (high - low)[wide]
        worst = max(worst, float(outside.max(initial=0.0)))
    return worst


def denial(scene: hovi.Scene, limits: str, plan: hovi.Solution) -> str:
    """Why a success is denied, or ""."""
    apart = integral(scene, plan.trajectory) / plan.cost - 1
    if abs(apart) > DENIED:
        return f"integral {apart:+.1e}"
    over = excess(scene, plan.trajectory) if limits == "urdf" else 0.0
    N = 4 * plan.trajectory.grid.intervals
    if over > EXCESS:
        return f"limits {over:.1e}"
    finer = _solved(plan, hovi.Grid.uniform(plan.trajectory.duration, N, galerkin(2)))
    if not _confirms(finer, plan):
        finer = _solved(plan, _quarters(plan.trajectory.grid))
    return (
        "" if _confirms(finer, plan) else f"finer {finer.status} {finer.cost / plan.cost - 1:+.1e}"
    )


def _solved(plan: hovi.Solution, grid: hovi.Grid) -> hovi.Solution:
    """A solve from the plan's motion on another grid."""
    return solve_on_grid(plan.problem.on(grid), plan.trajectory, max_iterations=2000)


def _confirms(finer: hovi.Solution, plan: hovi.Solution) -> bool:
    return finer.success and abs(finer.cost / plan.cost - 1) <= DENIED


def _quarters(grid: hovi.Grid) -> hovi.Grid:
    """The grid with every interval cut into four."""
    for _ in range(2):
        grid = grid.halved(np.ones(grid.intervals, dtype=bool))
    return grid


def measure(arm: str, limits: str, number: int, count: int, seed: int) -> Reach:
    """Plan and judge one reach."""
    scene = load(arm)
    *ends, T = reaches(scene, count, seed)[number]
    began = time.process_time()
    plan = hovi.plan(scene, *ends, T, limits=limits, time_limit=TIME_LIMIT, processes=1)
    seconds = time.process_time() - began
    denied = denial(scene, limits, plan) if plan.success else ""
    sample = plan.trajectory.sample(np.linspace(0, T, 2001))
    way = np.pi + np.abs(scene.robot.difference(*ends))
    whirl = float(np.max(np.abs(sample.v).max(axis=0) * T / way))
    row = Reach(
        arm, limits, number, str(plan.status), plan.nit, seconds, denied, whirl, plan.message
    )
    text = f"{arm} {limits} {number}: T {T:.2f} {plan.status} {plan.nit} steps {seconds:.2f} s"
    print(f"{text} whirl {whirl:.1f} {denied}", file=sys.stderr, flush=True)
    return row


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
    table = []
    for arm in [*arms, "all"]:
        own = [row for row in rows if row.limits == kind and arm in (row.arm, "all")]
        others = Counter(row.status for row in own if row.status != "minimum")
        steps, seconds = [row.nit for row in own], [row.seconds for row in own]
        table.append(
            [
                f"`{arm}`",
                f"{len(own) - sum(others.values())} of {len(own)}",
                ", ".join(f"{n} {status}" for status, n in others.items()) or "-",
                sum(bool(row.denied) for row in own),
                f"{np.median(steps):.0f}, {max(steps)}",
                f"{np.median(seconds):.2f}, {max(seconds):.2f}",
            ]
        )
    print_table(["arm", "minima", "others", "denied", "steps", "seconds of CPU"], table)
    for row in rows:
        if row.limits == kind and row.denied:
            print(f"- denied: `{row.arm}` {row.number}: {row.denied}")


if __name__ == "__main__":
    main()
