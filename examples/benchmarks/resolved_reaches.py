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

ALL_BUT_FINGERS = r"(?!.*(finger|[Gg]ripper)).*"
ARMS = {
    **dict.fromkeys(
        ("ur5", "ur10", "panda", "z1", "xarm7", "kinova", "talos_arm"), ALL_BUT_FINGERS
    ),
    "so100": r"(shoulder|elbow|wrist)_.*",
    "bravo7_no_ee": ALL_BUT_FINGERS,
    "tiago": r"arm_\d_joint",
    "baxter": r"left_[swe]\d",
    "alex_nub_hands": r"Left(?!Gripper).*",
}
"""Robots of example-robot-data, with a pattern of the joints that move; all others are locked."""
HOLDING_SHARE = 0.9
"""Largest torque that holds a start or goal, as a share of its limit."""
TIME_LIMIT = 600.0
COMMON = {"self_collision": False, "time_limit": TIME_LIMIT, "processes": 1}
"""Time limit of a plan, in [s]."""
MAX_DIFFERENCE = 1e-2
"""Largest relative difference of costs of a success that is not denied."""
MAX_EXCESS = 2e-6
"""Largest accepted excess over a limit, as a share of its range: twice hovi's own tolerance."""
GAUSS_POINTS, SAMPLES = 48, 50_001
"""Points per interval of the integral, and times at which limits are checked."""


@dataclass(frozen=True)
class Reach:
    """The result of one reach.

    nit: steps of the optimiser. seconds: of CPU. denied: why the success is denied, or "".
    whirl: largest velocity of a joint, over (half a turn + its distance) / T.
    """

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
        slowness = rng.uniform(1.5, 3.0)
        torque = np.abs(_holding_torque(scene, np.array([start, goal])))
        if (torque <= HOLDING_SHARE * robot.effort_limit).all():
            distance = np.abs(robot.difference(start, goal))
            T = slowness * np.max(distance / np.clip(robot.velocity_limit, 0.1, 10.0))
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


def _holding_torque(scene: hovi.Scene, q: np.ndarray) -> np.ndarray:
    zero = np.zeros((len(q), scene.robot.nv))
    return scene.inverse_dynamics(q, zero, zero)


def oracle_model(scene: hovi.Scene) -> pin.Model:
    """The robot's model with the scene's gravity and armature, for pin.rnea."""
    model = scene.robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.armature = np.zeros(model.nv)
    return model


def torques(model: pin.Model, motion: object) -> np.ndarray:
    """Torques of pin.rnea at samples of q, v and a, shape (M, nv), in [N m]."""
    data = model.createData()
    rows = zip(motion.q, motion.v, motion.a, strict=True)
    return np.array([pin.rnea(model, data, *row) for row in rows])


def integral(scene: hovi.Scene, trajectory: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 along the curve."""
    x, w = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    t, h = np.asarray(trajectory.t), np.diff(trajectory.t)[:, None]
    tau = torques(oracle_model(scene), trajectory.sample((t[:-1, None] + h * (x + 1) / 2).ravel()))
    return float(np.sum((h * w / 2).ravel() * 0.5 * np.sum(tau**2, axis=1)))


def excess(scene: hovi.Scene, trajectory: hovi.Trajectory) -> float:
    """Largest excess over a limit, as a share of its range; unlimited joints are left out."""
    robot = scene.robot
    motion = trajectory.sample(np.linspace(0.0, trajectory.duration, SAMPLES))
    bounds = [
        (motion.v, -robot.velocity_limit, robot.velocity_limit),
        (torques(oracle_model(scene), motion), -robot.effort_limit, robot.effort_limit),
    ]
    if robot.vector_joints:
        bounds.append((motion.q, robot.lower, robot.upper))
    worst = 0.0
    for y, low, high in bounds:
        limited = np.isfinite(low) & np.isfinite(high) & (high > low) & (high - low < 1e6)
        outside = np.maximum(y - high, low - y)[:, limited] / (high - low)[limited]
        worst = max(worst, float(outside.max(initial=0.0)))
    return worst


def denial(scene: hovi.Scene, limits: str, plan: hovi.Solution) -> str:
    """Why a success is denied, or ""."""
    difference = integral(scene, plan.trajectory) / plan.cost - 1
    if abs(difference) > MAX_DIFFERENCE:
        return f"integral {difference:+.1e}"
    beyond = excess(scene, plan.trajectory) if limits == "urdf" else 0.0
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
    whirl = float(np.max(velocity / unit))
    status = str(plan.status)
    text = f"{arm} {limits} {number}: T {T:.2f} {status} {plan.nit} steps {seconds:.2f} s"
    print(f"{text} whirl {whirl:.1f} {denied}", file=sys.stderr, flush=True)
    return Reach(arm, limits, number, status, plan.nit, seconds, denied, whirl, plan.message)


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
