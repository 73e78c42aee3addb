"""Shared by side_by_side.py: random problems of arms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
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
    bounds_of,
    judged_motion,
    no_bounds,
)
from outside_judge import MAX_DIFFERENCE, ROWS, Asked, LedBack, carrying, denial, oracle_model
from twelve_arms import ARMS, load, reaches

import hovi

Array = npt.NDArray[np.float64]

QUICK_ARMS = ("ur5", "panda", "z1", "tiago")
SIX_ARMS = ("ur5", "panda", "z1", "xarm7", "kinova", "talos_arm")
FEWER_SAMPLES = 5_001
"""At which limits of a replanned motion are looked at, of which there are many."""
NOISE = 1e-5, 1e-3
"""Of positions in [rad], and of velocities in [rad/s], from which a motion goes on."""
FREE = 0.5, 3.0
"""Bounds of free durations, in times those of the reaches."""
WEIGHTS = 1.0, 100.0
"""Bounds of the weights of time."""
MINIMA = "minimum", "unresolved"
"""Statuses of a solve that ends in a minimum of its grid."""
SEQUENCES = 25
LOADS = {"ur5": 1.0, "panda": 0.5, "z1": 0.2, "xarm7": 0.5, "tiago": 0.3}
"""Arms of the sequences, and what they carry, in [kg]."""


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
        judge = judged_motion(asked) if limits == "urdf" else partial(_judged_by_finer, asked)
        yield Case((name,), solve, judge)


def _judged_by_finer(asked: Asked, found: Outcome) -> str:
    """The judgement of a motion without limits, which may swing between the points of its grid.

    As in resolved_reaches.py, a solve on four times as many intervals, started from it, confirms it
    if it ends in nearly the same cost: on equal ones, or on its own cut into four.
    """
    said = denial(found.motion, found.cost, asked)
    if said:
        return said
    grid, cost, said = found.motion.grid, found.cost or 0.0, ""
    equal = hovi.Grid.uniform(grid.duration, 4 * grid.intervals, hovi.schemes.by_name("galerkin-2"))
    for finer in (equal, grid.halved().halved()):
        problem = found.solution.problem.on(finer)
        again = hovi.solve(problem, found.motion, max_iterations=2_000)
        change = again.cost / cost - 1.0
        if str(again.status) in MINIMA and abs(change) <= MAX_DIFFERENCE:
            return ""
        said = f"finer: {again.status}, cost {change:+.1e}"
    return said


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


# Free durations


def _duration_groups(quick: bool) -> list[Group]:
    arms = ("ur5", "z1") if quick else ("ur5", "panda", "z1", "xarm7", "tiago")
    count = 2 if quick else 5
    return [
        Group("durations", arm, tuple(f"{arm} {i}" for i in range(count)), arm == "ur5")
        for arm in arms
    ]


def _duration_cases(group: Group, seed: int) -> Iterator[Case]:
    """Free durations by a weight of time, limited and not, and the least one."""
    scene = load(group.name)
    random = np.random.default_rng((seed, len(group.name)))
    drawn = reaches(scene, len(group.names), seed + 2)
    for number, (name, (start, goal, T)) in enumerate(zip(group.names, drawn, strict=True)):
        bounds = (FREE[0] * T, FREE[1] * T)
        limits = "none" if number == 1 else "urdf"
        weight = float(np.exp(random.uniform(*np.log(WEIGHTS))))
        least = number == 4
        options = {"objective": "time"} if least else {"time_weight": weight}
        ends = at_rest(start), at_rest(goal)
        asked = partial(asked_between, scene, *ends, np.inf, limits, price=weight)
        solve = partial(hovi.plan, scene, start, goal, bounds, limits=limits, **options, **ALONE)
        yield Case((name,), solve, partial(_judged_duration, asked, bounds, least))


def _judged_duration(
    asked: Callable[[], Asked], bounds: tuple[float, float], least: bool, found: Outcome
) -> str:
    """The judgement of a motion of a free duration; the cost of a least one is not looked at."""
    T = float(found.motion.duration)
    if not bounds[0] * (1 - 1e-9) <= T <= bounds[1] * (1 + 1e-9):
        return f"duration {T:.3g} s out of bounds"
    return denial(found.motion, None if least else found.cost, asked())


# Sequences


def _sequence_groups(quick: bool) -> list[Group]:
    arms, count = (("ur5", "z1"), 2) if quick else (tuple(LOADS), SEQUENCES // len(LOADS))
    return [
        Group("sequences", arm, tuple(f"{arm} {i}" for i in range(count)), arm == "ur5")
        for arm in arms
    ]


def _sequence_cases(group: Group, seed: int) -> Iterator[Case]:
    """Two or three segments that stop or pass, with and without what they carry and limits."""
    scene = load(group.name)
    robot, mass = scene.robot, LOADS[group.name]
    frame = robot.model.frames[len(robot.model.frames) - 1].name
    free = oracle_model(robot.model)
    models = {False: free, True: carrying(free, frame, mass)}
    load_effect = hovi.effects.Payload(frame=frame, mass=mass)
    for number, name in enumerate(group.names):
        random = np.random.default_rng((seed, number, len(group.name)))
        count = int(random.integers(2, 4))
        drawn = reaches(scene, count + 1, int(random.integers(1_000_000)))
        limits = "none" if number % 3 == 2 else "urdf"
        at, T, segments, parts = drawn[0][0], 0.0, [], []
        stops: list[tuple[float, Any, Any]] = [(0.0, *at_rest(at))]
        for k in range(count):
            goal = drawn[k + 1][0]
            speed = np.clip(robot.velocity_limit, 0.1, 10.0)
            distance = np.abs(robot.difference(at, goal))
            T_k = float(random.uniform(1.5, 3.0) * np.max(distance / speed))
            carries, last = bool(k > 0 and random.random() < 0.6), k == count - 1
            passes = bool(not last and random.random() < 0.4)
            state = hovi.State(goal, free_velocity=["all"]) if passes else hovi.State(goal)
            segments.append(hovi.Segment(state, T_k, effects=[load_effect] if carries else []))
            at, T = goal, T + T_k
            parts.append((T, models[carries]))
            stops.append((T, goal, None if passes else np.zeros(1)))
        stops[-1] = (np.inf, *stops[-1][1:])
        lower, upper = bounds_of(robot) if limits == "urdf" else no_bounds(robot)
        asked = Asked(parts, stops, lower, upper)
        solve = partial(hovi.plan_sequence, scene, drawn[0][0], segments, limits=limits, **ALONE)
        yield Case((name,), solve, judged_motion(asked))


FAMILIES = {
    "limited": Family(_reach_groups("limited", 10, 3), partial(_reach_cases, "urdf")),
    "unlimited": Family(_reach_groups("unlimited", 4, 2), partial(_reach_cases, "none")),
    "sequences": Family(_sequence_groups, _sequence_cases),
    "durations": Family(_duration_groups, _duration_cases),
    "replans": Family(_six_arm_groups("replans", 7, 12), _replan_cases),
    "advances": Family(_six_arm_groups("advances", 7, 12), _advance_cases),
}
"""Classes of problems."""
