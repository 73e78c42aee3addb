"""Which configurations a motion between frames begins and ends at: the branches compared by cost.

A frame is at its goal in several configurations, the branches of inverse kinematics, between which
the cost of the best motion differs by factors. Those that keep the limits and the margin from
obstacles are ordered by their distance to the other end. The nearest of them are compared by the
cost of the cubic that leads there, which takes a millisecond; and those whose cubics cost nearly as
little as the cheapest one, and the nearest, by a motion within the limits on a few intervals.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import HoviError, UnreachableError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import (
    configurations,
    first_configuration,
    position_bounds,
)
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import LIMITED_ORDERS, TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.solver import solve_on_grid
from hovi.planning.solver.status import Status
from hovi.scene.scene import Scene
from hovi.schemes import by_name, of_order
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]
Ends = tuple[State, State | None]

COMPARED = 8
"""Number of branches whose cubics are compared, those nearest to the other end."""
NEARLY = 1.25
"""Ratio to the cheapest cubic up to which branches are compared by a motion within the limits."""
SOLVED = 4
"""Largest number of these motions besides the one to the nearest branch."""
COMPARED_STARTS = 4
"""Number of starts from which the branches of a frame goal are compared."""
INTERVALS = 8
"""Number of intervals of these motions."""
LAST_BARRIER = 1e-3
"""Last barrier parameter of these motions, relative to the mean density of their cost."""
STEPS = 40
"""Largest number of steps towards each of them."""
SHARE = 0.2
"""Share of a time limit for the choice."""


def chosen_ends(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float,
    options: PlanOptions,
    deadline: Deadline,
) -> tuple[State, State | FrameGoal]:
    """The start as a state, and the goal with the branch to which the motion is the cheapest.

    A start is the branch itself; of a goal it is the guess of inverse kinematics, if it has none.
    duration: in [s]. options: resolved for the scene's robot. deadline: of the whole plan.
    Raises UnreachableError for a start that cannot be met; a goal then stays as it is.
    """
    if isinstance(start, State) and (isinstance(goal, State) or goal.guess is not None):
        return start, goal
    choice = _Choice(scene, duration, options, deadline.part(SHARE))
    pairs = choice.pairs(start, goal)
    first, last = pairs[choice.cheapest(pairs)]
    if isinstance(goal, State) or goal.guess is not None or last is None:
        return first, goal
    return first, dataclasses.replace(goal, guess=last.on(scene.robot, "goal")[0])


def nearest_ends(
    scene: Scene, start: State | FrameGoal, goal: State | FrameGoal, options: PlanOptions
) -> tuple[State, State | FrameGoal]:
    """The start as a state, that of the branch nearest to the goal, and the goal as it is.

    Raises as `chosen_ends`, and InputError for a frame that the robot does not have.
    """
    for end in (start, goal):
        if isinstance(end, FrameGoal):
            end.check(scene.robot)
    if isinstance(start, State):
        return start, goal
    alone = _Choice(scene, 0.0, options, Deadline())
    near = None if isinstance(goal, FrameGoal) else goal.on(scene.robot, "goal")[0]
    return alone.branches(start, near)[0], goal


@dataclass(frozen=True, eq=False)
class _Choice:
    """A plan whose ends are to be chosen: see `chosen_ends`. deadline: of the choice."""

    scene: Scene
    duration: float
    options: PlanOptions
    deadline: Deadline

    def pairs(self, start: State | FrameGoal, goal: State | FrameGoal) -> list[Ends]:
        """Pairs of a start and a state at the goal, None if it cannot be met; the nearest first."""
        near = None if isinstance(goal, FrameGoal) else self._configuration(goal)
        starts = [start] if isinstance(start, State) else self.branches(start, near)
        if isinstance(goal, State):
            return [(each, goal) for each in starts[:COMPARED]]
        pairs: list[Ends] = []
        for each in starts[:COMPARED_STARTS]:
            try:
                ends = self.branches(goal, self._configuration(each))
            except UnreachableError:
                return [(each, None)]
            pairs += [(each, end) for end in ends[: COMPARED // min(len(starts), COMPARED_STARTS)]]
        return pairs

    def branches(self, goal: FrameGoal, near: Array | None) -> list[State]:
        """The states in which a frame meets its goal: that at the guess alone if it has one."""
        robot, options = self.scene.robot, self.options
        bounds = position_bounds(robot, as_limits(robot, options.limits))
        first = first_configuration(robot, goal, near if goal.guess is None else None, bounds)
        found = configurations(robot, goal, first, bounds, options.clearance)
        chosen = found if goal.guess is None else found[:1]
        return [State(q, free_velocity=tuple(goal.free_velocity)) for q in chosen]

    def _configuration(self, state: State) -> Array:
        return state.on(self.scene.robot, "start")[0]

    def cheapest(self, pairs: list[Ends]) -> int:
        """Index of the pair of ends between which the motion costs least; the first if unknown."""
        known = self.scene.order in LIMITED_ORDERS and not self.scene.passive
        if len(pairs) == 1 or not known:
            return 0
        try:
            with self.deadline.in_force():
                return self._compared(pairs)
        except (OutOfTimeError, HoviError):
            return 0

    def _compared(self, pairs: list[Ends]) -> int:
        problems = [self._problem(start, goal) for start, goal in pairs if goal is not None]
        cubics = [problem.ld.action(problem.guess("cubic")) for problem in problems]
        order = np.argsort(cubics, kind="stable")
        best = cubics[order[0]]
        cheap = [int(i) for i in order[:SOLVED] if cubics[i] <= NEARLY * best]
        compared = sorted({0, *cheap})
        if len(compared) == 1:
            return 0
        return min(compared, key=lambda i: self._cost(problems[i]))

    def _problem(self, start: State, goal: State) -> TrajectoryProblem:
        """The motion between two states on a few intervals, within the limits."""
        scheme = of_order(by_name("galerkin-2"), self.scene.order)
        grid = Grid.uniform(self.duration, INTERVALS, scheme)
        limits = as_limits(self.scene.robot, self.options.limits).first_kinds
        options = self.options.with_changes(
            via=(), obstacles=(), self_collision=False, limits=limits
        )
        return Job(self.scene, grid, start, goal, options).problem()

    def _cost(self, problem: TrajectoryProblem) -> tuple[bool, float]:
        """Whether no motion within the limits is found, and the cost of the best one."""
        found = solve_on_grid(problem, max_iterations=STEPS, barrier=LAST_BARRIER)
        return found.status in (Status.INFEASIBLE, Status.DIVERGED), found.cost
