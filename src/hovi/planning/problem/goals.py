"""Goals and via points of a motion: joint states or task-space goals."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import numbers_of
from hovi.checks.units import seconds
from hovi.conditions.function import Function, linear
from hovi.conditions.state_difference import StateDifference
from hovi.discrete.state import ALL, State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal, PoseDifference, all_of
from hovi.planning.problem.inverse_kinematics import (
    InverseKinematicsResult,
    nearest_configuration,
)
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.presolve.frame_hints import hint_on_frame
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

FREE = "free"
"""The time of a via point that is passed when that costs least."""
SATISFIED = 1e-6
"""Largest distance, in [m], and angle, in [rad], between a goal and a frame that satisfies it."""
AT_LIMIT = 1e-9
"""Distance from its limit, relative to its range, up to which a position is at it."""
FULL_RANK = 1e-6
"""Least singular value of a goal's Jacobian at an isolated configuration, relative to its norm."""


@check_arguments_except("time", "goal")
@dataclass(frozen=True, eq=False)
class Via:
    """A via point: a goal that the motion reaches at a given time.

    time: in [s]; a text such as "500 ms" is converted. "free" for the time at which passing it
        costs least; infinite from then on.
    goal: a State, whose velocity is free if none is given, or its configuration alone; or a
        FrameGoal, or a list of them for several frames at once, which leaves all velocities free.
    Raises InputError for a time that is not positive, or another kind of goal.
    """

    time: float
    goal: State | FrameGoal
    takes_turns: ClassVar[bool] = False
    takes_regions: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if isinstance(self.goal, list | tuple) and any(isinstance(x, FrameGoal) for x in self.goal):
            object.__setattr__(self, "goal", all_of(self.goal))
        if isinstance(self.goal, np.ndarray | list | tuple):
            q = numbers_of("the goal of a via point", self.goal)
            object.__setattr__(self, "goal", State(q))
        if not isinstance(self.goal, State | FrameGoal):
            raise InputError(
                f"the goal of a via point must be a hovi.State(q) or a hovi.FrameGoal, got "
                f"{self.goal!r}."
            )
        free = isinstance(self.time, str | float) and self.time in (FREE, np.inf)
        time = np.inf if free else seconds(self.time, "the time of a via point")
        object.__setattr__(self, "time", time)
        if not (free or (np.isfinite(time) and time > 0)):
            raise InputError(f"the time of a via point must be positive, got {self.time} s.")
        if isinstance(self.goal, State) and self.goal.turns and not self.takes_turns:
            raise InputError("a via point takes no `turns`: set them on the goal.")
        if isinstance(self.goal, FrameGoal) and self.goal.regional and not self.takes_regions:
            raise InputError(
                "a via point takes no region: leave `within` out, or make it the goal of a segment."
            )
        rates = ("a", "free_acceleration", "jerk", "free_jerk")
        given = [key for key in rates if _is_given(getattr(self.goal, key, None))]
        if given:
            raise InputError(f"a via point takes no `{given[0]}`: leave it out.")

    @property
    def timed(self) -> bool:
        """Whether it has a time."""
        return bool(np.isfinite(self.time))


def _is_given(value: object) -> bool:
    """Whether a field of a State is neither None nor an empty sequence."""
    return value is not None and not (isinstance(value, tuple | list) and len(value) == 0)


def require_times(via: Sequence[Via]) -> None:
    """Raise InputError for via points without times."""
    if not all(each.timed for each in via):
        raise InputError(
            'a via point with time = "free" is for hovi.plan: give the via points of a problem or '
            "a sequence their times, or make them goals of segments with free durations."
        )


@dataclass(frozen=True, eq=False)
class GoalState:
    """A state that reaches a goal, what vanishes there, and why it cannot be reached, or ""."""

    state: State
    differences: tuple[Function, ...] = ()
    reason: str = ""


def goal_state(
    goal: State | FrameGoal,
    name: str,
    coordinates: Coordinates,
    near: Array,
    limits: Limits | None,
    free: Sequence[str] = (),
) -> GoalState:
    """A state at the goal: the goal itself, or by inverse kinematics.

    Joints that do not move the frame of a goal are held where they are in `near`: a hand that is
    not mentioned keeps its opening.
    name: of the goal in messages. near: the first seed, shape (nq,). limits: those on q apply.
    free: joints that are free in any case.
    Raises InputError for another kind of goal, or a frame that the robot does not have.
    """
    if isinstance(goal, State):
        return GoalState(goal)
    if not isinstance(goal, FrameGoal):
        raise InputError(f"the {name} must be a State or a FrameGoal, got {type(goal).__name__}.")
    if not isinstance(coordinates, Robot):
        raise InputError(f"the {name} must be a State: {coordinates.owner} has no frames.")
    difference = _difference(coordinates, goal)  # which checks the frame
    reached = _solved_inverse_kinematics(coordinates, goal, near.tobytes(), limits)
    moving = _moving_joints(coordinates, goal, tuple(free))
    velocities = _velocities(coordinates, goal)
    v = _least_velocity(coordinates, reached.q, velocities) if velocities else None
    state = State(reached.q, v, free=moving, free_velocity=goal.free_velocities(coordinates))
    advice = f"move the {name} closer or give its FrameGoal a guess"
    reason = reached.reason and (
        f"no configuration that reaches the {name} was found: at the nearest, {reached.reason}; "
        f"{hint_on_frame(coordinates, goal) or advice}"
    )
    # of one frame alone all rows are kept: which follow at a configuration may select another root
    wanted = _independent(difference) if goal.also and not reason else difference
    held = (wanted,) if wanted.size > 0 else ()
    return GoalState(state, (*held, *velocities), reason)


def held_goal(goal: FrameGoal, robot: Robot, q: Array, free: Sequence[str] = ()) -> State | None:
    """The state at q, (nq,), that satisfies a goal of a frame; None if q does not, or for a goal
    that is not `exact`.

    free: joints that are free in it if they do not move the frame.
    """
    if not goal.exact or max(goal.miss(robot, q)) > SATISFIED:
        return None
    moves = goal.moves(robot)
    left = tuple(each for each in free if each == ALL or not moves[robot.entries_of(each)].any())
    return None if ALL in left else State(q, free=left, free_velocity=tuple(goal.free_velocity))


def is_isolated(goal: FrameGoal, robot: Robot, q: Array) -> bool:
    """Whether q, (nq,), alone satisfies a goal nearby: the goal's Jacobian has full column rank."""
    if not goal.exact:
        return False
    moves = goal.moves(robot)
    J = linear(_difference(robot, goal), q, np.zeros(robot.nv))[1][:, 0, moves]
    return bool(np.linalg.matrix_rank(J, tol=FULL_RANK * np.linalg.norm(J)) == moves.sum())


def _moving_joints(robot: Robot, goal: FrameGoal, free: tuple[str, ...]) -> tuple[str, ...]:
    """The joints that are free at the goal of a frame: those that move it, and the given ones."""
    moves = goal.moves(robot)
    if moves.all() or ALL in free:
        return (ALL,)
    own = (joint for joint in robot.joint_names if moves[robot.entries_of(joint)].any())
    return tuple(dict.fromkeys((*own, *free)))


def _least_velocity(robot: Robot, q: Array, wanted: Sequence[Function]) -> Array:
    """The least v, (nv,), with which frames have their velocities at q, as far as they can."""
    missed, J = zip(*(linear(each, q, np.zeros(robot.nv)) for each in wanted), strict=True)
    v = np.linalg.lstsq(np.concatenate(J)[:, 1], -np.concatenate(missed), rcond=FULL_RANK)[0]
    return np.asarray(v, dtype=float)


def via_differences(
    reached: GoalState, coordinates: Coordinates, limits: Limits | None
) -> tuple[Function, ...]:
    """What vanishes at a via point. reached: a state that reaches its goal. limits: there."""
    if reached.differences:
        return reached.differences
    q, v = reached.state.on(coordinates, "via")
    held = ~reached.state.free_on(coordinates, "via")
    held[1] &= reached.state.v is not None
    held[1] |= turning(q, held[0], coordinates, limits)
    return (StateDifference(coordinates, (q, v), held),)


def turning(q: Array, held: Mask, coordinates: Coordinates, limits: Limits | None) -> Mask:
    """Which joints, given at a limit between the ends, can only rest there, (nv,).

    q: shape (nq,). held: which components are given. limits: there; None for none.
    """
    if limits is None:
        return np.zeros(held.shape, dtype=bool)
    x = coordinates.space.coordinates(q)
    apart = np.minimum(np.abs(x - limits.lower[0]), np.abs(limits.upper[0] - x))
    return np.asarray(held & np.isfinite(apart) & (apart <= AT_LIMIT * limits.ranges[0]))


@lru_cache(maxsize=256)
def _difference(robot: Robot, goal: FrameGoal) -> PoseDifference:
    """The difference from a goal, cached; robots and goals are immutable."""
    return goal.difference(robot)


@lru_cache(maxsize=256)
def _velocities(robot: Robot, goal: FrameGoal) -> tuple[Function, ...]:
    return goal.velocities(robot)


@lru_cache(maxsize=256)
def _independent(difference: PoseDifference) -> PoseDifference:
    return difference.independent


@lru_cache(maxsize=256)
def _solved_inverse_kinematics(
    robot: Robot, goal: FrameGoal, near: bytes, limits: Limits | None
) -> InverseKinematicsResult:
    first = np.frombuffer(near) if goal.guess is None else goal.guess
    first = robot.check_configuration(first, "the goal's guess")
    unbounded = np.full((2, robot.nv), np.inf) * [[-1], [1]]
    bounds = unbounded if limits is None else (limits.lower[0], limits.upper[0])
    return nearest_configuration(robot, goal, first, (bounds[0], bounds[1]))
