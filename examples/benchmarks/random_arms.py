"""Shared by the benchmarks of limits: arms, random reaches, and checks that do not use hovi's.

Limits are checked at many samples with torques of pin.rnea. What these benchmarks need from inside
the solver is `cold_point_solve`.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

import hovi
from hovi.optimize.criteria import Criteria
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.start import Start
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.solver import guess_path
from hovi.robot.example_robots import example_robot

Array = npt.NDArray[np.float64]
Result = TypeVar("Result")

ARMS = ("ur5", "panda", "z1", "kinova", "xarm7")
HOLDING_FRACTION = 0.9
"""Largest torque that holds a start or goal, as a fraction of its limit."""
DURATIONS = (1.5, 2.0)
"""Range of the durations, in times at the velocity limits."""
SAMPLES = 50_000
_FINGERS = re.compile(r".*(finger|[Gg]ripper).*")


@dataclass(frozen=True)
class Reach:
    """A motion from rest to rest. start, goal: in [rad]. duration: in [s]."""

    start: Array
    goal: Array
    duration: float


def arm_scene(name: str, armature: float = 0.0, shapes: bool = False) -> hovi.Scene:
    """An arm under gravity with its fingers locked.

    Continuous joints become revolute joints with the limits of their <limit> tags: in the Kinova's
    URDF these are +-2 pi. armature: rotor inertia of every joint, in [kg m^2]. shapes: whether it
    has its collision shapes.
    """
    known = example_robot(name)
    text = known.urdf.read_text().replace('type="continuous"', 'type="revolute"')
    model = pin.buildModelFromXML(text)
    locked = [each for each in list(model.names)[1:] if _FINGERS.fullmatch(each)]
    effects: list[Any] = [hovi.effects.Gravity()]
    if armature:
        effects.append(hovi.effects.Armature(armature))
    if not shapes:
        return hovi.Scene(hovi.load_robot(model, locked=locked), effects)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / known.urdf.name
        path.write_text(text)
        given = {"package_dirs": [known.package_dir], "srdf": known.srdf, "locked": locked}
        return hovi.Scene(hovi.load_robot(path, **given), effects)


def random_reaches(scene: hovi.Scene, count: int, seed: int) -> list[Reach]:
    """Pairs drawn uniformly within the position limits that can be held at both ends.

    Joints that turn further than once are drawn in +-pi.
    """
    robot, rng = scene.robot, np.random.default_rng(seed)
    wide = robot.upper - robot.lower > 2 * np.pi
    lower = np.where(wide, np.maximum(robot.lower, -np.pi), robot.lower)
    upper = np.where(wide, np.minimum(robot.upper, np.pi), robot.upper)
    model, found = torque_model(scene), []
    while len(found) < count:
        start, goal = rng.uniform(lower, upper, (2, robot.nv))
        zero = np.zeros((2, robot.nv))
        holding = np.abs(rnea(model, np.stack([start, goal]), zero, zero))
        if (holding <= HOLDING_FRACTION * robot.effort_limit).all():
            fastest = float(np.max(np.abs(goal - start) / robot.velocity_limit))
            found.append(Reach(start, goal, float(rng.uniform(*DURATIONS)) * fastest))
    return found


def torque_model(scene: hovi.Scene) -> pin.Model:
    """The robot's model for pin.rnea, with the scene's gravity and armature."""
    model = scene.robot.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    rotors = [e.inertia for e in scene.effects if isinstance(e, hovi.effects.Armature)]
    model.armature = np.full(model.nv, rotors[0] if rotors else 0.0)
    return model


def rnea(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    """Torques of pin.rnea at M points, shape (M, nv), in [N m]."""
    data = model.createData()
    return np.array([pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)])


def largest_excess(scene: hovi.Scene, motion: hovi.Trajectory, limits: hovi.Limits) -> float:
    """Largest excess over a limit at SAMPLES times, as a fraction of its range."""
    x = motion.sample(np.linspace(0.0, motion.duration, SAMPLES))
    return outside(scene, limits, x.q, x.v, x.a)


def outside(scene: hovi.Scene, limits: hovi.Limits, q: Array, v: Array, a: Array) -> float:
    """Largest excess of q, v, a or the torques at M points, as a fraction of a limit's range."""
    worst = 0.0
    for row, y in enumerate((q, v, a, rnea(torque_model(scene), q, v, a))):
        low, high = limits.lower[row], limits.upper[row]
        limited = np.isfinite(low) & np.isfinite(high)
        excess = np.maximum(y - high, low - y)[:, limited] / (high - low)[limited]
        worst = max(worst, float(excess.max(initial=0.0)))
    return worst


def limited_problem(
    scene: hovi.Scene, reach: Reach, intervals: int, scheme: hovi.schemes.Scheme
) -> hovi.TrajectoryProblem:
    """A reach on a uniform grid, with the limits of the URDF at the quadrature points."""
    grid = hovi.Grid.uniform(reach.duration, intervals, scheme)
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    ends = hovi.State(reach.start), hovi.State(reach.goal)
    return hovi.TrajectoryProblem(ld, *ends, limits=hovi.as_limits(scene.robot, "urdf"))


@dataclass(frozen=True)
class PointSolve:
    """One interior-point solve with limits at the quadrature points, from the cubic guess."""

    steps: int
    cost: float
    seconds: float
    success: bool


def cold_point_solve(problem: hovi.TrajectoryProblem) -> PointSolve:
    """hovi's first interior-point solve on a problem's grid, and its processor time."""
    limits = problem.limits
    assert limits is not None
    path, criteria = guess_path(problem, "cubic"), Criteria(decrease=1e-9, max_iterations=500)
    seconds, found = timed(
        lambda: minimize_bounded(BoundedAction(problem, limits), Start(path), criteria)
    )
    good = found.feasible and found.why == "stationary"
    return PointSolve(len(found.steps), float(found.outputs.value), seconds, good)


def timed(work: Callable[[], Result]) -> tuple[float, Result]:
    """Processor time of one call, in [s], and its result."""
    began = time.process_time()
    result = work()
    return time.process_time() - began, result


def middle_and_most(values: Sequence[float], form: str = ".2g") -> str:
    """The median and the maximum as text, or "-" for none."""
    if len(values) == 0:
        return "-"
    return f"{np.median(values):{form}}, {max(values):{form}}"
