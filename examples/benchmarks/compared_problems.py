"""Shared by side_by_side.py: the problems on which two checkouts are compared, class by class.

Everything is asked of hovi by the names that users import, so that any later version can be asked
the same, and every success is judged by outside_judge.py and task_world.py, without hovi.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from outside_judge import ROWS, Asked, LedBack, denial, oracle_model
from twelve_arms import ARMS, load, reaches

import hovi

Array = npt.NDArray[np.float64]

QUICK_ARMS = ("ur5", "panda", "z1", "tiago")
SIX_ARMS = ("ur5", "panda", "z1", "xarm7", "kinova", "talos_arm")
ALONE = {"self_collision": False, "processes": 1}
"""Options of all plans of arms: they are judged by their limits, and tasks by distances as well."""
FEWER_SAMPLES = 5_001
"""At which limits of a replanned motion are looked at, of which there are many."""
CLEARANCE_SAMPLES = 10_001
LEAST_CLEARANCE = 0.995
"""Share of the margin that the meshes of a success keep at all samples."""
GOAL_MISS = 1e-5
"""Largest distance of a frame from its goal, in [m], or between two axes, in [rad]."""
NOISE = 1e-5, 1e-3
"""Of positions in [rad], and of velocities in [rad/s], from which a motion goes on."""


@dataclass(frozen=True)
class Group:
    """Problems that are run one after the other in one process.

    kind: their class. names: of its cases. profiled: whether calls of the first one are counted.
    limit: of a case's processor time, in [s].
    """

    kind: str
    name: str
    names: tuple[str, ...]
    profiled: bool = False
    limit: float = 60.0


@dataclass(frozen=True)
class Outcome:
    """What became of a case. motion: None if there is none, as for a case that judges itself."""

    success: bool
    status: str
    message: str = ""
    nit: int | None = None
    cost: float | None = None
    motion: Any = field(default=None, repr=False)
    solution: Any = field(default=None, repr=False)


@dataclass(frozen=True)
class Case:
    """A problem, or a study of several.

    names: of its outcomes. solve: what is measured. outcomes: of what that returns.
    judge: says why a success is none, or "".
    """

    names: tuple[str, ...]
    solve: Callable[[], Any]
    judge: Callable[[Outcome], str]
    outcomes: Callable[[Any], Sequence[Outcome]] = lambda found: (outcome(found),)


@dataclass(frozen=True)
class Family:
    """A class of problems: its groups, fewer for a quick look, and the cases of a group by seed."""

    groups: Callable[[bool], list[Group]]
    cases: Callable[[Group, int], Iterator[Case]]


def outcome(solution: Any) -> Outcome:
    """The outcome of a solution."""
    return Outcome(
        bool(solution.success),
        str(solution.status),
        str(solution.message),
        int(solution.nit),
        float(solution.cost),
        solution.trajectory,
        solution,
    )


def bounds_of(robot: Any) -> tuple[Array, Array]:
    """The limits of a URDF on q, v, a and tau, shape (4, nv) each."""
    free = np.full(robot.nv, np.inf)
    v = np.where(robot.velocity_limit > 0, robot.velocity_limit, np.inf)
    tau = np.where(robot.effort_limit > 0, robot.effort_limit, np.inf)
    q = (robot.lower, robot.upper) if robot.vector_joints else (-free, free)
    return np.array([q[0], -v, -free, -tau]), np.array([q[1], v, free, tau])


def no_bounds(robot: Any) -> tuple[Array, Array]:
    """No limits, shape (4, nv) each."""
    free = np.full((4, robot.nv), np.inf)
    return -free, free


def asked_between(
    scene: Any, start: Any, goal: Any, duration: float, limits: str, **more: Any
) -> Asked:
    """What is asked of a motion between two states (q, v) of an arm under gravity."""
    robot = scene.robot
    lower, upper = bounds_of(robot) if limits == "urdf" else no_bounds(robot)
    parts = [(duration, oracle_model(robot.model))]
    return Asked(parts, [(0.0, *start), (np.inf, *goal)], lower, upper, **more)


def judged_motion(asked: Asked, samples: int | None = None) -> Callable[[Outcome], str]:
    """A judge of a motion by what is asked of it."""
    more = {} if samples is None else {"samples": samples}
    return lambda found: denial(found.motion, found.cost, asked, **more)


def at_rest(q: Any) -> tuple[Array, Array]:
    """A configuration and no velocity, for robots whose nv their model tells later."""
    q = np.asarray(q, dtype=float)
    return q, np.zeros(1)


# Random reaches


def _reach_groups(kind: str, count: int, quick_count: int) -> Callable[[bool], list[Group]]:
    def groups(quick: bool) -> list[Group]:
        arms, number = (QUICK_ARMS, quick_count) if quick else (tuple(ARMS), count)
        return [
            Group(kind, arm, tuple(f"{arm} {i}" for i in range(number)), arm in ("ur5", "panda"))
            for arm in arms
        ]

    return groups


def _reach_cases(limits: str, group: Group, seed: int) -> Iterator[Case]:
    scene = load(group.name)
    drawn = reaches(scene, len(group.names), seed)
    for name, (start, goal, T) in zip(group.names, drawn, strict=True):
        asked = asked_between(scene, at_rest(start), at_rest(goal), T, limits)
        solve = partial(hovi.plan, scene, start, goal, T, limits=limits, **ALONE)
        yield Case((name,), solve, judged_motion(asked))


# Motions that go on from others


def _six_arm_groups(kind: str, bases: int, count: int) -> Callable[[bool], list[Group]]:
    def groups(quick: bool) -> list[Group]:
        number = 1 if quick else bases
        return [
            Group(
                kind,
                f"{arm} {base}",
                tuple(f"{arm} {base}.{i}" for i in range(6 if quick else count)),
                arm in ("ur5", "panda") and base == 0,
            )
            for base in range(number)
            for arm in SIX_ARMS
        ]

    return groups


def _base(group: Group, seed: int) -> tuple[Any, Any, str, np.random.Generator]:
    """The scene and the motion that others go on from, its limits, and random numbers."""
    arm, number = group.name.rsplit(" ", 1)
    scene = load(arm)
    start, goal, T = reaches(scene, int(number) + 1, seed)[-1]
    limits = "none" if int(number) % 2 else "urdf"
    base = hovi.plan(scene, start, goal, T, limits=limits, **ALONE)
    random = np.random.default_rng((seed, SIX_ARMS.index(arm), int(number)))
    return scene, base, limits, random


def _moved(robot: Any, q: Array, random: np.random.Generator) -> Array:
    """A configuration near another one, within its limits: by 0.003 to 0.1 rad."""
    direction = random.standard_normal(robot.nv)
    size = 10.0 ** random.uniform(-2.5, -1.0)
    moved = pin.integrate(robot.model, q, size * direction / np.linalg.norm(direction))
    if robot.vector_joints:
        moved = np.clip(moved, robot.lower + 1e-3, robot.upper - 1e-3)
    return np.asarray(moved)


def _replan_cases(group: Group, seed: int) -> Iterator[Case]:
    scene, base, limits, random = _base(group, seed)
    robot, motion = scene.robot, base.trajectory
    for number, name in enumerate(group.names):
        start, goal = motion.q[0], motion.q[-1]
        new = (_moved(robot, start, random), _moved(robot, goal, random))
        changes: dict[str, Any] = {}
        if number % 3 != 0:
            start = new[0]
            changes["start"] = hovi.State(start)
        if number % 3 != 1:
            goal = new[1]
            changes["goal"] = hovi.State(goal)
        asked = asked_between(scene, at_rest(start), at_rest(goal), motion.duration, limits)
        yield Case((name,), partial(base.replan, **changes), judged_motion(asked, FEWER_SAMPLES))


def _advance_cases(group: Group, seed: int) -> Iterator[Case]:
    scene, base, limits, random = _base(group, seed + 1)
    robot, motion = scene.robot, base.trajectory
    for name in group.names:
        passed = float(random.uniform(0.02, 0.7)) * motion.duration
        at = motion.sample([passed])
        noise = random.standard_normal((2, robot.nv))
        q = pin.integrate(robot.model, at.q[0], NOISE[0] * noise[0])
        v = at.v[0] + NOISE[1] * noise[1]
        left, goal = motion.duration - passed, at_rest(motion.q[-1])
        asked = partial(asked_between, scene, (q, v), goal, left, limits)
        solve = partial(base.advance, passed, hovi.State(q, v))
        yield Case((name,), solve, partial(_judged_led_back, asked))


def _judged_led_back(asked: Callable[..., Asked], found: Outcome) -> str:
    """The judgement of a motion whose start may be led back within its limits."""
    names = found.motion.coordinate_names
    led_back = [
        LedBack(ROWS.index(x.limit), names.index(x.joint), x.excess, x.until)
        for x in found.solution.excused
    ]
    return denial(found.motion, found.cost, asked(led_back=led_back), FEWER_SAMPLES)


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


FAMILIES = {
    "limited": Family(_reach_groups("limited", 10, 3), partial(_reach_cases, "urdf")),
    "unlimited": Family(_reach_groups("unlimited", 4, 2), partial(_reach_cases, "none")),
    "replans": Family(_six_arm_groups("replans", 7, 12), _replan_cases),
    "advances": Family(_six_arm_groups("advances", 7, 12), _advance_cases),
    "swing-ups": Family(_swing_up_groups, _swing_up_cases),
}
"""All classes, in the order of the table."""


def groups_of(kinds: Sequence[str], quick: bool) -> list[Group]:
    """The groups of some classes."""
    return [group for kind in kinds for group in FAMILIES[kind].groups(quick)]


def cases_of(group: Group, seed: int) -> Iterator[Case]:
    """The cases of a group, of which each is set up when it is asked for."""
    return FAMILIES[group.kind].cases(group, seed)
