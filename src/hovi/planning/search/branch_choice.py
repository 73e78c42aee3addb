"""Which configurations a motion between frames begins and ends at: the branches compared by cost.

A frame is at its goal in several configurations, the branches of inverse kinematics, between which
the cost of the best motion differs by factors. The cost of a cubic says little about that of the
best motion, so that a motion within the limits is solved for each branch, on a few intervals; where
a branch allows full turns of joints, the ones with the cheapest cubics are solved for, too. Where
the joints are more than the equations, branches are members of families, along which the end of
each of these motions is free to move.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, UnreachableError
from hovi.planning.paths.rough_motions import rough_motions
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import (
    MOST,
    configurations,
    first_configuration,
    position_bounds,
)
from hovi.planning.problem.kinematics.cubic_costs import cubic_costs
from hovi.planning.problem.kinematics.full_turns import with_full_turns
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.notation.supported import LIMITED_ORDERS
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.initial_path import guess_path
from hovi.planning.solver.solver import Solution, solved_on_grid
from hovi.planning.solver.status import Status
from hovi.scene.scene import Scene
from hovi.schemes import by_name, of_order
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError

Array = npt.NDArray[np.float64]

SKETCHED, SOLVED = 64, 16
"""Largest numbers of pairs of ends between which a rough motion is looked for, and of the cheapest
among them, for which one is solved for."""
TURNED = 4
"""Largest number of pairs of ends with full turns among those that are compared."""
ROUGH, FROM_ROUGH = 3, 6
"""Number of rough motions between each pair, from random bumps, and of pairs for which a motion is
solved for from the best of them, besides that from the cubic."""
CLEARED = 4
"""Largest number of pairs of ends that are solved for again with links kept apart."""
INTERVALS = 4
"""Number of intervals of the motions by which pairs of ends are compared."""
LAST_BARRIER = 1e-2
"""Last barrier parameter of the motions by which pairs of ends are compared, relative to the mean
density of their cost."""
STEPS = 40
"""Largest number of steps to each motion by which pairs of ends are compared."""
CHOICE_FRACTION = 0.2
"""Fraction of a time limit for the choice of the ends."""


@dataclass(frozen=True, eq=False)
class Ends:
    """The ends of a plan: the branches between which the motion is the cheapest, and others.

    start, goal: of the plan; a goal of a frame has the branch as its guess.
    motions: between pairs of branches, on a few intervals, the cheapest first; none where nothing
        was compared. choice: from which they come; None likewise.
    reason: why there is no motion, as a clause; "" if there may be one.
    """

    start: State
    goal: State | FrameGoal
    motions: tuple[_Motion, ...] = ()
    choice: _Choice | None = None
    reason: str = ""

    @property
    def compared(self) -> int:
        """Number of pairs of branches that were compared."""
        return max(len(self.motions), 1)

    @property
    def found(self) -> tuple[Trajectory, ...]:
        """The motions from the start, within the limits, the cheapest first."""
        return tuple(each.found.trajectory for each in self._from_start if each.known)

    @property
    def _from_start(self) -> tuple[_Motion, ...]:
        return tuple(each for each in self.motions if each.pair.start is self.start)

    def cheaper_clear(self, cost: float, deadline: Deadline) -> Ends | None:
        """The ends between which a motion clear of obstacles and of the robot itself costs least.

        None if no such motion is found that costs less than the known one between these ends.
        cost: of that one; infinite without one. deadline: of the whole plan.
        """
        if self.choice is None:
            return None
        choice = dataclasses.replace(self.choice, deadline=deadline.part(CHOICE_FRACTION))
        known = [each for each in self._from_start if each.known]
        best = choice.clear(known, cost) if known else None
        return None if best is None else choice.chosen((best,))


def chosen_ends(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float,
    options: PlanOptions,
    deadline: Deadline,
) -> Ends:
    """The start as a state, and the goal with the branch to which the motion is the cheapest.

    A start is the branch itself; of a goal it is the guess of inverse kinematics, if it has none.
    duration: in [s]. options: resolved for the scene's robot. deadline: of the whole plan.
    Raises UnreachableError for a start that cannot be reached; a goal then stays as it is.
    """
    if isinstance(start, State) and _is_one(goal):
        return Ends(start, goal)
    return _Choice(scene, start, goal, duration, options, deadline.part(CHOICE_FRACTION)).ends()


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
    alone = _Choice(scene, start, goal, 0.0, options, Deadline())
    return alone.starts()[0], goal


@dataclass(frozen=True, eq=False)
class _Pair:
    """A start and a configuration at the goal, (nq,). turned: whether by further full turns."""

    start: State
    q: Array
    turned: bool


@dataclass(frozen=True, eq=False)
class _Motion:
    """A motion between a pair of ends, on a few intervals."""

    pair: _Pair
    found: Solution

    @property
    def known(self) -> bool:
        """Whether there is one within the limits."""
        return self.found.status not in _WITHOUT_MOTION

    @property
    def rank(self) -> tuple[bool, bool, float]:
        """Whether none within the limits is found, or no minimum, and its cost."""
        return not self.known, not self.found.success, self.found.cost


@dataclass(frozen=True, eq=False)
class _Choice:
    """A plan whose ends are to be chosen: see `chosen_ends`. deadline: of the choice."""

    scene: Scene
    start: State | FrameGoal
    goal: State | FrameGoal
    duration: float
    options: PlanOptions
    deadline: Deadline

    def ends(self) -> Ends:
        """The ends of the cheapest motion; the nearest ones if no motion is found."""
        starts = self.starts()
        try:
            pairs = self._all_pairs(starts)
        except UnreachableError as error:
            near = str(error).rstrip(".") if self.options.clearance.wanted else ""
            return Ends(starts[0], self.goal, reason=near)
        known = self.scene.order in LIMITED_ORDERS and not self.scene.passive
        solved = self._solved(pairs) if known and len(pairs) > 1 else ()
        if not solved:
            return Ends(pairs[0].start, self._goal_at(pairs[0].q))
        return self.chosen(solved)

    def chosen(self, motions: tuple[_Motion, ...]) -> Ends:
        """The ends of the first of motions."""
        best = motions[0].pair
        return Ends(best.start, self._goal_at(best.q), motions, self)

    def clear(self, motions: Sequence[_Motion], cost: float) -> _Motion | None:
        """The cheapest of motions when they keep clear, if it is cheaper than the first of them.

        motions: the cheapest first. They cost no less for keeping clear, so that dearer ones than
        the best are not solved for. cost: of the first of them on many intervals; the others are
        compared with what it costs on a few.
        """
        first, best = motions[0], None
        try:
            with self.deadline.in_force():
                for motion in motions[:CLEARED]:
                    if motion is not first and motion.found.cost >= cost:
                        break
                    clear = self._clear(motion)
                    if not clear.found.success:
                        continue
                    if clear.found.cost < cost:
                        best, cost = clear, clear.found.cost
                    elif motion is first:
                        cost = clear.found.cost
        except (OutOfTimeError, HoviError):
            pass
        return best

    def _clear(self, motion: _Motion) -> _Motion:
        """A motion between the same ends that is clear of obstacles and of the robot itself."""
        problem = self._problem(motion.pair, clear=True)
        guess = guess_path(problem, motion.found.trajectory)
        found = solved_on_grid(problem, guess, max_iterations=STEPS, barrier=LAST_BARRIER)
        return _Motion(motion.pair, found)

    def starts(self) -> list[State]:
        """The states at which the motion may begin, the nearest to the goal first."""
        if isinstance(self.start, State):
            return [self.start]
        near = None if isinstance(self.goal, FrameGoal) else self._configuration(self.goal)
        velocity = tuple(self.start.free_velocity)
        return [State(q, free_velocity=velocity) for q in self._branches(self.start, near)]

    def _branches(self, goal: FrameGoal, near: Array | None) -> Array:
        """Configurations in which a frame reaches its goal: that at its guess if it has one."""
        robot, options = self.scene.robot, self.options
        first = first_configuration(robot, goal, near if goal.guess is None else None, self._bounds)
        most = SKETCHED if _is_one(self.start) or _is_one(self.goal) else MOST
        found = configurations(robot, goal, first, self._bounds, options.clearance, most)
        return found if goal.guess is None else found[:1]

    def _all_pairs(self, starts: Sequence[State]) -> list[_Pair]:
        """The pairs of the nearest start, and of the others until the deadline."""
        pairs = self._pairs(starts[0])
        for start in starts[1:]:
            if self.deadline.passed:
                break
            pairs += self._pairs(start)
        return pairs

    def _pairs(self, start: State) -> list[_Pair]:
        """A start with all branches of the goal, each followed by what full turns make of it."""
        goal, robot = self.goal, self.scene.robot
        if isinstance(goal, State):
            return [_Pair(start, self._configuration(goal), False)]
        near = self._configuration(start)
        found = self._branches(goal, near)
        if goal.guess is not None:
            return [_Pair(start, q, False) for q in found]
        return [
            _Pair(start, q, number > 0)
            for branch in found
            for number, q in enumerate(
                with_full_turns(robot, goal.moves(robot), branch, near, self._bounds)
            )
        ]

    @property
    def _bounds(self) -> tuple[Array, Array]:
        return position_bounds(self.scene.robot, as_limits(self.scene.robot, self.options.limits))

    def _configuration(self, state: State) -> Array:
        return state.on(self.scene.robot, "start")[0]

    def _goal_at(self, q: Array) -> State | FrameGoal:
        """The goal with a configuration as its guess, if it has none."""
        goal = self.goal
        if isinstance(goal, State) or _is_one(goal):
            return goal
        return dataclasses.replace(goal, guess=q)

    def _solved(self, pairs: list[_Pair]) -> tuple[_Motion, ...]:
        """Motions between pairs of ends on a few intervals, the cheapest first.

        Those that are solved for until the deadline, one for each pair.
        """
        found = dict[int, _Motion]()
        try:
            with self.deadline.in_force():
                for number, curve in self._guesses(pairs):
                    problem = self._problem(pairs[number])
                    guess = "cubic" if curve is None else problem.path(curve)
                    solution = solved_on_grid(
                        problem, guess, max_iterations=STEPS, barrier=LAST_BARRIER
                    )
                    motion, known = _Motion(pairs[number], solution), found.get(number)
                    if known is None or motion.rank < known.rank:
                        found[number] = motion
        except (OutOfTimeError, HoviError):
            pass
        return tuple(sorted(found.values(), key=lambda each: each.rank))

    def _guesses(self, pairs: list[_Pair]) -> Iterator[tuple[int, Curve | None]]:
        """Numbers of pairs and guesses, None for the cubic: those first that promise most."""
        robot = self.scene.robot
        if not robot.space.flat or self.scene.terms.timed:
            yield from ((number, None) for number in self._promising(pairs, SOLVED))
            return
        chosen = self._promising(pairs, SKETCHED)
        q0, q1 = self._configurations([pairs[i] for i in chosen])
        v0 = np.array([pairs[i].start.on(robot, "start")[1] for i in chosen])
        lagrangian = self.scene.effort_lagrangian(self.options.weight)
        limits = as_limits(robot, self.options.limits)
        rough = [
            rough_motions(lagrangian, robot, limits, (q0, q1, v0), self.duration, seed)
            for seed in range(ROUGH)
        ]
        best = np.argmin([each.cost for each in rough], axis=0)
        order = np.argsort([rough[b].cost[i] for i, b in enumerate(best)], kind="stable")[:SOLVED]
        for rank, i in enumerate(order):
            if rank < FROM_ROUGH:
                yield chosen[i], rough[best[i]].curve(int(i))
        yield from ((chosen[i], None) for i in order)

    def _promising(self, pairs: list[_Pair], most: int) -> list[int]:
        """Up to `most` pairs: those without further turns, and the cheapest cubics of others."""
        lagrangian = self.scene.effort_lagrangian(self.options.weight)
        q0, q1 = self._configurations(pairs)
        cost = cubic_costs(lagrangian, self.scene.robot, q0, q1, self.duration)
        order = np.argsort(np.where(np.isfinite(cost), cost, np.inf), kind="stable")
        turned = [int(i) for i in order if pairs[i].turned][:TURNED]
        others = [int(i) for i in order if not pairs[i].turned]
        return others[: most - len(turned)] + turned

    def _configurations(self, pairs: list[_Pair]) -> tuple[Array, Array]:
        """Those at both ends of pairs, (P, nq) each."""
        starts = [self._configuration(pair.start) for pair in pairs]
        return np.array(starts), np.array([pair.q for pair in pairs])

    def _problem(self, pair: _Pair, clear: bool = False) -> TrajectoryProblem:
        """The motion between two ends on a few intervals, within the limits.

        clear: whether it is clear of obstacles and of the robot itself.
        """
        scheme = of_order(by_name("galerkin-2"), self.scene.order)
        grid = Grid.uniform(self.duration, INTERVALS, scheme)
        limits = as_limits(self.scene.robot, self.options.limits).first_kinds
        options = self.options.with_changes(via=(), limits=limits)
        if not clear:
            options = options.with_changes(obstacles=(), self_collision=False)
        goal = self.goal
        if isinstance(goal, FrameGoal):
            goal = State(pair.q, free_velocity=goal.free_velocities(self.scene.robot))
        return Job(self.scene, grid, pair.start, goal, options).problem()


def _is_one(end: State | FrameGoal) -> bool:
    """Whether an end is reached in a single configuration, the given one."""
    return isinstance(end, State) or end.guess is not None


_WITHOUT_MOTION = Status.INFEASIBLE, Status.DIVERGED
