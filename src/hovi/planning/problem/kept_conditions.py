"""The conditions of what a motion keeps, between its ends; and how a start enters them.

What was measured or typed misses a line or a direction by a little. The motion then begins with
what its start has, and reaches the value by a polynomial of degree 5 in the first part of it:

    y = (1 - s)^4 (y0 + s (4 y0 + T_b y0')), s = t / T_b, up to s = 1 and 0 from there on,

which is y0 with the rate y0' at t = 0 and has three continuous derivatives at T_b.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, cast

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition, EquationAlong, with_function
from hovi.conditions.excess import in_words
from hovi.conditions.expression import Expression
from hovi.conditions.function import at_state
from hovi.conditions.kept.keep import EndPoses, Keep, Pose
from hovi.conditions.places import Along
from hovi.discrete.state import Periodic, State
from hovi.errors import InputError, warn
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kept_goal import goal_along
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

ENTRY = 0.2
"""Fraction of a motion in which a start that misses a value enters it."""
MOST_MISSED = {
    "m": 1e-3,
    "rad": float(np.deg2rad(0.1)),
    "m/s": 1e-3,
    "rad/s": float(np.deg2rad(0.1)),
}
"""By how much a start may miss a value, by the unit of y; by its tolerance in others."""


def kept_between(
    kept: Sequence[Keep],
    robot: Robot,
    start: State | FrameGoal | None,
    goal: State | FrameGoal | Periodic | None,
    longest: float = np.inf,
) -> tuple[Keep, ...]:
    """What is kept, with what it does not say taken from both ends.

    longest: the largest duration, in [s]; inf where it is not known yet. Raises InputError, also
    for what cannot be kept in it.
    """
    ends = EndPoses(_poses(robot, start, "start"), _poses(robot, goal, "goal"))
    found = tuple(each.resolved(ends) for each in kept)
    if not (isinstance(goal, FrameGoal) and goal.regional):
        for each in found:
            each.require_time(ends, longest)
    return found


def conditions_kept(
    kept: Sequence[Keep],
    robot: Robot,
    start: State | FrameGoal | None,
    duration: float | tuple[float, float],
) -> tuple[Condition[Any, Any], ...]:
    """The conditions of what is kept, resolved. duration: of the motion, in [s], or its bounds.

    start: of the motion, which enters what it misses; None for what begins later.
    Raises InputError where a frame or a value does not fit, and for a start that misses a value by
    more than what is entered.
    """
    made = _on(robot, kept)
    if isinstance(start, State) and not start.free:
        made = [_entered(each, robot, start, duration) for each in made]
    return tuple(made)


def _on(robot: Robot, kept: Sequence[Keep]) -> list[Condition[Any, Any]]:
    parts = [(each, x.during) for x in kept for each in x.conditions(robot)]
    made = [dataclasses.replace(each, during=during) for each, during in parts]
    return [with_function(each, robot) for each in made]


def goal_kept(
    kept: Sequence[Keep],
    robot: Robot,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    bounds: tuple[Array, Array],
    duration: float,
) -> State | FrameGoal:
    """The goal, with the guess to which a way from the start leads along what is kept, if any.

    What is kept within a distance or an angle is kept itself along this way. bounds: limits on
    positions, (nv,) each. duration: of the way, in [s], for what is kept at times.
    """
    if isinstance(goal, State) or goal.guess is not None:
        return goal
    if not isinstance(start, State) or start.free:
        return goal
    rows = _on(robot, [each.centered for each in kept])
    q = goal_along(rows, robot, start.on(robot, "start")[0], goal, bounds, duration)
    return goal if q is None else dataclasses.replace(goal, guess=q)


def _poses(
    robot: Robot, end: State | FrameGoal | Periodic | None, name: str
) -> Callable[[str], Pose]:
    """What an end says of frames."""

    def pose(frame: str) -> Pose:
        for part in end.parts if isinstance(end, FrameGoal) else ():
            if part.frame == frame and not (part.bounds and name == "start"):
                given = part.rotation, part.position
                return Pose(*(None if each is None else np.asarray(each) for each in given))
        if isinstance(end, State) and not end.free:
            robot.check_frame_moves(frame)
            matrix = robot.frame_pose(frame, end.on(robot, name)[0])
            return Pose(matrix[:3, :3], matrix[:3, 3])
        return Pose()

    return pose


def _entered(
    each: Condition[Any, Any], robot: Robot, start: State, duration: float | tuple[float, float]
) -> Condition[Any, Any]:
    """An equation along a motion that begins where the start is; others as they are."""
    later = each.during is not None and each.during[0] > 0
    if later or not isinstance(each.where, Along) or each.where.level > 1:
        return each
    given, (q, v) = cast(EquationAlong, each), start.on(robot, "start")[:2]
    gap = _gap(given, q, v)
    rate = given.y.rate.values(at_state(q, v))[0] if given.where.level == 0 else np.zeros_like(gap)
    entry = int(np.argmax(np.abs(gap)))
    size, most = abs(float(gap[entry])), MOST_MISSED.get(given.unit, given.tolerance)
    if size <= given.tolerance:
        return each
    missed = f"{in_words(given, entry)} is missed by {size:.3g} {given.unit}".rstrip()
    if size > max(most, given.tolerance):
        raise InputError(
            f"{missed} at the start, more than the {most:.3g} {given.unit} from which a motion "
            "enters it: change the start or the value."
        )
    if isinstance(duration, tuple):
        raise InputError(
            f"{missed} at the start, and a motion that enters it needs a given duration: change "
            "the start or the value, or give the duration as one number."
        )
    if not isinstance(given.y, Expression):
        return each
    length = ENTRY * duration
    warn(f"{missed} at the start, and the motion enters it within {length:.3g} s.")
    return dataclasses.replace(each, function=given.y.minus(_entering(gap, rate, length)))


def _gap(given: EquationAlong, q: Array, v: Array) -> Array:
    return given.on.missed(given.y.values(at_state(q, v))[0])


def _entering(gap: Array, rate: Array, length: float) -> Callable[[ca.SX], ca.SX]:
    """What is left of a gap at a time: see the module."""

    def left(t: ca.SX) -> ca.SX:
        s = ca.fmin(t / length, 1.0)
        return (1.0 - s) ** 4 * (ca.DM(gap) + s * ca.DM(4.0 * gap + length * rate))

    return left
