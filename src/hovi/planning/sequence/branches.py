"""Which configurations reach the frame goals of a sequence: the cheapest way through them all.

Every goal of a frame has several branches of inverse kinematics, and the choice of one goal's
branch changes what the next one costs. The branches are a graph in layers, whose edges cost what
the cubic between two configurations at rest does; its shortest path is found by dynamic
programming. Free velocities, limits and obstacles on the way are not part of this choice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import State
from hovi.errors import UnreachableError, warn
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import (
    NotClearError,
    configurations,
    first_configuration,
)
from hovi.planning.problem.kinematics.cubic_costs import cubic_costs
from hovi.planning.problem.limits import Range
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import Lagrangian
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
End = State | FrameGoal

COMPARED = 8
"""Number of branches of a goal that are compared, the nearest ones to the goal before it."""
UNKNOWN_COST = 1e200
"""Cost of a cubic whose cost is not finite."""


@dataclass(frozen=True, eq=False)
class MoveToGoal:
    """The motion of a sequence from one goal to the next, over one segment or several.

    numbers: of its segments, from 0. begin, end: in [s]. goal: at its end. bounds: of q there.
    name: of the segment that ends there, in messages.
    """

    numbers: tuple[int, ...]
    begin: float
    end: float
    goal: End
    bounds: Range
    name: str = ""


@dataclass(frozen=True, eq=False)
class _Layer:
    """The branches of a goal: q of shape (K, nq), and the one chosen before each, (K,).

    known: whether they reach the goal, or stand for one that cannot be reached.
    """

    q: Array
    cost: Array
    before: npt.NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    known: bool = True


def chosen_branches(
    robot: Robot,
    lagrangian: Lagrangian,
    start: MoveToGoal,
    moves: Sequence[MoveToGoal],
    clearance: Clearance,
) -> tuple[State, list[End]]:
    """The start as a state, and the goals with the branch in which each is reached as their guess.

    lagrangian: of the whole sequence. start: whose goal the start is.
    Goals that cannot be reached stay as they are, with a warning where that is for a distance.
    Raises UnreachableError for a start that cannot be reached.
    """
    for each in (start, *moves):
        if isinstance(each.goal, FrameGoal):
            each.goal.check(robot)
    first = _branches(robot, start, None, clearance)
    layers = [_Layer(first, np.zeros(len(first)))]
    for move in moves:
        layers.append(_next_layer(robot, lagrangian, move, layers[-1], clearance))
    chosen = int(np.argmin(layers[-1].cost))
    goals: list[End] = []
    for move, layer in zip(reversed(moves), reversed(layers[1:]), strict=True):
        goal = move.goal
        if isinstance(goal, FrameGoal) and layer.known:
            goal = replace(goal, guess=layer.q[chosen])
        goals.insert(0, goal)
        chosen = int(layer.before[chosen])
    begin = start.goal
    if isinstance(begin, FrameGoal):
        begin = State(layers[0].q[chosen], free_velocity=tuple(begin.free_velocity))
    return begin, goals


def _next_layer(
    robot: Robot, lagrangian: Lagrangian, move: MoveToGoal, last: _Layer, clearance: Clearance
) -> _Layer:
    """The branches of a move's goal, with the least cost at which each is reached."""
    try:
        q, known = _branches(robot, move, last.q[0], clearance), True
    except UnreachableError as error:
        if isinstance(error, NotClearError):
            warn(f"in {move.name!r} {error}")
        q, known = last.q[:1], False
    K, M = len(last.q), len(q)
    pairs = np.repeat(last.q, M, axis=0), np.tile(q, (K, 1))
    costs = cubic_costs(lagrangian, robot, *pairs, move.end - move.begin, move.begin)
    cost = last.cost[:, None] + costs.reshape(K, M)
    cost = np.where(np.isfinite(cost), cost, UNKNOWN_COST)
    before = np.argmin(cost, axis=0)
    return _Layer(q, cost[before, np.arange(M)], before, known)


def _branches(robot: Robot, move: MoveToGoal, near: Array | None, clearance: Clearance) -> Array:
    """Configurations at a goal, shape (K, nq): that at its guess alone if it has one."""
    end = move.goal
    if isinstance(end, State):
        return end.on(robot, "goal")[0][None]
    first = first_configuration(robot, end, near if end.guess is None else None, move.bounds)
    found = configurations(robot, end, first, move.bounds, clearance, time=move.end)
    return found[: 1 if end.guess is not None else COMPARED]
