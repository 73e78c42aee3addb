"""The problems on which rules are turned off, planned by hovi's public names: see rules.py.

Each takes a number of a nudge: 0 for none, others move its start by up to 1e-9 of the range.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import casadi
import numpy as np
import numpy.typing as npt
import pinocchio as pin
from random_arms import arm_scene, random_reaches

import hovi

Array = npt.NDArray[np.float64]
Problem = Callable[[int], hovi.Solution]

TASKS = Path(__file__).resolve().parents[2] / "models" / "tasks"
NUDGE = 1e-9
"""Largest move of a start, as a fraction of its range."""
PROBLEMS: dict[str, Problem] = {}
SCREENING: list[str] = []
"""Names of those that take a few seconds together and reach most rules."""


def nudged(q: npt.ArrayLike, robot: hovi.Robot, nudge: int) -> Array:
    """A configuration moved a little; itself for 0. Coordinates of orientations are kept."""
    q = np.array(q, dtype=np.float64)
    if nudge == 0 or robot.nq != robot.nv:
        return q
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    q += NUDGE * (high - low) * np.random.default_rng(nudge).uniform(-1.0, 1.0, len(q))
    return np.clip(q, robot.lower, robot.upper)


def _problem(name: str, screened: bool = False) -> Callable[[Problem], Problem]:
    def added(function: Problem) -> Problem:
        PROBLEMS[name] = function
        if screened:
            SCREENING.append(name)
        return function

    return added


def _plan(
    scene: hovi.Scene, start: Array, goal: Any, duration: Any, **options: Any
) -> hovi.Solution:
    return hovi.plan(scene, start, goal, duration, **{"processes": 1, **options})


@cache
def _arm(name: str) -> hovi.Scene:
    return arm_scene(name)


@cache
def _given(name: str) -> hovi.Scene:
    """A robot as it is loaded, under gravity."""
    return hovi.Scene(hovi.load_robot(name), [hovi.effects.Gravity()])


def _ends(robot: hovi.Robot, seed: int, fraction: float) -> tuple[Array, Array]:
    """Two configurations in a fraction of the ranges, or of 2.5 rad to both sides."""
    rng = np.random.default_rng(seed)
    low, high = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    mid, half = (low + high) / 2, (high - low) / 2 * fraction
    a, b = (mid + half * rng.uniform(-1, 1, robot.nq) for _ in range(2))
    return a, b


def _reach(name: str, seed: int, **options: Any) -> Problem:
    def run(nudge: int) -> hovi.Solution:
        scene = _arm(name)
        reach = random_reaches(scene, seed + 1, 0)[seed]
        start = nudged(reach.start, scene.robot, nudge)
        return _plan(scene, start, reach.goal, reach.duration, self_collision=False, **options)

    return run


def _tight(name: str, seed: int, ratio: float) -> Problem:
    """A duration near the least one, which is found for every joint alone by its velocity."""

    def run(nudge: int) -> hovi.Solution:
        scene = _arm(name)
        robot = scene.robot
        a, b = _ends(robot, seed, 0.4)
        duration = ratio * float(np.max(np.abs(b - a) / robot.velocity_limit))
        return _plan(scene, nudged(a, robot, nudge), b, duration, self_collision=False)

    return run


def _between(name: str, seed: int, fraction: float, duration: Any, **options: Any) -> Problem:
    def run(nudge: int) -> hovi.Solution:
        scene = _given(name)
        a, b = _ends(scene.robot, seed, fraction)
        return _plan(scene, nudged(a, scene.robot, nudge), b, duration, **options)

    return run


for _name in ("ur5", "panda", "z1", "kinova", "xarm7"):
    for _seed in range(4):
        _problem(f"reach {_name} {_seed}", _seed == 0)(_reach(_name, _seed))
for _name, _ratio in (("ur5", 1.04), ("ur5", 1.08), ("panda", 1.1), ("xarm7", 1.06), ("z1", 1.1)):
    _problem(f"tight {_name} {_ratio}", _ratio == 1.08)(_tight(_name, 3, _ratio))
for _name in ("ur5", "xarm7"):
    _problem(f"free {_name}", _name == "ur5")(
        _between(_name, 5, 0.35, 1.5, limits="none", self_collision=False)
    )
for _name, _seed in (("ur5", 7), ("ur5", 8), ("panda", 7)):
    _problem(f"defaults {_name} {_seed}", _name == "ur5")(_between(_name, _seed, 0.6, 2.5))
_problem("short ur5")(_between("ur5", 4, 0.6, 0.55, self_collision=False))
_problem("smooth ur5", True)(_between("ur5", 3, 0.35, 2.0, smooth=True, self_collision=False))
_problem("intervals ur5")(_reach("ur5", 1, intervals=12))
_problem("many intervals ur5")(_reach("ur5", 2, intervals=170))
_problem("accurate ur5")(_reach("ur5", 3, tolerance=1e-6))
_problem("frame error panda")(
    _between("panda", 4, 0.3, 2.0, tolerance="0.1 mm", self_collision=False)
)
_problem("wide ur5")(
    _between("ur5", 4, 0.3, 3.0, self_collision=False, limits={"v": 50.0, "tau": 1e4})
)
_problem("starts two_link")(lambda nudge: _two_link(nudge, 3.0, starts=24))
_problem("swing up in 5 s", True)(lambda nudge: _two_link(nudge, 5.0, intervals=50))
_problem("swing up in 50 s")(lambda nudge: _two_link(nudge, 50.0, intervals=200))
_problem("swing up on 1,200 intervals")(lambda nudge: _two_link(nudge, 3.0, intervals=1200))
_problem("swing up to 1e-8")(lambda nudge: _two_link(nudge, 4.0, tolerance=1e-8))


def _two_link(nudge: int, duration: float, **options: Any) -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    start = nudged([-np.pi / 2, 0.0], scene.robot, nudge)
    return _plan(scene, start, np.array([np.pi / 2, 0.0]), duration, limits="none", **options)


@_problem("weak motor", True)
def _weak(nudge: int) -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    limits = {"base": "none", "tau": 2.0, "q": [[-0.05, 0.05], [-0.05, 0.05]]}
    start = nudged([0.0, 0.0], scene.robot, nudge)
    return _plan(scene, start, np.zeros(2), 2.0, limits=limits, self_collision=False)


@_problem("torque limits two_link")
def _limited_swing(nudge: int) -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    start = nudged([-np.pi / 2, 0.0], scene.robot, nudge)
    limits = {"base": "none", "tau": [9.0, 4.0], "v": 8.0}
    return _plan(scene, start, np.array([np.pi / 2, 0.0]), 4.0, limits=limits)


def _chain(count: int, duration: float, **options: Any) -> Problem:
    def run(nudge: int) -> hovi.Solution:
        scene = hovi.Scene(
            hovi.load_robot(pin.buildModelFromXML(hovi.chain(count))), [hovi.effects.Gravity()]
        )
        start = np.zeros(count)
        start[0] = -np.pi / 2
        return _plan(scene, nudged(start, scene.robot, nudge), -start, duration, **options)

    return run


_problem("chain of 3")(_chain(3, 3.0, limits="none", intervals=32))
_problem("chain of 10")(_chain(10, 3.0, limits="none", intervals=32))
_problem("chain of 5 within limits")(
    _chain(5, 3.0, limits={"base": "none", "v": 4.0}, self_collision=False)
)


def _cell(robot: str, seed: int, obstacles: int, **options: Any) -> Problem:
    """A reach among random spheres near the middle of the way that leave both ends free."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given(robot)
        a, b = _ends(scene.robot, seed, 0.5)
        start = nudged(a, scene.robot, nudge)
        settings = {"self_collision": False, "duration": 2.5, **options}
        duration = settings.pop("duration")
        balls = _balls(scene.robot, [(a + b) / 2, a, b], seed, obstacles)
        return _plan(scene, start, b, duration, obstacles=balls, **settings)

    return run


def _balls(robot: hovi.Robot, given: list[Array], seed: int, number: int) -> list[hovi.Sphere]:
    """Spheres near the middle of the tip's way that are away from its given places."""
    rng, found = np.random.default_rng(100 + seed), list[hovi.Sphere]()
    middle, *ends = (robot.frame_position(robot.tip_frames[0], q) for q in given)
    while len(found) < number:
        place = middle + rng.uniform(-0.25, 0.25, 3)
        if min(np.linalg.norm(place - x) for x in ends) > 0.22:
            found.append(hovi.Sphere(place, 0.08, name=f"ball {len(found)}"))
    return found


for _seed in range(5):
    _problem(f"balls ur5 {_seed}", _seed in (0, 1))(_cell("ur5", _seed, 1 + _seed % 3))
for _seed in range(2):
    _problem(f"balls xarm7 {_seed}")(_cell("xarm7", _seed, 2))
_problem("balls without limits")(_cell("ur5", 2, 2, limits="none"))
_problem("balls and links without limits")(_cell("ur5", 1, 2, limits="none", self_collision=True))
_problem("balls and links")(_cell("ur5", 1, 2, self_collision=True))
_problem("balls smooth")(_cell("ur5", 1, 1, smooth=True))


def _scene(name: str, **options: Any) -> Problem:
    """A bundled scene, whose start is nudged where it is a vector."""

    def run(nudge: int) -> hovi.Solution:
        task = hovi.load_task(hovi.example(name))
        if isinstance(task.start, hovi.State):
            q = task.start.on(task.scene.robot, "start")[0]
            start = dataclasses.replace(task.start, q=nudged(q, task.scene.robot, nudge))
            task = dataclasses.replace(task, start=start)
        return hovi.plan_task(task, processes=1, **options)

    return run


for _name in ("ur5_past_ball", "ur5_around_sphere", "panda_reach_limited", "cart_pole_swing_up"):
    _problem(f"scene {_name}", _name.startswith("cart"))(_scene(_name))
for _name in ("acrobot_swing_up", "pendubot_swing_up", "two_link_elbow_limited"):
    _problem(f"scene {_name}", _name.startswith("pend"))(_scene(_name))
for _name in ("panda_pick", "panda_pick_and_place", "two_link_pick", "panda_lift", "ur5_reach"):
    _problem(f"scene {_name}", _name == "two_link_pick")(_scene(_name))
for _name in ("spacecraft_reorients", "solo_in_flight", "flying_body_flip", "panda_reach_rich"):
    _problem(f"scene {_name}")(_scene(_name))
_problem("scene kinova_reach", True)(_scene("kinova_reach"))
_problem("pendubot within limits")(
    _scene("pendubot_swing_up", limits={"base": "none", "v": 12.0}, starts=1)
)
_problem("cart pole within limits", True)(
    _scene("cart_pole_swing_up", limits={"base": "none", "v": 12.0}, starts=1)
)


def _frame(name: str, seed: int, **options: Any) -> Problem:
    """To where the tip of an arm is in a random configuration, its axis given."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given(name)
        robot = scene.robot
        a, b = _ends(robot, seed, 0.5)
        tip = robot.tip_frames[0]
        settings = {"duration": 2.5, "guess_at_goal": False, "self_collision": False, **options}
        duration = settings.pop("duration")
        guess = b if settings.pop("guess_at_goal") else None
        position = robot.frame_position(tip, b)
        axis = None if settings.pop("point", False) else ([0, 0, 1], _axis(robot, b, tip))
        goal = hovi.FrameGoal(tip, position=position, axis=axis, guess=guess)
        return _plan(scene, nudged(a, robot, nudge), goal, duration, **settings)

    return run


def _axis(robot: hovi.Robot, q: Array, frame: str) -> Array:
    return np.asarray(robot.frame_pose(frame, q))[:3, 2]


_problem("frame goal ur5", True)(_frame("ur5", 1, guess_at_goal=True))
_problem("frame goal ur5 branches")(_frame("ur5", 2))
_problem("frame goal ur5 point")(_frame("ur5", 3, point=True))
_problem("frame goal panda")(_frame("panda", 1))
_problem("frame goal links")(_frame("ur5", 4, self_collision=True))
_problem("frame goal without limits")(_frame("ur5", 4, limits="none", guess_at_goal=True))
_problem("frame goal smooth")(_frame("ur5", 5, smooth=True, guess_at_goal=True))


def _coupled(arm: str, seed: int, limits: Any, rate: bool = False) -> Problem:
    """The third joint follows the sine of the second; with a rate, the fourth a product of both."""

    def curve(q: Any) -> Any:
        return q[2] - casadi.sin(q[1])

    def turning(q: Any, v: Any) -> Any:
        return v[3] - q[0] * v[1]

    def solved(nudge: int) -> hovi.Solution:
        scene = _given(arm)
        a, goal = _ends(scene.robot, seed, 0.3)
        start = nudged(a, scene.robot, nudge)
        value = start[2] - np.sin(start[1])
        goal[2] = np.sin(goal[1]) + value
        asked = [hovi.Condition(curve, hovi.Equal(value), name="curve")]
        if rate:
            asked.append(hovi.Condition(turning, hovi.Equal(), name="turning"))
        return _plan(scene, start, goal, 2.0, limits=limits, conditions=asked, self_collision=False)

    return solved


_problem("coupled joints ur5", True)(_coupled("ur5", 1, "urdf"))
_problem("coupled joints panda")(_coupled("panda", 2, "urdf"))
_problem("coupled joints z1")(_coupled("z1", 3, "none"))
_problem("coupled speeds ur5")(_coupled("ur5", 4, "urdf", rate=True))
_problem("coupled speeds without limits")(_coupled("ur5", 5, "none", rate=True))


@_problem("via ur5", True)
def _via(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    a, b = _ends(scene.robot, 2, 0.4)
    via = hovi.Via(1.2, hovi.State((a + b) / 2 + 0.2))
    start = nudged(a, scene.robot, nudge)
    return _plan(scene, start, b, 2.5, via=[via], self_collision=False)


@_problem("via frame without limits")
def _via_frame(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    a, b = _ends(scene.robot, 2, 0.4)
    place = scene.robot.frame_position("tool0", (a + b) / 2 + 0.1)
    via = hovi.Via(1.2, hovi.FrameGoal("tool0", position=place))
    start = nudged(a, scene.robot, nudge)
    return _plan(scene, start, b, 2.5, via=[via], limits="none", self_collision=False)


def _sequence(seed: int, balls: int, **options: Any) -> Problem:
    def run(nudge: int) -> hovi.Solution:
        scene = _given("ur5")
        a, b = _ends(scene.robot, seed, 0.4)
        middle = (a + b) / 2 + np.array([0.3, -0.2, 0.2, 0.0, 0.1, 0.0])
        segments = [hovi.Segment(middle, 1.5), hovi.Segment(b, 1.5)]
        given = [(3 * a + b) / 4, a, middle, b]
        obstacles = _balls(scene.robot, given, seed, balls)
        settings = {"self_collision": False, "obstacles": obstacles, "processes": 1, **options}
        start = nudged(a, scene.robot, nudge)
        return hovi.plan_sequence(scene, start, segments, **settings)

    return run


_problem("sequence ur5")(_sequence(1, 0))
_problem("sequence among balls", True)(_sequence(2, 1))
_problem("sequence among balls, smooth")(_sequence(2, 1, smooth=True))
_problem("sequence among balls, links")(_sequence(2, 1, self_collision=True))

_problem("duration ur5", True)(
    _between("ur5", 4, 0.4, (0.5, 4.0), time_weight=50.0, self_collision=False)
)
_problem("duration ur5 without limits")(
    _between("ur5", 4, 0.3, (0.5, 4.0), time_weight=50.0, limits="none", self_collision=False)
)
_problem("duration panda")(
    _between("panda", 2, 0.4, (0.3, 5.0), time_weight=200.0, self_collision=False)
)
_problem("duration by frame")(
    _frame("ur5", 1, duration=(0.8, 4.0), time_weight=50.0, guess_at_goal=True)
)
_problem("duration by frame without limits")(
    _frame("ur5", 1, duration=(0.8, 4.0), time_weight=50.0, guess_at_goal=True, limits="none")
)
_problem("duration past balls")(_cell("ur5", 4, 2, duration=(0.5, 4.0), time_weight=50.0))
_problem("duration past balls and clear of links")(
    _cell("ur5", 1, 2, duration=(0.5, 4.0), time_weight=50.0, self_collision=True)
)
_problem("duration too short at first")(
    _between("ur5", 6, 0.8, (0.02, 3.0), time_weight=50.0, self_collision=False)
)
_problem("least time ur5")(
    _between("ur5", 4, 0.3, (0.3, 4.0), objective="time", self_collision=False)
)


def _again(name: str, number: int, far: float, **options: Any) -> Problem:
    """Replanned from starts and to goals that move, the steps of all together."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given(name)
        a, b = _ends(scene.robot, 4, 0.35)
        rng = np.random.default_rng(0)
        settings = {"self_collision": False, **options}
        motion = _plan(scene, nudged(a, scene.robot, nudge), b, 2.0, **settings)
        steps, good = motion.nit, motion.success
        for _ in range(number):
            move = far * rng.uniform(-1, 1, len(a))
            motion = motion.replan(start=a + move, goal=b - move)
            steps, good = steps + motion.nit, good and motion.success
        return dataclasses.replace(motion, nit=steps, success=good)

    return run


_problem("replan ur5", True)(_again("ur5", 3, 0.02))
_problem("replan ur5 far")(_again("ur5", 3, 0.3))
_problem("replan panda little")(_again("panda", 3, 1e-3))
_problem("replan ur5 on 12 intervals")(_again("ur5", 3, 0.02, intervals=12))
_problem("replan z1 on 12 intervals")(_again("z1", 3, 0.05, intervals=12))
_problem("replan without limits", True)(_again("ur5", 3, 0.05, limits="none"))
_problem("replan among balls")(
    _again("ur5", 2, 0.02, obstacles=[hovi.Sphere([0.9, 0.9, 0.3], 0.1)])
)


def _advanced(off: float, **options: Any) -> Problem:
    """A receding horizon whose states are measured off the motion."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given("ur5")
        a, b = _ends(scene.robot, 4, 0.4)
        rng = np.random.default_rng(1)
        settings = {"self_collision": False, **options}
        motion = _plan(scene, nudged(a, scene.robot, nudge), b, 1.6, **settings)
        steps, good = motion.nit, motion.success
        for _ in range(4):
            at = motion.trajectory.sample(0.21)
            measured = at.q[0] + off * rng.uniform(-1, 1, len(a))
            motion = motion.advance(0.21, hovi.State(measured, at.v[0]))
            steps, good = steps + motion.nit, good and motion.success
        return dataclasses.replace(motion, nit=steps, success=good)

    return run


_problem("advance ur5", True)(_advanced(1e-3))
_problem("advance ur5 noisy")(_advanced(0.02))
_problem("advance ur5 on 16 intervals")(_advanced(1e-3, intervals=16))
_problem("advance within torques")(_advanced(5e-3, limits={"tau": [150, 100, 90, 28, 28, 28]}))
_problem("advance without limits")(_advanced(1e-3, limits="none"))


def _outside(fraction: float) -> Problem:
    """From a start that is faster than its limit, or beyond a position."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given("ur5")
        a, b = _ends(scene.robot, 4, 0.35)
        limits = {"v": 1.0, "a": 4.0}
        v = np.zeros(6)
        v[[0, 2]] = 1.0 + fraction, -1.0 - fraction
        start = hovi.State(nudged(a, scene.robot, nudge), v)
        return _plan(scene, start, b, 2.5, limits=limits, self_collision=False)

    return run


_problem("way back of a velocity", True)(_outside(0.015))
_problem("way back of a velocity, little")(_outside(0.001))


@_problem("way back of a position")
def _beyond(nudge: int) -> hovi.Solution:
    scene = _given("panda")
    robot = scene.robot
    a, b = _ends(robot, 4, 0.35)
    a = nudged(a, robot, nudge)
    a[1] = robot.upper[1] + 0.01
    return _plan(scene, a, b, 2.5, self_collision=False)


_problem("jerk and torque rates")(
    _between("panda", 4, 0.3, 1.5, limits="panda", smooth=True, self_collision=False)
)
_problem("torque rates that hold", True)(
    _between("ur5", 4, 0.4, 1.2, smooth=True, self_collision=False, limits={"torque_rate": 150.0})
)


@_problem("pulse")
def _pulse(nudge: int) -> hovi.Solution:
    """A narrow pulse of a formula of time, and a wall in q."""
    import casadi as ca

    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    wall = hovi.effects.CasadiCost(lambda q, *_: 20.0 * ca.exp(-(((q[0] - 0.3) / 0.004) ** 2)))
    scene = hovi.Scene(robot, [hovi.effects.Gravity(), wall])
    start = nudged([-np.pi / 2, 0.0], robot, nudge)
    return _plan(scene, start, np.array([1.0, 0.4]), 2.0, limits="none")


for _seed in (5, 6, 8, 9, 10):
    _problem(f"balls ur5 {_seed}")(_cell("ur5", _seed, 1 + _seed % 3))
for _seed in (4, 5):
    _problem(f"balls ur5 {_seed} without limits")(_cell("ur5", _seed, 2, limits="none"))
for _seed in (3, 4, 6):
    _problem(f"balls z1 {_seed}")(_cell("z1", _seed, 1))


def _task(name: str) -> Problem:
    """One of the tasks of models/tasks."""

    def run(nudge: int) -> hovi.Solution:
        task = hovi.load_task(TASKS / f"{name}.toml")
        q = task.start.on(task.scene.robot, "start")[0]
        start = dataclasses.replace(task.start, q=nudged(q, task.scene.robot, nudge))
        return hovi.plan_task(dataclasses.replace(task, start=start), processes=1)

    return run


for _name in ("bar/four_axis_under_bar", "bin/ur5_bin_to_bin", "bin/four_axis_into_crate"):
    _problem(f"task {_name}")(_task(_name))
for _name in ("payload/four_axis_palletizes", "table/four_axis_sorts"):
    _problem(f"task {_name}")(_task(_name))

_problem("chain of 10 in few steps")(
    _chain(10, 3.0, limits="none", intervals=32, max_iterations=12)
)
_problem("chain of 5 within limits in few steps")(
    _chain(5, 3.0, limits={"base": "none", "v": 4.0}, intervals=24, max_iterations=6)
)


@_problem("turns of kinova")
def _turns(nudge: int) -> hovi.Solution:
    scene = _given("kinova")
    a, b = np.random.default_rng(1).uniform(-1.0, 1.0, (2, scene.robot.nv))
    a[1] += NUDGE * nudge
    ends = [dict(zip(scene.robot.joint_names, each.tolist(), strict=True)) for each in (a, b)]
    return _plan(scene, *ends, 2.0, starts=2, intervals=12, limits="none", self_collision=False)


def _at_rest(passive: tuple[str, ...], limits: Any) -> Problem:
    """A robot that hangs, and goes on hanging."""

    def run(nudge: int) -> hovi.Solution:
        robot = hovi.load_robot(hovi.example("two_link.urdf"))
        scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=passive)
        start = np.array([-np.pi / 2, 0.0])
        return _plan(scene, start, start, 1.0, limits=limits)

    return run


_problem("at rest")(_at_rest((), "none"))
_problem("at rest within limits")(_at_rest((), {"base": "none", "v": 4.0}))
_problem("at rest, passive")(_at_rest(("elbow",), "none"))
_problem("at rest, passive, within limits")(_at_rest(("elbow",), {"base": "none", "v": 4.0}))


@_problem("a pole held where it would fall")
def _fallen(nudge: int) -> hovi.Solution:
    robot = hovi.load_robot(hovi.example("cart_pole.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=robot.joint_names[1:])
    start = nudged([0.0, 0.5], robot, nudge)
    return _plan(
        scene,
        start,
        np.array([0.0, 0.5]),
        1.0,
        limits={"base": "none", "q": [[-1e-3, 1e-3], [-3, 3]]},
    )


def _swing(duration: Any, **options: Any) -> Problem:
    """A swing-up within limits on torques, which hold between the points."""

    def run(nudge: int) -> hovi.Solution:
        robot = hovi.load_robot(hovi.example("two_link.urdf"))
        scene = hovi.Scene(robot, [hovi.effects.Gravity()])
        limits = {"base": "none", "tau": [9.0, 4.0], "v": 8.0}
        start = nudged([-np.pi / 2, 0.0], robot, nudge)
        settings = {"limits": limits, "self_collision": False, **options}
        return _plan(scene, start, np.array([np.pi / 2, 0.0]), duration, **settings)

    return run


_problem("swing within torques on 5 intervals")(_swing(4.0, intervals=5))
_problem("swing within torques on 9 intervals")(_swing(3.0, intervals=9))
_problem("swing within torques of a free duration")(_swing((1.0, 8.0), time_weight=3.0))
_problem("swing within torques in a hurry")(_swing((0.5, 8.0), time_weight=1e3, intervals=8))
_problem("swing within far limits")(
    _swing(3.0, limits={"base": "none", "tau": 1e3, "v": 1e3, "q": 50.0})
)
_problem("duration by frame, too short at first")(
    _frame("ur5", 1, duration=(0.05, 3.0), time_weight=50.0, guess_at_goal=True)
)
_problem("tight frame goal")(_frame("ur5", 2, duration=0.9))
_problem("replan within limits to frames")(lambda nudge: _to_frames(nudge, "urdf"))
_problem("replan without limits to frames")(lambda nudge: _to_frames(nudge, "none"))


def _to_frames(nudge: int, limits: str) -> hovi.Solution:
    """Replanned to places of the tip, near and far."""
    scene = _given("ur5")
    robot = scene.robot
    a, b = _ends(robot, 3, 0.4)
    place = robot.frame_position("tool0", b)
    goal = hovi.FrameGoal("tool0", position=place, guess=b)
    start = nudged(a, robot, nudge)
    motion = _plan(scene, start, goal, 2.5, limits=limits, self_collision=False)
    steps, good = motion.nit, motion.success
    for move in ([0.02, 0.0, 0.0], [0.0, 0.15, 0.1]):
        place = place + np.array(move)
        motion = motion.replan(goal=hovi.FrameGoal("tool0", position=place))
        steps, good = steps + motion.nit, good and motion.success
    return dataclasses.replace(motion, nit=steps, success=good)


@_problem("advance to the end of an interval")
def _to_node(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    a, b = _ends(scene.robot, 4, 0.4)
    motion = _plan(scene, nudged(a, scene.robot, nudge), b, 1.6, self_collision=False)
    t = motion.trajectory.t
    return motion.advance(float(0.99 * t[2] + 0.01 * t[1]))


@_problem("planned again from a fine motion")
def _guessed(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    a, b = _ends(scene.robot, 4, 0.3)
    start = nudged(a, scene.robot, nudge)
    fine = _plan(
        scene, start, b, 2.0, intervals=40, scheme="galerkin-2", limits="none", self_collision=False
    )
    return _plan(scene, start, b, 2.0, guess=fine.trajectory, limits="none", self_collision=False)


def _late(fraction: float, duration: float) -> Problem:
    """From a start that is faster than its limit, with little time."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given("ur5")
        a, _ = _ends(scene.robot, 4, 0.35)
        v = np.zeros(6)
        v[[0, 2]] = 1.0 + fraction, -1.0 - fraction
        start = hovi.State(nudged(a, scene.robot, nudge), v)
        goal = a + 0.6 * duration * v
        limits = {"v": 1.0, "a": 2.0}
        return _plan(scene, start, goal, duration, limits=limits, self_collision=False)

    return run


_problem("way back in little time")(_late(0.019, 1.0))
_problem("way back in less time")(_late(0.019, 0.8))


# What tests noticed where no problem above did


def _links_apart(name: str, start: list[float], goal: list[float], **options: Any) -> Problem:
    """A reach without limits whose links would meet."""

    def run(nudge: int) -> hovi.Solution:
        scene = _given(name)
        q = nudged(start, scene.robot, nudge)
        return _plan(scene, q, np.array(goal), 1.5, limits="none", **options)

    return run


_problem("ur5 clear of its links without limits")(
    _links_apart("ur5", [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0])
)


@_problem("branches that links decide")
def _branches_by_links(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    start = nudged([-2.3758, -1.7605, -1.7208, -0.5681, 0.5744, 1.6046], scene.robot, nudge)
    there = np.array([[-1.7827, 0.2879, -1.0746, 1.5469, 0.6747, -1.358]])
    goal = hovi.FrameGoal("tool0", scene.robot.frame_pose("tool0", there[0]))
    return _plan(scene, start, goal, 2.5)


@_problem("replan of a plan with all defaults")
def _replan_by_default(nudge: int) -> hovi.Solution:
    scene = _given("ur5")
    start, goal = np.array([0.0, -1.2, 1.4, -1.8, -1.5, 0.0]), [1.1, -0.9, 1.0, -1.2, -1.0, 0.5]
    known = _plan(scene, nudged(start, scene.robot, nudge), np.array(goal), 1.2)
    return known.replan(start=start + 1e-3)
