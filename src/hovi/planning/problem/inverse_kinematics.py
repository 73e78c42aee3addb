"""Inverse kinematics: the configurations in which a frame reaches its goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_whole
from hovi.errors import InputError, UnreachableError, expect
from hovi.planning.clearance.clearance import DEFAULT_MARGIN, Clearance
from hovi.planning.clearance.clearance_violation import distance_in_words
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.clearance.self_collisions import can_keep_apart
from hovi.planning.obstacles.obstacle import Obstacle
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kinematics.branches import Branches, find_branches
from hovi.planning.problem.limits import Limits, Range, as_limits
from hovi.planning.problem.notation.ends import Frames, are_frames, end_of, frames_of
from hovi.planning.problem.presolve.frame_hints import hint_on_frame
from hovi.robot.robot import Robot
from hovi.robot.space.joint_table import configuration_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MOST = 16
"""Default number of configurations: a six-axis arm has no more."""
SEEDS = 1000
"""Default number of seeds."""
MAX_COUNT = 100_000
"""Largest number of configurations or seeds that may be asked for."""
SEARCHED = 4
"""Number of configurations that are searched for each one wanted, where obstacles rule some out."""


@dataclass(frozen=True, eq=False)
class InverseKinematicsResult:
    """A configuration, and its error in words.

    q: shape (nq,). reason: by how much q misses the goal; "" if it reaches it.
    """

    q: Array
    reason: str = ""


class NotClearError(UnreachableError):
    """Configurations reach a goal, but none that was found keeps its distances."""


@check_arguments_except("robot", "goal", "near", "limits", "obstacles", "margin", "most", "seeds")
def inverse_kinematics(
    robot: Robot,
    goal: FrameGoal | Mapping[str, Any] | Frames,
    *,
    near: npt.ArrayLike | str | Mapping[str, Any] | None = None,
    limits: str | Limits | Mapping[str, Any] = "urdf",
    obstacles: Sequence[Obstacle | Mapping[str, Any]] = (),
    margin: float = DEFAULT_MARGIN,
    self_collision: bool | None = False,
    most: int = MOST,
    seeds: int = SEEDS,
) -> Array:
    """Distinct configurations in which a frame reaches its goal, best first, shape (K, nq), K >= 1.

    The best is the one nearest to `near` in |q (-) near|. Goals hold to 1e-9 m and 1e-9 rad. A
    revolute joint with a range of more than a turn is given at the turn nearest to `near`;
    configurations that differ by full turns count as one. Where the joints are more than the
    equations of the goal, configurations form families, of which some members are returned that
    differ by at least 0.3 rad or m in a joint. Joints that do not move the frame keep the values of
    `near`.

    goal: what the frame has to reach: a FrameGoal, or a table such as {"frame": "tool0",
        "position": [0.4, 0.2, 0.3]}; or a list of these for several frames at once.
    near: a configuration (nq,), the name of a pose or a table of joints, from which the search
        begins; by default the goal's guess, or the middle of the joints' ranges, 0 for joints
        without or with full turns.
    limits: as for `plan`; only those on q count.
    obstacles, margin, self_collision: as for `plan`, but links may meet by default; configurations
        that come closer are left out.
    most: number of configurations at which the search ends.
    seeds: number of configurations from which it starts, at most.
    Raises UnreachableError, with the nearest configuration, if none is found; InputError.
    """
    expect(robot, Robot, "one from hovi.load_robot")
    if are_frames(goal):
        goal = frames_of(goal, "goal")
    if isinstance(goal, Mapping):
        goal = end_of(goal, "goal")  # type: ignore[assignment]  # which the next line checks
    expect(goal, FrameGoal, "hovi.FrameGoal(frame, ...), or its table with a `frame`")
    assert isinstance(goal, FrameGoal)
    goal.check(robot)
    most, seeds = _count("most", most), _count("seeds", seeds)
    both = can_keep_apart(robot) if self_collision is None else self_collision
    clearance = _clearance_of(obstacles, margin, both)
    bounds = position_bounds(robot, limits)
    first = first_configuration(robot, goal, near, bounds)
    return configurations(robot, goal, first, bounds, clearance, most, seeds)


def configurations(
    robot: Robot,
    goal: FrameGoal,
    near: Array,
    bounds: Range,
    clearance: Clearance,
    most: int = MOST,
    seeds: int = SEEDS,
    time: float | None = None,
) -> Array:
    """As `inverse_kinematics`: the configurations in which a frame reaches its goal, (K, nq).

    near: shape (nq,). bounds: as position_bounds. time: in [s], of what is carried then. Raises
    UnreachableError.
    """
    searched = min(SEARCHED * most, MAX_COUNT) if clearance.wanted else most
    found = find_branches(robot, goal, near, bounds, searched, seeds)
    if len(found.q) == 0:
        raise UnreachableError(_unreachable(robot, goal, found), found.best)
    q = by_distance(robot, found.q, near)
    if clearance.wanted:
        q = _clear(q, distances_between(robot, clearance).still(time), clearance.margin)
    return q[:most]


def nearest_configuration(
    robot: Robot, goal: FrameGoal, near: Array, bounds: Range
) -> InverseKinematicsResult:
    """The nearest of the configurations found that reach a goal, or the best one if none does.

    near: the first seed, to which distances are measured, shape (nq,). bounds: as position_bounds.
    """
    found = find_branches(robot, goal, near, bounds, MOST, SEEDS)
    if len(found.q) == 0:
        return InverseKinematicsResult(found.best, goal.miss_in_words(robot, found.best))
    return InverseKinematicsResult(by_distance(robot, found.q, near)[0])


def by_distance(robot: Robot, q: Array, near: Array) -> Array:
    """Configurations (K, nq), those first that are the nearest to `near`, (nq,)."""
    order = np.argsort(np.linalg.norm(robot.difference(near, q), axis=1), kind="stable")
    return np.asarray(q[order])


def position_bounds(robot: Robot, limits: str | Limits | Mapping[str, Any]) -> Range:
    """Lower and upper limits on q, shape (nv,). Raises InputError."""
    chosen = _named(robot, limits) if isinstance(limits, str) else as_limits(robot, limits)
    return chosen.lower[0], chosen.upper[0]


@lru_cache(maxsize=64)
def _named(robot: Robot, limits: str) -> Limits:
    return as_limits(robot, limits)


def first_configuration(
    robot: Robot,
    goal: FrameGoal,
    near: npt.ArrayLike | str | Mapping[str, Any] | None,
    bounds: Range,
) -> Array:
    """Where the search begins, shape (nq,). Raises InputError."""
    if near is not None:
        return robot.check_configuration(configuration_of(near, robot, "near"), "near")
    if goal.guess is not None:
        return robot.check_configuration(goal.guess, "the goal's guess")
    lower, upper = bounds
    centered = goal.moves(robot) & (upper - lower < 2 * np.pi)
    middle = np.zeros(robot.nv)
    middle[centered] = (lower[centered] + upper[centered]) / 2
    q = robot.neutral()
    indices, velocities = robot.space.plain
    q[indices] = np.clip(middle, lower, upper)[velocities]
    return q


def _clearance_of(obstacles: Any, margin: Any, self_collision: bool) -> Clearance:
    """The clearance, the same object for the same obstacles, whose distances are kept."""
    try:
        return _kept_clearance(tuple(obstacles), margin, self_collision)
    except TypeError:  # not hashable, or no sequence
        return Clearance(obstacles, margin, self_collision)


@lru_cache(maxsize=16, typed=True)
def _kept_clearance(obstacles: tuple[Obstacle, ...], margin: float, both: bool) -> Clearance:
    return Clearance(obstacles, margin, both)


def _clear(q: Array, distances: Distances, margin: float) -> Array:
    """The configurations that keep the margin. distances: of all that stands still.

    Raises NotClearError if none does.
    """
    if not distances.pairs:
        return q
    d = distances.values(q)
    kept = d.min(axis=1) >= margin
    if kept.any():
        return np.asarray(q[kept])
    best = int(np.argmax(d.min(axis=1)))
    pair = int(np.argmin(d[best]))
    distance = float(d[best, pair] - distances.allowance[pair])
    raise NotClearError(
        f"the goal is met by {len(q)} configurations that were found, but all of them come closer "
        f"to obstacles or links than {margin:g} m: in the best one {distances.pairs[pair]} "
        f"{distance_in_words(distance)}; move the goal or the obstacle, reduce the margin, or give "
        "the goal a `guess` that is clear.",
        q[best],
    )


def _unreachable(robot: Robot, goal: FrameGoal, found: Branches) -> str:
    advice = hint_on_frame(robot, goal) or "move the goal closer or widen the limits"
    return (
        f"no configuration of robot {robot.name!r} within its limits was found that reaches the "
        f"goal: at the nearest, {goal.miss_in_words(robot, found.best)}; {advice}."
    )


def _count(name: str, value: Any) -> int:
    if not is_whole(value) or not 1 <= value <= MAX_COUNT:
        raise InputError(f"{name} must be a whole number from 1 to {MAX_COUNT:,}, got {value!r}.")
    return int(value)
