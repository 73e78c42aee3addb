"""Random tasks that keep a line, a plane, a direction or a speed, within the URDF's limits.

Each has a way by inverse kinematics whose least time, with a fifth in reserve, is shorter than the
duration (kept_paths.py), and along which the given meshes of links are APART apart: links are kept
apart by default, as convex hulls. Motions are judged at 20,000 samples by Pinocchio
alone: what is kept, limits on q, v and the torques of pin.rnea, and the integral of 1/2 |tau|^2;
and, at fewer, the distances of the meshes by Coal, but for those that the message leaves out. Steps
and times of plans are also given relative to the plan of the same ends without what is kept.

    python kept_tasks.py [ARM ...] [--count 2] [--seed 0] [--kind WORD] [--runs FILE]
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from kept_paths import KINDS, ROOM, SPEED, KeptTask, pose, random_tasks
from measuring import alone, print_machine, print_table
from random_arms import arm_scene, largest_excess, middle_and_most, rnea, timed, torque_model
from self_collision import ALLOWED, Meshes

import hovi
from hovi.planning.clearance.clearance import DEFAULT_MARGIN
from hovi.planning.clearance.self_collisions import self_collision_pairs

Array = npt.NDArray[np.float64]

ARMS = ("ur5", "ur10", "panda", "kinova", "xarm7", "z1")
SAMPLES = 20_000
APART = 1.5 * DEFAULT_MARGIN
"""Least distance of meshes along the way, in [m]: hulls are larger, and a UR10's upper arm is never
farther than twice the margin from its base."""
MAX_EXCESS = 1e-6
"""Largest excess over a limit of a motion that holds it, as a fraction of its range."""
DISTANCE, ANGLE = 1e-5, np.deg2rad(0.01)
"""Tolerances of what is kept, in [m] and [rad]."""
INTEGRAL = 2e-3
"""Largest relative difference of the cost from the integral along the motion: twice the
tolerance."""


@dataclass(frozen=True)
class Run:
    """One task. missed: in [m], angle: in [rad], speed: in [m/s]; wrong: what an own judge says."""

    arm: str
    kind: str
    number: int
    status: str
    message: str
    seconds: float
    steps: int
    points: int
    missed: float
    angle: float
    speed: float
    wrong: str
    step_ratio: float
    time_ratio: float


def measure(arm: str, kind: str, count: int, seed: int, time_limit: float) -> list[Run]:
    """Every task of an arm, with what is kept and without."""
    scene = arm_scene(arm, shapes=True)
    meshes = Meshes(scene.robot, self_collision_pairs(scene.robot))
    frame, keep = scene.robot.tip_frames[0], KINDS[kind](scene.robot.tip_frames[0])
    rows = []

    def apart(way: Array) -> bool:
        return bool(meshes.distances(way).min() >= APART)

    for number, task in enumerate(random_tasks(scene, kind, count, seed, apart)):
        planned = partial(hovi.plan, scene, task.start, duration=task.duration)
        planned = partial(planned, processes=1, time_limit=time_limit)
        place = hovi.FrameGoal(frame, position=task.place)
        if number == 0:
            planned(place, keep=keep)  # loads everything
        seconds, found = timed(partial(planned, place, keep=keep))
        # to the same end, so that what is kept is the difference
        there = found.trajectory.q[-1]
        without, free = timed(partial(planned, there))
        points = found.accuracy.rounds[-1].points if found.accuracy is not None else 0
        judged = judge(scene, meshes, kind, task, found)
        both = found.success and free.success
        ratios = (found.nit / free.nit, seconds / without) if both else (np.nan, np.nan)
        rows.append(
            Run(
                arm,
                kind,
                number,
                str(found.status),
                found.message,
                seconds,
                found.nit,
                points,
                *judged,
                *ratios,
            )
        )
    return rows


def judge(
    scene: hovi.Scene,
    meshes: Meshes | None,
    kind: str,
    task: KeptTask,
    found: hovi.Solution,
    limits: str = "urdf",
) -> tuple[float, float, float, str]:
    """What is missed, in [m] and [rad], the largest speed, and what is wrong with a success.

    meshes: of links that keep their margin; None for a motion that keeps none.
    """
    model, frame = torque_model(scene), scene.robot.tip_frames[0]
    t = np.linspace(0.0, task.duration, SAMPLES)
    x = found.trajectory.sample(t)
    places = np.array([pose(model, frame, q) for q in x.q])
    p, R = places[:, :3, 3], places[:, :3, :3]
    along = (task.place - p[0]) / np.linalg.norm(task.place - p[0])
    away = p - p[0]
    missed = 0.0
    if "line" in kind:
        missed = float(np.linalg.norm(away - np.outer(away @ along, along), axis=1).max())
    if "plane" in kind:
        missed = float(np.abs(away[:, 2]).max())
    angle = 0.0
    if "upright" in kind:
        up = R @ (R[0].T @ [0.0, 0.0, 1.0])
        angle = float(np.arctan2(np.linalg.norm(up[:, :2], axis=1), up[:, 2]).max())
    speed = float((np.linalg.norm(np.diff(p, axis=0), axis=1) / np.diff(t)).max())
    tau = rnea(model, x.q, x.v, x.a)
    integral = float(np.trapezoid(0.5 * (tau**2).sum(axis=1), t))
    said = {
        "line or plane": missed > DISTANCE,
        "direction": angle > (ROOM * (1 + 1e-6) if "within" in kind else ANGLE),
        "speed": "m/s" in kind and speed > SPEED * (1 + 1e-5),
        "limits": largest_excess(scene, found.trajectory, hovi.as_limits(scene.robot, limits))
        > MAX_EXCESS,
        "integral": abs(integral - found.cost) > INTEGRAL * found.cost,
        "goal": float(np.abs(p[-1] - task.place).max()) > 1e-6,
        "distances of links": found.success
        and meshes is not None
        and meshes.without_said(found.message).least_along(found.trajectory)
        < DEFAULT_MARGIN - ALLOWED,
        "rest": float(max(np.abs(x.v[0]).max(), np.abs(x.v[-1]).max())) > 1e-8,
    }
    wrong = [name for name, bad in said.items() if bad] if found.success else []
    return missed, angle, speed, ", ".join(wrong)


def main() -> None:
    """Print the table, and every task that is no minimum or wrong."""
    parser = argparse.ArgumentParser()
    parser.add_argument("arms", nargs="*", metavar="ARM")
    parser.add_argument("--count", type=int, default=2, help="tasks of each kind and arm")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", default="", help="only kinds that contain this")
    parser.add_argument("--time-limit", type=float, default=60.0, help="of a plan, in [s]")
    parser.add_argument("--runs", type=Path, help="a file of runs, which are in the table, too")
    given = parser.parse_args()
    runs = saved_runs(given.runs)
    kinds = [each for each in KINDS if given.kind in each]
    arms, rest = given.arms or list(ARMS), (given.count, given.seed, given.time_limit)
    for arm in arms:
        for kind in kinds:
            if (arm, kind) not in {(r.arm, r.kind) for r in runs}:
                runs += alone(measure, arm, kind, *rest)
                save(runs, given.runs)
    arms = [each for each in ARMS if any(r.arm == each for r in runs)]
    columns = ["", "minima", "wrong", "largest miss [mm], [deg]", "CPU s: median, max", "steps"]
    columns += ["steps / without: median, max", "CPU s / without: median, max"]
    groups = [(kind, [r for r in runs if r.kind == kind]) for kind in kinds]
    groups += [(f"`{arm}`", [r for r in runs if r.arm == arm]) for arm in arms]
    print_table(columns, [row(name, chosen) for name, chosen in groups if chosen])
    for run in runs:
        if run.status != "minimum" or run.wrong:
            said = run.wrong or run.message
            print(
                f"- `{run.arm}` {run.number}, {run.kind}: {run.status}, {run.seconds:.2g} s: {said}"
            )
    print_machine(threads=1)


def saved_runs(file: Path | None) -> list[Run]:
    """The runs in a file; none without one."""
    if file is None or not file.exists():
        return []
    return [Run(**json.loads(line)) for line in file.read_text().splitlines()]


def save(runs: list[Run], file: Path | None) -> None:
    """Write runs to a file, if there is one."""
    if file is not None:
        file.write_text("".join(f"{json.dumps(dataclasses.asdict(run))}\n" for run in runs))


def row(name: str, runs: list[Run]) -> list[str]:
    """A row of the table."""
    good = [r for r in runs if r.status == "minimum"]
    missed = max((r.missed for r in good if "line" in r.kind or "plane" in r.kind), default=0.0)
    angle = max((r.angle for r in good if "upright" in r.kind), default=0.0)
    return [
        name,
        f"{len(good)} of {len(runs)}",
        str(sum(bool(r.wrong) for r in runs)),
        f"{1e3 * missed:.1e}, {np.rad2deg(angle):.2g}",
        middle_and_most([r.seconds for r in good]),
        middle_and_most([r.steps for r in good]),
        middle_and_most([r.step_ratio for r in good if np.isfinite(r.step_ratio)]),
        middle_and_most([r.time_ratio for r in good if np.isfinite(r.time_ratio)]),
    ]


if __name__ == "__main__":
    main()
