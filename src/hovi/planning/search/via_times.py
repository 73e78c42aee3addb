"""Via points without times: they are passed when that costs least.

The lengths of time between the start, the via points and the goal are L_i = exp(y_i), so that they
are positive. With g_i = dJ/dL_i + w of a minimum for given times, which its momenta and multipliers
give exactly, and the price w of time,

    d(J + w T)/dy_k = L_k (g_k - sum_i p_i g_i), p = L / T,

where T is given, or at the bound of a free duration beyond which J + w T decreases, and L_k g_k
elsewhere: there L is scaled to T. By this slope a quasi-Newton method finds the y of least cost:
each step is a solve on the same grid, stretched, from the motion before.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.start import Start
from hovi.planning.problem.clock import SAME_LENGTH, Clock
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.inverse_kinematics import (
    first_configuration,
    nearest_configuration,
    position_bounds,
)
from hovi.planning.refinement.error_estimate import with_metadata
from hovi.planning.search.free_duration import cost_in_parts
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.free_duration.timed_path import stretched_path
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import STOPPED
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]
End = State | FrameGoal

SETTLED = 1e-6
"""Decrease of the cost by other times that counts as none, relative to the cost."""
MOST_STEPS, MOST_HALVINGS = 30, 6
"""Largest number of quasi-Newton steps, and of halvings of one of them."""
LARGEST_STEP, FIRST_STEP = 0.5, 0.1
"""Largest change of a parameter in a step, and in the first one: lengths change by as much."""
ROUNDS = 3
"""Largest number of plans with times that were found on the grid of the last one."""
LEAST_FRACTION = 0.05
"""Least first length of time, relative to the mean one."""
Planned = Callable[[PlanOptions, float, Trajectory | None, End | None], Solution]
"""A plan with options in a duration, in [s], from a motion if there is one, to a goal that an
earlier plan settled."""


def with_best_times(
    planned: Planned,
    options: PlanOptions,
    robot: Robot,
    ends: tuple[End, End],
    duration: float | tuple[float, float],
    deadline: Deadline,
) -> Solution:
    """The motion that passes via points without times when that costs least.

    ends: the start and the goal. duration: in [s], or the bounds of a free one, which is found with
        the times. deadline: of all plans.
    Raises InputError where only some of the via points have times, and for a price of a given time.
    """
    via, free = options.via, isinstance(duration, tuple)
    if any(each.timed for each in via):
        raise InputError('give all via points times, or all of them time = "free".')
    if options.time_weight != 0 and not free:
        raise InputError("time_weight needs a free duration: give a pair (lower, upper).")
    bounds = duration if isinstance(duration, tuple) else (duration, duration)
    price = _Price(options.time_weight, *bounds)
    options = options.with_changes(time_weight=0.0)  # each plan is one in a given duration
    fractions = _first_fractions(robot, ends, via, options)
    for T in dict.fromkeys((price.first, price.upper)):  # limits bind at short durations
        lengths = T * fractions
        found = planned(_at(options, lengths), T, None, None)
        if found.success or found.status in STOPPED:
            break
    steps = found.nit
    for _ in range(ROUNDS):
        if not found.success:
            return found
        times = _Times.of(found, lengths, price)
        with deadline.in_force():
            best = times.settled(deadline)
        steps += best.steps
        if best.same_as(times) or deadline.passed:
            break
        goal = None if found.problem is None else found.problem.goal
        settled = goal if isinstance(goal, FrameGoal) else None
        timed, T = _at(options, best.lengths), float(best.lengths.sum())
        again = planned(timed, T, best.found.trajectory, settled)
        steps += again.nit
        if not again.success or price.total(again) >= price.total(found):
            break
        found, lengths = again, best.lengths
    found = price.added_to(dataclasses.replace(found, nit=steps)) if free else found
    said = " and ".join(f"{t:.4g} s" for t in np.cumsum(lengths)[:-1])
    message = f"{found.message} It passes its via points at {said}, when that costs least."
    return dataclasses.replace(found, nit=steps, message=message)


@dataclass(frozen=True, eq=False)
class _Price:
    """w of J + w T, and the bounds of T in [s], which are equal for a given duration."""

    weight: float
    lower: float
    upper: float

    @property
    def first(self) -> float:
        """The first duration, in [s]."""
        return float(np.sqrt(self.lower * self.upper))

    def total(self, found: Solution) -> float:
        """J + w T of a motion planned in a given duration."""
        return found.cost + self.weight * found.trajectory.duration

    def slope(self, g: Array, lengths: Array) -> Array:
        """The slope of J + w T in y, (n + 1,). g: dJ/dL + w."""
        T, mean = lengths.sum(), (lengths @ g) / lengths.sum()
        shrinks = mean >= 0 and T / self.lower <= 1.0 + SAME_LENGTH
        grows = mean <= 0 and T / self.upper >= 1.0 - SAME_LENGTH
        return np.asarray(lengths * (g - mean if shrinks or grows else g))

    def after(self, lengths: Array, step: Array) -> Array:
        """Lengths after a step of y, with T between its bounds."""
        moved = lengths * np.exp(step)
        return np.asarray(moved * (np.clip(moved.sum(), self.lower, self.upper) / moved.sum()))

    def added_to(self, found: Solution) -> Solution:
        """A motion with the price of its time in its cost, its problem and its message."""
        cost, T = self.total(found), found.trajectory.duration
        changes: dict[str, Any] = {"cost": cost, "minima": (cost,) if found.success else ()}
        if found.problem is not None:
            changes["problem"] = dataclasses.replace(found.problem, time_weight=self.weight)
        parts = cost_in_parts(cost, self.weight * T, found.nit)
        accuracy = "." if found.accuracy is None else f"; {found.accuracy}"
        message = f"a minimum of cost {parts}{accuracy} The best duration is {T:.6g} s."
        motion = with_metadata(found.trajectory, cost=cost)
        return dataclasses.replace(found, message=message, trajectory=motion, **changes)


def _at(options: PlanOptions, lengths: Array) -> PlanOptions:
    """The options with times of the via points."""
    times = np.cumsum(lengths)[:-1].tolist()
    pairs = zip(options.via, times, strict=True)
    return options.with_changes(via=[dataclasses.replace(each, time=t) for each, t in pairs])


def _first_fractions(
    robot: Robot, ends: tuple[End, End], via: Sequence[Via], options: PlanOptions
) -> Array:
    """Fractions of time in proportion to the largest change of a joint, (n + 1,)."""
    start, goal = ends
    bounds = position_bounds(robot, options.limits)
    near = None if isinstance(start, State) else first_configuration(robot, start, None, bounds)
    q = start.on(robot, "start")[0] if isinstance(start, State) else near
    assert q is not None
    ways = list[float]()
    for each in (*(x.goal for x in via), goal):
        if isinstance(each, State):
            there = each.on(robot, "goal")[0]
        else:
            there = nearest_configuration(robot, each, q, bounds).q
        ways.append(float(np.abs(robot.difference(q, there)).max()))
        q = there
    fractions = np.maximum(ways, LEAST_FRACTION * max(np.mean(ways), np.finfo(float).tiny))
    return np.asarray(fractions / fractions.sum())


@dataclass(frozen=True, eq=False)
class _Times:
    """A minimum for lengths of time between its via points, with the slopes in their parameters.

    slope: of J + w T in y, (n + 1,). inverse: an estimate of that of its Hessian. steps: so far.
    """

    found: Solution
    lengths: Array
    price: _Price
    slope: Array
    inverse: Array
    steps: int = 0

    @classmethod
    def of(cls, found: Solution, lengths: Array, price: _Price) -> Self:
        """From a minimum alone."""
        slope = _slope(found, lengths, price)
        inverse = np.eye(len(slope)) * FIRST_STEP / max(float(np.abs(slope).max()), 1e-300)
        return cls(found, lengths, price, slope, inverse)

    def same_as(self, other: _Times) -> bool:
        """Whether its times are those of another."""
        return self.found is other.found

    def settled(self, deadline: Deadline) -> _Times:
        """Those from which no step decreases the cost, or the best ones at the deadline."""
        now = self
        for _ in range(MOST_STEPS):
            if deadline.passed:
                break
            step = -now.inverse @ now.slope
            if -0.5 * float(step @ now.slope) <= SETTLED * abs(now.price.total(now.found)):
                return now
            step *= min(1.0, LARGEST_STEP / float(np.abs(step).max()))
            after = next(
                filter(None, (now._after(step / 2**i) for i in range(MOST_HALVINGS))), None
            )
            if after is None:
                return now
            now = after
        return now

    def _after(self, step: Array) -> _Times | None:
        """After a change of the parameters; None where the cost does not fall."""
        lengths = self.price.after(self.lengths, step)
        try:
            found = _solved(self.found, self.lengths, lengths)
        except OutOfTimeError:
            return None
        lower = self.price.total(found) < self.price.total(self.found)
        if not (found.success and lower):
            return None
        slope = _slope(found, lengths, self.price)
        made = np.log(lengths / self.lengths)
        inverse = _updated(self.inverse, made, slope - self.slope)
        return _Times(found, lengths, self.price, slope, inverse, self.steps + found.nit)


def _solved(found: Solution, now: Array, lengths: Array) -> Solution:
    """The minimum for other lengths, from the motion for these, on its grid."""
    problem, clock = found.problem, Clock.of_parts(len(now))
    assert problem is not None
    path = stretched_path(found.trajectory.path, problem.grid, clock, now, lengths)
    other = problem.lasting(clock, now, lengths)
    return solved_on_grid(other, Start(path, near=True))


def _slope(found: Solution, lengths: Array, price: _Price) -> Array:
    """That of J + w T in y: see the module."""
    ends = np.cumsum([0.0, *lengths])

    def rates(i: int) -> Callable[[Grid], Array]:
        return lambda grid: np.asarray(np.clip((grid.t - ends[i]) / lengths[i], 0.0, 1.0))

    g = np.array([found.derivative_in_time(rates(i)) for i in range(len(lengths))])
    return price.slope(g + price.weight, lengths)


def _updated(inverse: Array, step: Array, change: Array) -> Array:
    """The inverse after a step, by Broyden, Fletcher, Goldfarb and Shanno's formula."""
    curvature = float(step @ change)
    if curvature <= 0.0:
        return inverse
    left = np.eye(len(step)) - np.outer(step, change) / curvature
    return np.asarray(left @ inverse @ left.T + np.outer(step, step) / curvature)
