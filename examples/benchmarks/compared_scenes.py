"""Shared by side_by_side.py: the tasks and scenes that ship with hovi, hard cases and studies."""

from __future__ import annotations

import sys
import tempfile
import tomllib
from collections.abc import Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from compared_cases import (
    ALONE,
    Case,
    Family,
    Group,
    Outcome,
    asked_between,
    at_rest,
    judged_motion,
    no_bounds,
)
from outside_judge import Asked, denial, oracle_model
from task_world import World, least_clearance, read_world

import hovi

Array = npt.NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
TASKS = ROOT / "models" / "tasks"
TASK_LIMIT = 240.0
"""Most processor time of a task, in [s]."""
LONGEST_FIRST = ("tiago_reaches_table", "z1_into_drawer", "panda_out_of_bin", "xarm7_crate")
"""Parts of the names of tasks that begin, so that none of them is left at the end."""
QUICK_TASKS = ("four_axis_sorts", "ur5_bin_to_bin", "panda_hand_past_its_base", "ur5_into_shelf")
CLEARANCE_SAMPLES = 10_001
LEAST_CLEARANCE = 0.995
"""Fraction of the margin that the meshes of a success keep at all samples."""
GOAL_MISS = 1e-5
"""Largest distance of a frame from its goal, in [m], and of the directions of two axes."""


# Tasks


def _task_groups(quick: bool) -> list[Group]:
    files = {file.stem: file for file in sorted(TASKS.glob("*/*.toml"))}
    names = [n for n in files if n in QUICK_TASKS] if quick else list(files)
    names.sort(key=lambda name: not any(part in name for part in LONGEST_FIRST))
    return [
        Group("tasks", f"{files[n].parent.name}/{n}", (n,), n in QUICK_TASKS[:3], TASK_LIMIT)
        for n in names
    ]


def _task_cases(group: Group, seed: int) -> Iterator[Case]:
    file = TASKS / f"{group.name}.toml"
    task = hovi.load_task(file)
    yield Case(group.names, partial(hovi.plan_task, task, processes=1), partial(judged_task, file))


def judged_task(file: Path, found: Outcome) -> str:
    """Why the success of a task is denied: its world is read from its file by Pinocchio alone."""
    from tasks import robot_files  # which needs more of hovi than the other classes

    world, data = read_world(file, robot_files(file)), tomllib.loads(file.read_text())
    q = found.motion.configurations(np.linspace(0.0, found.motion.duration, CLEARANCE_SAMPLES))
    missed = missed_goal(world, data["goal"], q[-1])
    if missed:
        return missed
    clearance, pair = least_clearance(world, q)
    if not clearance >= LEAST_CLEARANCE * world.margin:
        return f"clearance {1e3 * clearance:.1f} mm of {pair}"
    return denial(found.motion, found.cost, asked_of_task(world, data, found.motion))


def missed_goal(world: World, goal: dict[str, Any], q: Array) -> str:
    """Which goal of a frame a configuration misses."""
    if "frame" not in goal:
        return ""
    data = world.model.createData()
    pin.framesForwardKinematics(world.model, data, q)
    pose = data.oMf[world.model.getFrameId(goal["frame"])]
    if isinstance(goal.get("position"), list):
        miss = float(np.linalg.norm(pose.translation - np.array(goal["position"], float)))
        if miss > GOAL_MISS:
            return f"misses the position of {goal['frame']} by {miss:.1e} m"
    if isinstance(goal.get("axis"), dict):
        own, wanted = (np.array(goal["axis"][key], float) for key in ("frame", "world"))
        turned = pose.rotation @ own / np.linalg.norm(own)
        miss = float(np.linalg.norm(turned - wanted / np.linalg.norm(wanted)))
        if miss > GOAL_MISS:
            return f"misses the axis of {goal['frame']} by {miss:.1e}"
    return ""


def asked_of_task(world: World, data: dict[str, Any], motion: Any) -> Asked:
    """What a task asks of a motion besides distances."""
    limits = hovi.as_limits(motion.robot, data.get("limits", "urdf"))
    stops: list[tuple[float, Any, Any]] = [(0.0, None, np.zeros(1)), (np.inf, None, np.zeros(1))]
    for number, end in enumerate((data["start"], data["goal"])):
        if isinstance(end.get("q"), list):
            stops[number] = (stops[number][0], np.array(end["q"], float), np.zeros(1))
    by_limit = data["effects"].get("effort_weight", {}).get("from_urdf", False)
    weight = 1.0 / motion.robot.effort_limit**2 if by_limit else None
    parts = [(motion.duration, world.model)]
    return Asked(parts, stops, limits.lower[:4], limits.upper[:4], weight=weight)


# Swing-ups


SWING_UPS = ("acrobot_swing_up", "pendubot_swing_up", "cart_pole_swing_up")
GRIDS = (("galerkin-2", 40), ("galerkin-2", 80), ("galerkin-1", 60), ("galerkin-2x8", 40))
STRETCHED = 4
"""Number of durations other than the scene's."""


def _swing_up_groups(quick: bool) -> list[Group]:
    words = [f"{scheme}, {N}" for scheme, N in GRIDS]
    words += [f"stretched {i}" for i in range(STRETCHED)] + ["with starts"]
    words = words[:2] if quick else words
    return [
        Group("swing-ups", name, tuple(f"{name}: {word}" for word in words), True)
        for name in SWING_UPS
    ]


def _swing_up_cases(group: Group, seed: int) -> Iterator[Case]:
    task = hovi.load_task(hovi.example(group.name))
    random = np.random.default_rng((seed, SWING_UPS.index(group.name)))
    settings: list[tuple[float, dict[str, Any]]] = [
        (1.0, {"scheme": scheme, "intervals": N, "starts": 1}) for scheme, N in GRIDS
    ]
    grid = {"scheme": "galerkin-2", "intervals": 40, "starts": 1}
    settings += [(float(random.uniform(0.85, 1.25)), grid) for _ in range(STRETCHED)]
    settings += [(1.0, grid | {"starts": 4})]
    model = task.scene.robot.model
    passive = [model.idx_vs[model.getJointId(name)] for name in task_passive(group.name)]
    for name, (stretch, options) in zip(group.names, settings, strict=False):
        T = stretch * task.duration
        ends = at_rest(task.start.q), at_rest(task.goal.q)
        asked = asked_between(task.scene, *ends, T, "none", passive=passive)
        options = {**options, "limits": "none", **ALONE}
        solve = partial(hovi.plan, task.scene, task.start, task.goal, T, **options)
        yield Case((name,), solve, judged_motion(asked))


def task_passive(name: str) -> list[str]:
    """The passive joints of a shipped scene."""
    return list(tomllib.loads(Path(hovi.example(name)).read_text())["passive"])


# Hard cases


@cache
def _hard_cases() -> dict[str, list[Any]]:
    """The short cases of tests/hard, of the checkout whose hovi is imported, by family."""
    from hard_cases import families  # the tests' own packages

    tests = Path(str(hovi.__file__)).resolve().parents[2] / "tests"
    sys.path.insert(0, str(tests))
    cases = {name: [c for c in all_of if not c.long] for name, all_of in families(tests).items()}
    return {name: known for name, known in cases.items() if known}


def _hard_groups(quick: bool) -> list[Group]:
    chosen = ("rounding", "structure") if quick else tuple(_hard_cases())
    return [
        Group("hard", name, tuple(case.number for case in cases))
        for name, cases in _hard_cases().items()
        if name in chosen
    ]


def _hard_cases_of(group: Group, seed: int) -> Iterator[Case]:
    for case in _hard_cases().get(group.name, []):
        yield Case((case.number,), case.run, lambda found: "", _hard_outcomes)


def _hard_outcomes(found: Any) -> Sequence[Outcome]:
    """A hard case judges itself."""
    return (Outcome(bool(found.passed), "passes" if found.passed else "fails", found.shown),)


# Studies


BOX = {"lower": [0.0, 0.0], "upper": [1.0, 1.0]}
CENTERS = {0: 1.2, 1: -0.6}
"""Joints of the UR5 of which the goal varies, and the middle of their ranges."""


def _study_groups(quick: bool) -> list[Group]:
    sizes = {"two_link": 6, "ur5": 4} if quick else {"two_link": 60, "ur5": 25, "ur5 warm": 25}
    return [
        Group("studies", name, tuple(f"{name} {i}" for i in range(size)), limit=120.0)
        for name, size in sizes.items()
    ]


def _study_cases(group: Group, seed: int) -> Iterator[Case]:
    """One study, whose cells are the problems."""
    count = len(group.names)
    if group.name == "two_link":
        sample = {"field": "goal.q", "sample": BOX | {"count": count}}
        study = hovi.Study("two_link_reach", [sample], seed=seed)
    else:
        side = round(count**0.5)
        axes = [
            {
                "field": f"goal.q[{i}]",
                "grid": {"lower": c - 0.3, "upper": c + 0.3, "count": side},
            }
            for i, c in CENTERS.items()
        ]
        study = hovi.Study("ur5_reach", axes, warm=group.name == "ur5 warm")
    folder = Path(tempfile.mkdtemp(prefix="hovi-study-"))
    runs = iter(range(1_000))

    def solve() -> Path:
        place = folder / str(next(runs))
        study.run(place)
        return place

    yield Case(group.names, solve, _judged_cell, _cells)


def _cells(folder: Path) -> Sequence[Outcome]:
    """The outcomes of the cells of a study."""
    outcomes = []
    for _, cell in hovi.Study.load(folder).iterrows():
        motion = hovi.Study.motion(folder, cell["key"]) if cell["success"] else None
        said = bool(cell["success"]), str(cell["status"]), str(cell["reason"])
        outcomes.append(Outcome(*said, int(cell["nit"]), float(cell["cost"]), motion, cell))
    return outcomes


def _judged_cell(found: Outcome) -> str:
    """The judgement of a cell by its start, its goal, and the gravity of its scene."""
    motion, cell = found.motion, found.solution
    stops = [(0.0, np.array(cell["q_start"]), None), (np.inf, np.array(cell["q_goal"]), None)]
    gravity = next(e.acceleration for e in motion.scene.effects if hasattr(e, "acceleration"))
    parts = [(motion.duration, oracle_model(motion.robot.model, gravity))]
    return denial(motion, found.cost, Asked(parts, stops, *no_bounds(motion.robot)))


FAMILIES = {
    "tasks": Family(_task_groups, _task_cases),
    "swing-ups": Family(_swing_up_groups, _swing_up_cases),
    "hard": Family(_hard_groups, _hard_cases_of),
    "studies": Family(_study_groups, _study_cases),
}
"""Classes of problems."""
