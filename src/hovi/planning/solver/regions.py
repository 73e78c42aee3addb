"""Where bounds of regions are held: an active set of what motions end at.

A motion ends in the region of a frame's goal where it costs least. Which of its bounds are held is
found by a few solves, in each of which the held ones are equations. With the multiplier m of one,
for the Lagrangian S + m c, a larger room d changes the cost by dS/dd = -m: at the middle the motion
moves along m; at an upper edge m may not be negative, nor positive at a lower one; and a bound that
is not held may not be exceeded.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from hovi.conditions.function import linear
from hovi.discrete.instants import Instants
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.frame_goal import FrameGoal, PoseDifference
from hovi.planning.problem.goal_region import Bound, Side
from hovi.planning.problem.goals import SATISFIED
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.seams import Seam
from hovi.planning.solver.limits.row_forces import at_instants
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import PointTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NEGLIGIBLE = 1e-6
"""Multiplier times the room of a bound that counts as none, relative to the cost."""
EXCEEDED = 1e-7
"""By how much a bound that is not held may be exceeded, in [m] or [rad]."""
LARGEST_SINE = 0.9
"""Largest sine of an angle to which a frame is turned at once."""
RANK = 1e-6
"""Singular values that count as zero there, relative to the largest."""
REACHED = 1e-6
"""Residual up to which a configuration is at the edge, in [m] or [rad]."""
STEPS = 8
"""Number of Newton steps to a configuration at the edge of a region."""


class Solved(Protocol):
    """A solution of a problem: see Solution."""

    @property
    def problem(self) -> TrajectoryProblem | None: ...  # noqa: D102
    @property
    def trajectory(self) -> Trajectory: ...  # noqa: D102
    @property
    def cost(self) -> float: ...  # noqa: D102
    @property
    def forces(self) -> list[PointTerms] | None: ...  # noqa: D102
    @property
    def instants(self) -> Instants | None: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class _End:
    """A goal with a region in a motion. node: of the grid. free: which of q and v are, (2, nv)."""

    goal: FrameGoal
    node: int
    free: Mask


def region_goals(problem: TrajectoryProblem) -> tuple[FrameGoal, ...]:
    """The goals of a problem that have regions, in order of time."""
    return tuple(each.goal for each in _ends(problem))


def _ends(problem: TrajectoryProblem) -> Iterator[_End]:
    seams = sorted((x for x in problem.via if isinstance(x, Seam)), key=lambda each: each.time)
    for seam, hold in zip(seams, problem.holds, strict=True):
        if isinstance(seam.goal, FrameGoal) and seam.goal.regional:
            yield _End(seam.goal, hold.node, ~hold.fixed)
    if isinstance(problem.goal, FrameGoal) and problem.goal.regional:
        yield _End(problem.goal, problem.grid.intervals, problem.free_ends[1, :2])


def with_next_sides(solution: Solved) -> tuple[FrameGoal, ...]:
    """The goals with regions, with their bounds held where the motion costs less.

    The guesses are configurations there. The same goals where all bounds are held as they are.
    """
    problem = solution.problem
    assert problem is not None
    return tuple(_next(solution, each) for each in _ends(problem))


def inside(solution: Solved, wanted: Sequence[FrameGoal] | None = None) -> tuple[FrameGoal, ...]:
    """The goals with regions, with bounds let go that are held elsewhere in the wanted ones.

    wanted: goals to which no motion was found; None to let go of all. The guesses are those of the
    solution's problem where it has no motion, and where its motion ends else.
    """
    problem, q = solution.problem, solution.trajectory.path.q
    assert problem is not None
    ends = list(_ends(problem))
    if wanted is not None:
        pairs = zip(ends, wanted, strict=True)
        return tuple(_let_go(each.goal, other.parts, q[each.node]) for each, other in pairs)
    guesses = {hold.node: hold.q for hold in problem.holds}
    guesses[problem.grid.intervals] = problem.ends[0][1]
    return tuple(freed(each.goal, guesses[each.node]) for each in ends)


def freed(goal: FrameGoal, q: Array) -> FrameGoal:
    """A goal with none of its bounds held. q: its guess, (nq,)."""
    parts = [_held(x, [Side.INSIDE] * len(x.bounds)) for x in goal.parts]
    return dataclasses.replace(parts[0], also=parts[1:], guess=q)


def ends_inside(solution: Solved) -> bool:
    """Whether all frames with regions end in them."""
    problem, q = solution.problem, solution.trajectory.path.q
    assert problem is not None
    missed = (max(x.goal.miss(problem.robot, q[x.node])) for x in _ends(problem))
    return max(missed, default=0.0) <= SATISFIED


def region_prices(solution: Solved) -> dict[str, float]:
    """By how much the cost changes with the room of each bound, dJ/dd, by its name: 0 inside."""
    problem, found = solution.problem, dict[str, float]()
    for end in () if problem is None else _ends(problem):
        multipliers = _multipliers(solution, end)
        for part in end.goal.parts:
            for bound, side in zip(part.bounds, _sides(part), strict=True):
                m = multipliers[id(part)][bound.first]
                size = float(np.linalg.norm(m)) if side is Side.MIDDLE else abs(float(m.sum()))
                time = solution.trajectory.t[end.node]
                name = _name(found, part, bound, time)
                found[name] = 0.0 if side is Side.INSIDE else -size
    return found


def room_in_regions(problem: TrajectoryProblem, motion: Trajectory) -> dict[str, float]:
    """What is left of the room of each bound where the frame ends, in [m] or [rad], by its name.

    Negative outside.
    """
    found = dict[str, float]()
    for end in _ends(problem):
        q = motion.path.q[end.node]
        for part in end.goal.parts:
            for bound in part.bounds:
                left = bound.room - abs(_value(part, bound, problem.robot, q))
                found[_name(found, part, bound, motion.t[end.node])] = left
    return found


def _name(known: Mapping[str, float], goal: FrameGoal, bound: Bound, time: float) -> str:
    """What a bound is called, with its time in [s] where another one is called so, too."""
    name = f"{goal.frame} {bound.name}"
    return name if name not in known else f"{name} at {time:.4g} s"


def _sides(goal: FrameGoal) -> list[Side]:
    return list(goal.sides) or [Side.MIDDLE] * len(goal.bounds)


def _held(goal: FrameGoal, sides: list[Side]) -> FrameGoal:
    return dataclasses.replace(goal, sides=tuple(sides), also=())


def _multipliers(solution: Solved, end: _End) -> dict[int, dict[int, Array]]:
    """Those of each bound, by its goal and its first equation.

    dS/d(q, v) + J^T m = 0 in what is free of q and v, with the other equations at the node.
    """
    problem, path = solution.problem, solution.trajectory.path
    assert problem is not None
    robot, node, (q, v) = problem.robot, end.node, (path.q[end.node], path.v[end.node])
    ld = at_instants(problem, solution.instants).ld
    slopes = ld.derivatives(path, solution.forces)
    slope = slopes[node - 1, ld.k : ld.k + 2].copy()
    if node < problem.grid.intervals:
        slope += slopes[node, :2]
    rows = [linear(end.goal.difference(robot), q, v)[1]]
    for each in problem.equations:
        own_rows = isinstance(each.y, PoseDifference) and each.y.goal is end.goal
        if each.where.node == node and not own_rows:
            rows.append(linear(each.y, q, v, each.where.time)[1])
    J = np.concatenate(rows)[:, end.free]
    m = np.asarray(np.linalg.lstsq(J.T, -slope[end.free], rcond=None)[0], dtype=float)
    found, first = dict[int, dict[int, Array]](), 0
    for part in end.goal.parts:
        own, of = dict[int, Array](), {x.first: x for x in part.bounds}
        sides, entry = dict(zip(of, _sides(part), strict=True)), 0
        while entry < part.alone.equations:
            bound = of.get(entry)
            side = Side.MIDDLE if bound is None else sides[entry]
            size = 1 if bound is None else bound.size
            count = {Side.MIDDLE: size, Side.INSIDE: 0}.get(side, 1)
            own[entry] = m[first : first + count]
            first, entry = first + count, entry + size
        found[id(part)] = own
    return found


def _next(solution: Solved, end: _End) -> FrameGoal:
    problem = solution.problem
    assert problem is not None
    robot, q = problem.robot, solution.trajectory.path.q[end.node]
    multipliers, worth = _multipliers(solution, end), NEGLIGIBLE * abs(solution.cost)
    parts, targets = list[FrameGoal](), list[Array]()
    for part in end.goal.parts:
        middle = dataclasses.replace(part, sides=(), also=())
        y = linear(middle.difference(robot), q, np.zeros(robot.nv))[0]
        sides = list[Side]()
        for bound, side in zip(part.bounds, _sides(part), strict=True):
            m, here = multipliers[id(part)][bound.first], y[bound.entries]
            at = _settled(bound, side, m, _value(part, bound, robot, q), worth)
            if at is not side and at in (Side.LOW, Side.HIGH):
                y[bound.entries] = _at_edge(bound, at, m if side is Side.MIDDLE else here)
            sides.append(at)
        parts.append(_held(part, sides) if sides else middle)
        targets.append(y)
    if all(list(x.sides) == _sides(part) for x, part in zip(parts, end.goal.parts, strict=True)):
        return end.goal
    there = _reaching(problem, end, q, np.concatenate(targets))
    if there is None:  # the edge is out of reach
        return _let_go(end.goal, parts, q)
    return dataclasses.replace(parts[0], also=parts[1:], guess=there)


def _reaching(problem: TrajectoryProblem, end: _End, q: Array, y: Array) -> Array | None:
    """The configuration (nq,) near q at which the equations at the middle have values y.

    None where Newton's method finds none within the limits.
    """
    robot = problem.robot
    exact = end.goal.middle.difference(robot)
    for _ in range(STEPS):
        here, J = linear(exact, q, np.zeros(robot.nv))
        step = np.linalg.lstsq(J[:, 0], y - here, rcond=RANK)[0]
        q = robot.integrate(q, np.asarray(step, dtype=float))
    if not np.abs(linear(exact, q, np.zeros(robot.nv))[0] - y).max() <= REACHED:
        return None
    limits, at = problem.limits, robot.space.coordinates(q)
    outside = limits is not None and ((at < limits.lower[0]) | (at > limits.upper[0])).any()
    return None if outside else q


def _let_go(goal: FrameGoal, wanted: Sequence[FrameGoal], q: Array) -> FrameGoal:
    """A goal with bounds let go that are held elsewhere in the wanted parts. q: its guess."""
    parts = list[FrameGoal]()
    for part, other in zip(goal.parts, wanted, strict=True):
        pairs = zip(_sides(part), _sides(other), strict=True)
        parts.append(_held(part, [x if x is y else Side.INSIDE for x, y in pairs]))
    return dataclasses.replace(parts[0], also=parts[1:], guess=q)


def _value(goal: FrameGoal, bound: Bound, robot: Robot, q: Array) -> float:
    """What a bound bounds, at a configuration."""
    offset, angle = goal.off(robot, q)
    if bound.of_angle:
        return angle
    return float(offset[bound.first]) if bound.size == 1 else float(np.linalg.norm(offset))


def _settled(bound: Bound, side: Side, m: Array, value: float, worth: float) -> Side:
    """Where a bound is held next. m: its multipliers. worth: of the cost that counts as none."""
    if side is Side.INSIDE:
        if value > bound.room + EXCEEDED:
            return Side.HIGH
        return Side.LOW if value < -bound.room - EXCEEDED else side
    if bound.room * float(np.linalg.norm(m)) <= worth:
        return side
    if side is Side.MIDDLE:
        return Side.LOW if bound.size == 1 and m[0] < 0.0 else Side.HIGH
    return side if (m[0] > 0.0) == (side is Side.HIGH) else Side.INSIDE


def _at_edge(bound: Bound, side: Side, along: Array) -> Array:
    """The equations at the middle of a bound where it is at an edge. along: the way there."""
    room = min(np.sin(min(bound.room, np.pi / 2)), LARGEST_SINE) if bound.of_angle else bound.room
    if bound.size == 1:
        return np.array([room if side is Side.HIGH else -room])
    return np.asarray(room * along / np.linalg.norm(along))
