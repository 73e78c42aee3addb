"""Durations that are too short: lower bounds of the time between waypoints.

Between two states the bound is that of the slowest joint. From a state to a frame at its goal the
joints have to be within what they travel in the time: if inverse kinematics finds no configuration
there, a proof is tried, and what is not proven is a warning.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import State
from hovi.dynamics.kinematic_chain import read_kinematic_chain
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kinematics.branches import find_branches
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.goal_turns import turns_after
from hovi.planning.problem.presolve.least_time import Pace, Rests
from hovi.planning.problem.presolve.reach_in_boxes import proven_out_of_reach
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SEEDS = 1000
"""Number of seeds of inverse kinematics within what the joints travel."""
BRANCHES = 16
"""Number of configurations whose times are compared."""
BISECTIONS = 6
"""Halvings of the least time at which inverse kinematics finds a configuration."""


@dataclass(frozen=True, eq=False)
class Waypoint:
    """A start, goal or via point at a time, in [s]. name: in messages, such as "goal"."""

    name: str
    time: float
    goal: State | FrameGoal

    def position(self, on: Coordinates) -> tuple[Array, Mask]:
        """The configuration (nq,), and which of its entries are prescribed, (nv,)."""
        assert isinstance(self.goal, State)
        q, _ = self.goal.on(on, self.name)
        return q, ~self.goal.free_on(on, self.name)[0]

    def at_rest(self, on: Coordinates) -> Mask:
        """At which joints the velocity is prescribed to be zero, (nv,)."""
        inner = self.name not in ("start", "goal")
        goal = self.goal
        if inner and (isinstance(goal, FrameGoal) or goal.v is None):
            return np.zeros(on.nv, dtype=bool)
        if isinstance(goal, FrameGoal):
            assert isinstance(on, Robot)
            free = State(np.zeros(0), free_velocity=goal.free_velocities(on))
            return np.asarray(~free.free_on(on, self.name)[1])
        return np.asarray((goal.on(on, self.name)[1] == 0.0) & ~goal.free_on(on, self.name)[1])


@dataclass(frozen=True)
class Finding:
    """A clause about a motion. certain: whether no motion exists."""

    clause: str
    certain: bool


def states_too_far_apart(
    coordinates: Coordinates, waypoints: Sequence[Waypoint], limits: Limits
) -> str:
    """Which joint cannot travel between two of the states in time, as a clause; "" if all can.

    waypoints: by ascending time; those at frames are left out.
    """
    if limits.parts or not limits.bounded[1:3].any():
        return ""
    pace = Pace.of(limits)
    states = [waypoint for waypoint in waypoints if isinstance(waypoint.goal, State)]
    for first, last in combinations(states, 2):
        clause = _between_states(Move(first, last, coordinates, pace, limits))
        if clause:
            return clause
    return ""


def frame_too_far(robot: Robot, waypoints: Sequence[Waypoint], limits: Limits) -> Finding | None:
    """The frame that is too far from one of the states, a certain finding if there is one.

    waypoints: by ascending time. Moves between two frames are not looked at.
    """
    if limits.parts or not limits.bounded[1:3].any():
        return None
    pace, unsure = Pace.of(limits), None
    for first, last in combinations(waypoints, 2):
        if isinstance(first.goal, State) != isinstance(last.goal, State):
            found = _FrameMove(first, last, robot, pace, limits).finding()
            if found is not None and found.certain:
                return found
            unsure = unsure or found
    return unsure


@dataclass(frozen=True, eq=False)
class Move:
    """The motion from one waypoint to a later one, whatever is between them."""

    first: Waypoint
    last: Waypoint
    coordinates: Coordinates
    pace: Pace
    limits: Limits

    @property
    def time(self) -> float:
        """The time between the waypoints, in [s]."""
        return self.last.time - self.first.time

    @property
    def rests(self) -> Rests:
        """Number of waypoints at which each joint rests, (nv,)."""
        first, last = (waypoint.at_rest(self.coordinates) for waypoint in (self.first, self.last))
        return first.astype(np.intp) + last

    @property
    def distance(self) -> Array:
        """How far each joint has to move between two states, (nv,); 0 where an end is free.

        The shortest way, but to an angle of the goal that says its full turns.
        """
        on = self.coordinates
        (q0, held), (q1, also) = self.first.position(on), self.last.position(on)
        way = on.difference(q0, q1)
        if self.whole and isinstance(self.first.goal, State) and isinstance(self.last.goal, State):
            way = way + 2 * np.pi * turns_after(self.last.goal, self.first.goal, on, q0, way)
        return np.where(held & also, way, 0.0)

    @property
    def needed(self) -> Array:
        """The least time of each joint between two states, (nv,), in [s]."""
        return self.pace.least_time(self.distance, self.rests)

    @property
    def whole(self) -> bool:
        """Whether it is the whole motion."""
        return (self.first.name, self.last.name) == ("start", "goal")


def _between_states(move: Move) -> str:
    """The joint that cannot travel its distance in time."""
    on, distance, needed = move.coordinates, move.distance, move.needed
    i = int(np.argmax(needed))
    if needed[i] <= move.time:
        return ""
    units, kinds = on.coordinate_units[i], []
    for row, kind in ((1, "velocity"), (2, "acceleration")):
        if move.limits.bounded[row, i] and (row == 1 or move.rests[i]):
            most = move.limits.upper[row, i] if distance[i] >= 0 else -move.limits.lower[row, i]
            kinds.append((kind, f"{kind} limit of {most:.4g} {units[row]}"))
    what = "duration" if move.whole else "time"
    between = "" if move.whole else f" from the {move.first.name} to the {move.last.name}"
    return (
        f"joint {on.coordinate_names[i]!r} has to move by {abs(distance[i]):.4g} {units.q}"
        f"{between}, which takes {needed[i]:.4g} s at its "
        f"{' and '.join(text for _, text in kinds)}, longer than the {what} of {move.time:.4g} s; "
        f"increase the {what} or the {' or '.join(kind for kind, _ in kinds)} limit"
    )


@dataclass(frozen=True, eq=False)
class _FrameMove(Move):
    """A part of a motion between a state and a frame at its goal."""

    coordinates: Robot

    @property
    def known(self) -> Waypoint:
        """The waypoint that is a state."""
        return self.first if isinstance(self.first.goal, State) else self.last

    @property
    def _other(self) -> Waypoint:
        return self.last if self.known is self.first else self.first

    def finding(self) -> Finding | None:
        """The frame that cannot move to its goal, or from it, in time."""
        robot = self.coordinates
        goal = self._other.goal
        assert isinstance(goal, FrameGoal)
        q, held = self.known.position(robot)
        if goal.regional or not held[goal.moves(robot)].all():
            return None
        bounds = self.limits.lower[0], self.limits.upper[0]
        found = find_branches(robot, goal, q, bounds, BRANCHES, SEEDS).q
        if len(found) == 0:
            return None  # out of reach, whatever the time
        away = robot.difference(q, found) * (1 if self.known is self.first else -1)
        longest = float(self.pace.least_time(away, self.rests).max(axis=1).min())
        if longest <= self.time or self._reaches(goal, q, self.time):
            return None
        needed = self._least_found(goal, q, longest)
        limits = "velocity and acceleration limits" if self._accelerated else "velocity limits"
        nearest = f"at the {limits} the nearest configuration found takes {needed:.3g} s"
        advice = f"increase the {'duration' if self.whole else 'time'} or the limits"
        move = f"move from the {self.first.name} to the {self.last.name} within {self.time:.4g} s"
        if self._proven(goal, q):
            return Finding(f"{goal.frames} cannot {move}: {nearest}; {advice}", True)
        has = "have" if goal.also else "has"
        what = f"{goal.frames} {has} to {move}, but {nearest}: probably no motion exists"
        return Finding(f"{what}; {advice}", False)

    @property
    def _accelerated(self) -> bool:
        """Whether limits on the acceleration count."""
        return bool((self.limits.bounded[2] & (self.rests > 0)).any())

    def _reaches(self, goal: FrameGoal, q: Array, time: float) -> bool:
        """Whether a configuration at the goal is found that the joints reach in a time."""
        bounds = self._box(q, time)
        return len(find_branches(self.coordinates, goal, q, bounds, 1, SEEDS).q) > 0

    def _least_found(self, goal: FrameGoal, q: Array, longest: float) -> float:
        """The least time, from above, in which a configuration is found to be reached, in [s]."""
        least = self.time
        for _ in range(BISECTIONS):
            middle = (least + longest) / 2
            reaches = self._reaches(goal, q, middle)
            least, longest = (least, middle) if reaches else (middle, longest)
        return longest

    def _proven(self, goal: FrameGoal, q: Array) -> bool:
        """Whether one of the frames cannot reach its goal in time."""
        return any(self._proven_of(each, q) for each in goal.parts)

    def _proven_of(self, goal: FrameGoal, q: Array) -> bool:
        chain = read_kinematic_chain(self.coordinates.model, goal.frame)
        if chain is None:
            return False
        at = chain.angles(q)
        down, up = self._travel(self.time)
        lower, upper = at - down[chain.velocities], at + up[chain.velocities]
        bounded = ~chain.continuous  # an angle and its full turns are one position
        slack = self.limits.tolerance * self.limits.ranges[0][chain.velocities]
        low, high = (x[0][chain.velocities] for x in (self.limits.lower, self.limits.upper))
        lower = np.where(bounded, np.maximum(lower, low - slack), lower)
        upper = np.where(bounded, np.minimum(upper, high + slack), upper)
        return proven_out_of_reach(chain, goal, lower, np.maximum(lower, upper))

    def _box(self, q: Array, time: float) -> tuple[Array, Array]:
        """Bounds of the joints around a configuration, shape (nv,), for inverse kinematics."""
        down, up = self._travel(time)
        near = self.coordinates.difference(self.coordinates.neutral(), q)
        lower, upper = self.limits.lower[0], self.limits.upper[0]
        return np.maximum(lower, near - down), np.minimum(upper, near + up)

    def _travel(self, time: float) -> tuple[Array, Array]:
        """How far below and above the known waypoint the joints may be at the other one, (nv,)."""
        down, up = self.pace.travel(time, self.rests)
        return (down, up) if self.known is self.first else (up, down)
