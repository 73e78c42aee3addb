"""What a motion is to reach: a state or a frame's goal, at its end or on the way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import ALL, State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import Reached, inverse_kinematics
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.node_conditions import Condition, JointCondition
from hovi.planning.problem.values import seconds
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Via:
    """What a motion passes through on its way.

    time: when, in [s]; a text such as "500 ms" becomes the number.
    goal: a State, whose velocity is free where none is given, or a FrameGoal, which leaves all
        velocities free.
    Raises InputError for a time that is not positive, or what is no goal.
    """

    time: float
    goal: State | FrameGoal

    def __post_init__(self) -> None:
        if not isinstance(self.goal, State | FrameGoal):
            raise InputError(
                f"a via point is a hovi.State(q) or a hovi.FrameGoal, not {self.goal!r}."
            )
        object.__setattr__(self, "time", seconds(self.time, "the time of a via point"))
        if not (np.isfinite(self.time) and self.time > 0):
            raise InputError(f"the time of a via point must be positive, got {self.time} s.")
        if isinstance(self.goal, State) and self.goal.turns:
            raise InputError("a via point takes no turns: they belong to the goal.")


@dataclass(frozen=True, eq=False)
class Met:
    """A state that meets a goal, the equations that keep it there, and why it fails, or ""."""

    state: State
    conditions: tuple[Condition, ...] = ()
    reason: str = ""


def met(
    goal: State | FrameGoal, name: str, robot: Robot, near: Array, limits: Limits | None
) -> Met:
    """A state at the goal: itself, or by inverse kinematics.

    name: what the goal is called in a sentence. near: where the search starts, shape (nq,).
    limits: those on q are kept.
    Raises InputError for what is no goal, or a frame that the robot does not have.
    """
    if isinstance(goal, State):
        return Met(goal)
    if not isinstance(goal, FrameGoal):
        raise InputError(f"the {name} is a State or a FrameGoal, not {type(goal).__name__}.")
    reached = _reached(robot, goal, near.tobytes(), limits)
    state = State(reached.q, free=(ALL,), free_velocity=tuple(goal.free_velocity))
    reason = reached.reason and (
        f"no configuration that reaches the {name} was found: at the nearest, {reached.reason}; "
        "move it nearer, or hand in its guess"
    )
    return Met(state, (_condition(robot, goal),), reason)


def via_conditions(via: Via, met: Met, robot: Robot) -> tuple[Condition, ...]:
    """The equations of a via point."""
    if met.conditions:
        return met.conditions
    q, v = met.state.on(robot, "via")
    held = ~met.state.free_on(robot, "via")
    held[1] &= met.state.v is not None
    return (JointCondition(robot, q, v, held),)


@lru_cache(maxsize=256)
def _condition(robot: Robot, goal: FrameGoal) -> Condition:
    """Built once for a robot and a goal, which are what they are for good."""
    return goal.condition(robot)


@lru_cache(maxsize=256)
def _reached(robot: Robot, goal: FrameGoal, near: bytes, limits: Limits | None) -> Reached:
    first = np.frombuffer(near) if goal.guess is None else goal.guess
    first = robot.check_configuration(first, "the goal's guess")
    bounds = (None, None) if limits is None else (limits.lower[0], limits.upper[0])
    return inverse_kinematics(robot, goal, first, *bounds)
