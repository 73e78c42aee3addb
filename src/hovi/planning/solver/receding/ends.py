"""The ends of motions that are planned again."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.state import Periodic, State
from hovi.errors import InputError, nearest, warn
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import (
    configurations,
    first_configuration,
    position_bounds,
)
from hovi.planning.problem.notation.ends import End, as_end
from hovi.planning.problem.notation.other_planners import instead_of
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.joint_table import with_angles
from hovi.robot.space.turns import nearest_angles

Array = npt.NDArray[np.float64]

NEAR_DISTANCE, NEAR_ANGLE = 0.1, 0.5
"""Distance in [m] and angle in [rad] from a frame goal up to which `replan` keeps the old end."""
NEARLY_AT_REST = 0.05
"""Velocity, in [rad/s] or [m/s], up to which a motion is taken as at rest."""
KEPT_OPTIONS = (
    *("duration", "time_weight", "tolerance", "scheme", "intervals", "limits", "via", "weight"),
    *("objective", "smooth", "obstacles", "grasped", "margin", "self_collision", "group", "turns"),
    *("starts", "continuation", "processes", "conditions", "keep", "repeat"),
)
"""Options of `plan` that `replan` and `advance` keep, or have no use for."""
ROOM = 5e-7
"""Distance of a start from a limit that it is at, as a fraction of the range or of 1 rad, m, rad/s
or m/s: without any there would be no motion strictly within the limits."""


def is_near(goal: FrameGoal, problem: TrajectoryProblem, path: DiscretePath) -> bool:
    """Whether the end of a path is near a frame goal, whose equations also hold at half a turn."""
    distance, angle = goal.miss(problem.robot, path.q[-1])
    return distance <= NEAR_DISTANCE and angle <= NEAR_ANGLE


def with_strictness(problem: TrajectoryProblem, strict: bool | None) -> TrajectoryProblem:
    """The same problem, whose start outside its limits is refused or led back; as it is if None."""
    limits = problem.limits
    if strict is None or limits is None or strict is limits.strict:
        return problem
    return dataclasses.replace(problem, limits=dataclasses.replace(limits, strict=strict))


def as_start(given: End, problem: TrajectoryProblem) -> State:
    """A start, from whatever `plan` takes. A frame stands for its configuration nearest to the old.

    Raises InputError, and UnreachableError for a frame that no configuration brings there.
    """
    start = as_end(given, problem.coordinates, "start")
    if isinstance(start, State):
        return start
    robot, limits = problem.robot, problem.limits
    start.check(robot)
    bounds = position_bounds(robot, "none" if limits is None else limits.at_ends[0])
    near = problem.ends[0][0] if start.guess is None else None
    first = first_configuration(robot, start, near, bounds)
    q = configurations(robot, start, first, bounds, problem.clearance or Clearance())[0]
    return State(q, free_velocity=tuple(start.free_velocity))


def as_goal(given: End | Periodic, problem: TrajectoryProblem) -> State | FrameGoal | Periodic:
    """A goal, from whatever `plan` takes, or Periodic. Raises InputError."""
    return given if isinstance(given, Periodic) else as_end(given, problem.coordinates, "goal")


def require_known(
    options: Mapping[str, Any], method: Callable[..., Any], solve: Callable[..., Any]
) -> None:
    """Raise InputError for options that neither a method of a solution nor a solve has."""
    if not options:
        return
    solving = [*inspect.signature(solve).parameters][2:]
    own = [*inspect.signature(method).parameters][1:-1]
    for name in options:
        if name in KEPT_OPTIONS:
            raise InputError(
                f"{method.__name__} keeps `{name}` as planned: call plan again to change it."
            )
        if name not in solving:
            hint = instead_of(name) or nearest(name, {*own, *solving})
            raise InputError(f"{method.__name__} has no option {name!r}: {hint}")


def first_state(path: DiscretePath) -> State:
    """The state that a path starts in."""
    return State(path.q[0], **dict(zip(("v", "a", "jerk"), path.rates[0], strict=False)))


def measured(given: End, problem: TrajectoryProblem, passed: State) -> State:
    """The state measured where a motion passes one; with its acceleration if none is given.

    Continuous joints that are measured without full turns have those nearest to the motion's.
    Warns of one that is given without a velocity, which means at rest, where the motion is not.
    Raises as `as_start` does.
    """
    start = as_start(given, problem)
    fastest = float(np.max(np.abs(passed.on(problem.coordinates, "start")[1]), initial=0.0))
    if start.v is None and not start.free_velocity and fastest > NEARLY_AT_REST:
        warn(
            f"the state is given without a velocity, that is at rest, where the motion passes at "
            f"up to {fastest:.3g} per second: give hovi.State(q, v)."
        )
    start = turned(start, problem.coordinates, passed.angles_on(problem.coordinates))
    return start if start.a is not None else dataclasses.replace(start, a=passed.a)


def turned(state: State, on: Coordinates, near: Array) -> State:
    """The state with angles of continuous joints; where q is (cos, sin), the nearest to others.

    near: the others, shape (nv,), in [rad].
    """
    if not on.space.angles:
        return state
    q, given = state.on(on, "start")[0], state.angles_on(on)
    angles = np.where(np.isnan(given), nearest_angles(q, near, on.space), given)
    return dataclasses.replace(state, q=with_angles(q, angles, on))


def inside_limits(state: State, problem: TrajectoryProblem) -> State:
    """A state that is at limits nearly, with room between it and them, moved by 1e-6 at most.

    Others are left as they are: they may be outside the limits.
    """
    on, limits = problem.coordinates, problem.limits
    if limits is None or not limits.bounded.any():
        return state
    first, given = limits.at_ends[0], state.jet_on(on, "start")
    moved: dict[str, Any] = {}
    for row, key in enumerate(("q", "v", "a")[: problem.ld.k]):
        if row == 0 and not on.vector_joints:
            continue
        x, room = given[row], ROOM * np.minimum(limits.ranges[row], 1.0)
        low, high = first.lower[row] + room, first.upper[row] - room
        near = np.where(limits.bounded[row], 2.0 * room, 0.0)
        inside = np.clip(x, low, high)
        moved[key] = np.where(np.abs(inside - x) <= near, inside, x)
    return dataclasses.replace(state, **moved)
