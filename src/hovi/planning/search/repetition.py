"""A cycle that is planned once and repeated: its problem, its motion and its solution, n times.

A cycle ends in the state in which it starts, so that the optimum of n repetitions, which are fixed
there, is that of one of them n times.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition
from hovi.conditions.places import AtTimes
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.instants import Instants
from hovi.discrete.joined_motion import SAME
from hovi.discrete.measures.motion_segments import SEGMENT_NAMES, motion_segments
from hovi.discrete.output.caution import CAUTIONS
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import SATISFIED, Via
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.goal_turns import says_turns
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.seams import Seam
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.solver import Solution
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import PointTerms
from hovi.scene.segmented_lagrangian import SegmentedLagrangian

Array = npt.NDArray[np.float64]
End = State | FrameGoal
_RATES = "v", "a", "jerk"
_IN_WORDS = (
    "the position of {!r} is {:.3g} rad or m",
    "the velocity of {!r} is {:.3g} rad/s or m/s",
    "the acceleration of {!r} is {:.3g} rad/s^2 or m/s^2",
    "the jerk of {!r} is {:.3g} rad/s^3 or m/s^3",
)
"""The name of a joint and its gap, of q and its derivatives."""


def goal_of_cycle(start: End, goal: End | None, robot: Robot) -> State:
    """The state in which a cycle ends: that in which it starts, by the turns that the goal adds.

    goal: its last one, which has to be the start, in [rad], [m], per [s], .... What it leaves free
    is as at the start. Raises InputError, with the gap, for another goal and a start that is no
    state.
    """
    if not isinstance(start, State) or start.free or start.free_velocity or start.free_acceleration:
        raise InputError(
            "a cycle that is repeated needs a start that is given wholly: give a configuration, "
            "such as the first of hovi.inverse_kinematics, and leave nothing of it free."
        )
    turns = goal.turns if isinstance(goal, State) else {}
    q, *rates = start.jet_on(robot, "start")
    if gap := _gap(start, goal, robot):
        raise InputError(
            f"a cycle that is repeated ends where it starts, but {gap}: make its last goal the "
            "start."
        )
    given: dict[str, Any] = {
        key: rate
        for key, rate in zip(_RATES, rates, strict=True)
        if getattr(start, key) is not None
    }
    return State(q, **given, turns=turns)


def _gap(start: State, goal: End | None, robot: Robot) -> str:
    """By how much a goal misses the start, a clause; "" if it does not."""
    q, *rates = start.jet_on(robot, "start")
    if goal is None:
        return "its last segment has no goal"
    if isinstance(goal, FrameGoal):
        missed = max(goal.miss(robot, q)) > SATISFIED
        return f"{goal.miss_in_words(robot, q)} at the start" if missed else ""
    if says_turns(goal, robot).any():
        return (
            "its goal is an angle beyond half a turn, which counts the turns from the first start"
        )
    end, *ends = goal.jet_on(robot, "goal")
    free = [goal.free_on(robot, "goal", order)[-1] for order in (1, 2, 3, 4)]
    gaps = [robot.difference(q, end), *(b - a for a, b in zip(rates, ends, strict=True))]
    for what, gap, left in zip(_IN_WORDS, gaps, free, strict=True):
        size = np.where(left, 0.0, np.abs(gap))
        i = int(np.argmax(size))
        if size[i] > SAME:
            name = robot.coordinate_names[i]
            return f"{what.format(name, size[i])} away from that of its start at its last goal"
    return ""


def require_alike(cycle: TrajectoryProblem) -> None:
    """Raise InputError, by name, for what makes the repetitions of a cycle differ."""
    timed = {f"the effect {key!r}": None for scene in cycle.scenes for key in scene.terms.timed}
    clearance = cycle.clearance
    moving = [each for each in clearance.obstacles if each.motion] if clearance else []
    timed |= {f"the obstacle {each.name!r}": None for each in moving}
    timed |= {f"condition {each.name!r}": None for each in cycle.conditions if each.timed}
    for name in timed:
        raise InputError(
            f"{name} changes with time, so that the repetitions of a cycle differ: leave it out, "
            "or write the cycles as segments, one after the other."
        )
    limits = cycle.limits
    if limits is not None and limits.excused:
        raise InputError(
            f"the start is outside its limits, {limits.excused[0]}, and every repetition would "
            "start there: start inside of them."
        )


def repeated(cycle: Solution, times: int) -> Solution:
    """The solution whose motion runs a cycle several times; itself for once, and without success.

    The cost, the effort and the action's index are those of all repetitions, the relative error is
    that of one, as they are alike.
    """
    if times == 1:
        return cycle
    known, length = cycle.problem, cycle.trajectory.duration
    if not cycle.success or known is None:
        message = f"{cycle.message} This is one cycle, which is not repeated."
        return dataclasses.replace(cycle, message=message)
    problem = _problem(known, cycle.trajectory.path, times)
    instants, forces = _instants(cycle, times), _forces(cycle, problem, times)
    message = (
        f"{cycle.message} This is the cycle of {length:.6g} s, which the motion repeats {times:,} "
        f"times, at {times:,} times its cost."
    )
    changes: dict[str, Any] = {
        "cost": times * cycle.cost,
        "n_neg": cycle.n_neg if cycle.n_neg < 0 else times * cycle.n_neg,
        "forces": forces,
        "instants": instants,
        "prices": None if cycle.prices is None else times * cycle.prices,
    }
    path = _path(cycle.trajectory.path, times)
    answer = Answer(problem, path, status=cycle.status, message=message, **changes)
    motion = answer.motion
    said = {key: value for key, value in motion.metadata.items() if key != CAUTIONS}
    metadata = {**cycle.trajectory.metadata, **said, **_named(cycle, times)}
    return dataclasses.replace(
        cycle,
        **changes,
        message=message,
        trajectory=dataclasses.replace(motion, metadata=metadata),
        minima=tuple(times * each for each in cycle.minima),
        problem=problem,
        central=None,
        model=None,
        solved_bounds=None,
        check=None,
    )


def _problem(cycle: TrajectoryProblem, path: DiscretePath, times: int) -> TrajectoryProblem:
    """The problem of all repetitions. path: of one."""
    of, N = cycle.ld.lagrangian, cycle.grid.intervals
    parts = of.lagrangians if isinstance(of, SegmentedLagrangian) else (of,)
    own = np.bincount(cycle.ld.segments) if cycle.ld.segments is not None else np.array([N])
    grid = Grid.joined([cycle.grid] * times)
    ends = tuple(grid.t[np.cumsum(np.tile(own, times))[:-1]].tolist())
    begins = grid.t[N * np.arange(times)].tolist()
    assert isinstance(cycle.goal, State)
    goal = State(cycle.goal.q, cycle.goal.v, turns=cycle.goal.turns)
    higher = np.stack([x[1] for x in cycle.ends[2:]]) if cycle.ends[2:] else None
    via = [_later(each, t, cycle, path) for t in begins for each in cycle.via]
    seams = [Seam(t, goal, higher=higher) for t in begins[1:]]
    limits, clearance = cycle.limits, cycle.clearance
    if limits is not None and limits.parts:
        limits = Limits.of_segments(limits.parts * times, ends)
    return dataclasses.replace(
        cycle,
        ld=DiscreteLagrangian(SegmentedLagrangian(parts * times, ends), grid),
        via=tuple(sorted((*via, *seams), key=lambda each: each.time)),
        limits=limits,
        clearance=None if clearance is None else _clearance(clearance, begins),
        conditions=tuple(x for each in cycle.conditions for x in _conditions(each, begins)),
    )


def _later(each: Via, begin: float, cycle: TrajectoryProblem, path: DiscretePath) -> Via:
    """A via point of a repetition, a goal of a frame with where the cycle reaches it as its guess.

    begin: of the repetition, in [s].
    """
    goal = each.goal
    if isinstance(goal, FrameGoal):
        goal = dataclasses.replace(goal, guess=path.q[cycle.grid.node_at(each.time)])
    return dataclasses.replace(each, time=each.time + begin, goal=goal)


def _clearance(of: Clearance, begins: Sequence[float]) -> Clearance:
    """The clearance of all repetitions: what is carried through their ends is carried on."""
    parts = sorted((name, a + t, b + t) for t in begins for name, a, b in of.during)
    joined = list[tuple[str, float, float]]()
    for name, begin, end in parts:
        if joined and joined[-1][0] == name and begin - joined[-1][2] <= SAME:
            begin = joined.pop()[1]
        joined.append((name, begin, end))
    return dataclasses.replace(of, during=joined) if joined else of


def _conditions(
    each: Condition[Any, Any], begins: Sequence[float]
) -> tuple[Condition[Any, Any], ...]:
    """A condition in all repetitions: once if it holds all along."""
    if isinstance(each.where, AtTimes):
        times = np.add.outer(begins, np.asarray(each.where.times, float)).ravel()
        return (dataclasses.replace(each, where=AtTimes(times)),)
    if each.during is None:
        return (each,)
    shifted = (each.from_time(-begin) for begin in begins)
    return tuple(
        dataclasses.replace(x, name=_title(each.name, k)) for k, x in enumerate(shifted, start=1)
    )


def _title(name: str, number: int) -> str:
    """What belongs to a repetition is called. number: of the repetition, from 1."""
    return f"{name} ({number})"


def _path(cycle: DiscretePath, times: int) -> DiscretePath:
    """The path of all repetitions, which share the nodes between them."""

    def nodes(x: Array) -> Array:
        return np.concatenate([*[x[:-1]] * times, x[-1:]]) if len(x) else x

    z, inner = (np.concatenate([x] * times) for x in (cycle.z, cycle.inner))
    return DiscretePath(nodes(cycle.q), nodes(cycle.v), z, inner, nodes(cycle.higher))


def _instants(cycle: Solution, times: int) -> Instants | None:
    """The instants of all repetitions."""
    known = cycle.instants
    if known is None:
        return None
    N = cycle.trajectory.grid.intervals
    intervals = np.concatenate([known.intervals + k * N for k in range(times)])
    return Instants(intervals, np.tile(known.positions, times), np.tile(known.weights, times))


def _forces(cycle: Solution, problem: TrajectoryProblem, times: int) -> list[PointTerms] | None:
    """The multipliers of all repetitions. problem: theirs."""
    known, of = cycle.forces, cycle.problem
    if known is None or of is None:
        return None
    N = of.grid.intervals
    batches = of.ld.interval_batches
    places = {int(batch.numbers[0]): i for i, batch in enumerate(batches)}
    at_points = [known[places[int(x.numbers[0]) % N]] for x in problem.ld.interval_batches]
    return at_points + known[len(batches) :] * times


def _named(cycle: Solution, times: int) -> Mapping[str, Any]:
    """The names of the segments, and what is kept in parts, of all repetitions, as metadata."""
    motion, numbers = cycle.trajectory, range(1, times + 1)
    names = [each.name for each in motion_segments(motion)] or ["cycle"]
    said: dict[str, Any] = {SEGMENT_NAMES: [_title(name, k) for k in numbers for name in names]}
    if "keep" in motion.metadata:
        tables = motion.metadata["keep"]
        T = motion.duration
        said["keep"] = [x for each in tables for x in _tables(each, T, times)]
    return said


def _tables(table: Mapping[str, Any], length: float, times: int) -> list[Mapping[str, Any]]:
    """What is kept in all repetitions, as its table says. length: of one, in [s]."""
    if not table.get("during"):
        return [table]
    begin, end = table["during"]
    return [
        {
            **table,
            "name": _title(table.get("name", table["kind"]), k + 1),
            "during": [begin + k * length, end + k * length],
        }
        for k in range(times)
    ]
