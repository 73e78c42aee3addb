"""Via points without times: they are passed when that costs least.

The lengths of time between the start, the via points and the goal are L_i = T p_i, with the
softmax p of parameters y, so that they are positive and T is kept. With g_i = dJ/dL_i of a minimum
for given times, which its momenta and multipliers give exactly,

    dJ/dy_k = T p_k (g_k - sum_i p_i g_i),

by which a quasi-Newton method finds the y of least cost: each step is a solve on the same grid,
stretched, from the motion before.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.start import Start
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.inverse_kinematics import (
    first_configuration,
    nearest_configuration,
    position_bounds,
)
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.free_duration.timed_path import stretched_path
from hovi.planning.solver.solver import Solution, solved_on_grid
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
Planned = Callable[[PlanOptions, Trajectory | None, End | None], Solution]
"""A plan with options, from a motion if there is one, to a goal that an earlier plan settled."""


def with_best_times(
    planned: Planned,
    options: PlanOptions,
    robot: Robot,
    ends: tuple[End, End],
    duration: object,
    deadline: Deadline,
) -> Solution:
    """The motion that passes via points without times when that costs least.

    ends: the start and the goal. deadline: of all plans. Raises InputError for a free duration, and
        where only some of the via points have times.
    """
    via = options.via
    if any(each.timed for each in via):
        raise InputError('give all via points times, or all of them time = "free".')
    if not isinstance(duration, float | int):
        raise InputError(
            "via points without times need a given duration: give it as one number, or make them "
            "goals of segments with free durations, and velocities that are free."
        )
    lengths = _first_lengths(robot, ends, via, float(duration), options)
    found = planned(_at(options, lengths), None, None)
    steps = found.nit
    for _ in range(ROUNDS):
        if not found.success:
            return found
        times = _Times.of(found, lengths)
        with deadline.in_force():
            best = times.settled(deadline)
        steps += best.steps
        if best.same_as(times) or deadline.passed:
            break
        goal = None if found.problem is None else found.problem.goal
        settled = goal if isinstance(goal, FrameGoal) else None
        again = planned(_at(options, best.lengths), best.found.trajectory, settled)
        steps += again.nit
        if not again.success or again.cost >= found.cost:
            break
        found, lengths = again, best.lengths
    said = " and ".join(f"{t:.4g} s" for t in np.cumsum(lengths)[:-1])
    message = f"{found.message} It passes its via points at {said}, when that costs least."
    return dataclasses.replace(found, nit=steps, message=message)


def _at(options: PlanOptions, lengths: Array) -> PlanOptions:
    """The options with times of the via points."""
    times = np.cumsum(lengths)[:-1].tolist()
    pairs = zip(options.via, times, strict=True)
    return options.with_changes(via=[dataclasses.replace(each, time=t) for each, t in pairs])


def _first_lengths(
    robot: Robot, ends: tuple[End, End], via: Sequence[Via], T: float, options: PlanOptions
) -> Array:
    """Lengths of time in proportion to the largest change of a joint, (n + 1,), in [s]."""
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
    return np.asarray(T * fractions / fractions.sum())


@dataclass(frozen=True, eq=False)
class _Times:
    """A minimum for lengths of time between its via points, with the slopes in their parameters.

    slope: dJ/dy, (n + 1,). inverse: an estimate of the inverse of d2J/dy2. steps: so far.
    """

    found: Solution
    lengths: Array
    slope: Array
    inverse: Array
    steps: int = 0

    @classmethod
    def of(cls, found: Solution, lengths: Array) -> Self:
        """From a minimum alone."""
        slope = _slope(found, lengths)
        inverse = np.eye(len(slope)) * FIRST_STEP / max(float(np.abs(slope).max()), 1e-300)
        return cls(found, lengths, slope, inverse)

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
            if -0.5 * float(step @ now.slope) <= SETTLED * abs(now.found.cost):
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
        weights = self.lengths * np.exp(step)
        lengths = weights * (self.lengths.sum() / weights.sum())
        try:
            found = _solved(self.found, self.lengths, lengths)
        except OutOfTimeError:
            return None
        if not (found.success and found.cost < self.found.cost):
            return None
        slope = _slope(found, lengths)
        inverse = _updated(self.inverse, step - step.mean(), slope - self.slope)
        return _Times(found, lengths, slope, inverse, self.steps + found.nit)


def _solved(found: Solution, now: Array, lengths: Array) -> Solution:
    """The minimum for other lengths, from the motion for these, on its grid."""
    problem, clock = found.problem, Clock.of_parts(len(now))
    assert problem is not None
    path = stretched_path(found.trajectory.path, problem.grid, clock, now, lengths)
    other = problem.lasting(clock, now, lengths)
    return solved_on_grid(other, Start(path, near=True))


def _slope(found: Solution, lengths: Array) -> Array:
    """dJ/dy: see the module."""
    ends = np.cumsum([0.0, *lengths])

    def rates(i: int) -> Callable[[Grid], Array]:
        return lambda grid: np.asarray(np.clip((grid.t - ends[i]) / lengths[i], 0.0, 1.0))

    g = np.array([found.derivative_in_time(rates(i)) for i in range(len(lengths))])
    return np.asarray(lengths * (g - (lengths @ g) / lengths.sum()))


def _updated(inverse: Array, step: Array, change: Array) -> Array:
    """The inverse after a step, by Broyden, Fletcher, Goldfarb and Shanno's formula."""
    curvature = float(step @ change)
    if curvature <= 0.0:
        return inverse
    left = np.eye(len(step)) - np.outer(step, change) / curvature
    return np.asarray(left @ inverse @ left.T + np.outer(step, step) / curvature)
