"""A planning job: the input of a search and of its worker processes."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable
from dataclasses import field
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hovi.conditions.asked import times_of
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Effect
from hovi.errors import ChartError
from hovi.planning.problem.clock import Clock, Lengths
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via, held_goal, is_isolated
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.presolve.formulas_of_time import graded
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import LAST_BARRIER, Tolerance
from hovi.planning.refinement.adaptive import first_grid
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.initial_path import guess_path
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.scene.segmented_lagrangian import NODE_TOLERANCE, SegmentedLagrangian
from hovi.schemes import is_galerkin, of_order
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_GUESS_INTERVALS = 400
"""Largest number of intervals of a guess on whose grid a refinement begins."""
MAX_CHART_INTERVALS = 2000
"""Maximum number of intervals after halving for the orientations of the initial guess."""
CLOSE_NODES = 1e-3
"""Distance of times, as a fraction of the duration, up to which one node is for both."""


@dataclass(frozen=True, eq=False)
class JobSegment:
    """A segment of a job.

    end: when it ends, as a fraction of the duration, 1 for the last. acting: what acts in it.
    """

    end: float
    acting: Acting


@dataclass(frozen=True)
class Acting:
    """Effects besides those of a scene; one of the same kind takes the place of the scene's own.

    effects: which are equal to others where they can be compared, and are.
    """

    effects: tuple[Effect, ...] = field(compare=False)
    _key: Hashable = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            hash(self.effects)
            object.__setattr__(self, "_key", self.effects)
        except TypeError:  # an array in one of them
            object.__setattr__(self, "_key", tuple(map(id, self.effects)))

    def on(self, scene: Scene) -> Scene:
        """The scene with these effects, the same one for the same effects."""
        return _with_effects(scene, self) if self.effects else scene


@dataclass(frozen=True, eq=False)
class Job:
    """A problem to be solved, which worker processes build for themselves.

    grid: replaces the scheme and the intervals of the options.
    options: of the plan, with limits and tolerance resolved for the scene's robot.
    segments: the segments of a sequence; none for one motion in one scene.
    """

    scene: Scene
    grid: Grid
    start: State
    goal: State | FrameGoal
    options: PlanOptions = field(default_factory=PlanOptions)
    segments: tuple[JobSegment, ...] = ()

    @cached_property
    def limits(self) -> Limits:
        """Bounds along the motion."""
        limits = as_limits(self.scene.robot, self.options.limits)
        return dataclasses.replace(limits, strict=True) if self.options.strict else limits

    @property
    def via(self) -> tuple[Via, ...]:
        """The via points, by ascending time."""
        return tuple(sorted(self.options.via, key=lambda each: each.time))

    @property
    def ends(self) -> tuple[float, ...]:
        """The times at which its segments but the last end, ascending, in [s]."""
        return tuple(segment.end * self.grid.duration for segment in self.segments[:-1])

    @property
    def node_times(self) -> list[float]:
        """The times at which its grids have nodes, in [s].

        Those of via points, of conditions at given times, and of the ends of segments.
        """
        T, ends = self.grid.duration, self.ends
        between = [
            time
            for time in stops_of(self.options)
            if all(abs(time - end) > NODE_TOLERANCE * T for end in (*ends, T))
        ]
        return sorted([*between, *ends])

    @property
    def tolerance(self) -> Tolerance | None:
        """The largest allowed error; None for a given grid."""
        given = self.options.tolerance
        return None if given is None else Tolerance.of(given, self.scene.robot)

    @property
    def barrier(self) -> float:
        """The last barrier parameter of its solves within limits: see solve_on_grid."""
        return LAST_BARRIER if self.tolerance is None else self.tolerance.barrier

    def with_options(self, **changes: Any) -> Self:
        """The job with some of its options changed."""
        return dataclasses.replace(self, options=self.options.with_changes(**changes))

    def held_at(self, q: Array) -> State | None:
        """The state at q, (nq,), that satisfies the goal of a frame.

        None for another kind of goal, a q that does not satisfy it, and scenes with passive joints.
        """
        if not isinstance(self.goal, FrameGoal) or self.scene.passive:
            return None
        return held_goal(self.goal, self.scene.robot, q, tuple(self.start.free))

    @property
    def isolated(self) -> bool:
        """Whether the guess of its goal, of a frame, is an isolated configuration there."""
        goal = self.goal
        if not isinstance(goal, FrameGoal) or goal.guess is None or self.scene.passive:
            return False
        return is_isolated(goal, self.scene.robot, np.asarray(goal.guess))

    def to(self, goal: State | FrameGoal) -> Self:
        """The job to another goal."""
        return dataclasses.replace(self, goal=goal)

    def on(self, grid: Grid) -> Self:
        """The job on another grid."""
        return dataclasses.replace(self, grid=grid)

    def lasting(
        self,
        clock: Clock,
        lengths: Lengths,
        *,
        now: Lengths | None = None,
        grid: Grid | None = None,
    ) -> Self:
        """The job with other lengths of its free parts, in [s], on a grid for them.

        Goals of segments, limits and what is carried move along with the ends of the segments.
        now: the lengths of the job's own parts; that of a single one follows from its grid.
        grid: its own one for the new lengths if None.
        """
        now = clock.length(self.grid) if now is None else now
        longer = self.on(clock.grid(self.grid, now, lengths) if grid is None else grid)
        if not self.segments:
            return longer
        limits, ends = self.options.limits, clock.times(np.array(self.ends), now, lengths)
        fractions = (*(ends / longer.grid.duration).tolist(), 1.0)
        changes: dict[str, Any] = {
            "via": clock.via(self.options.via, now, lengths),
            "conditions": clock.conditions(self.options.conditions, now, lengths),
        }
        if isinstance(limits, Limits):
            changes["limits"] = clock.limits(limits, now, lengths)
        own = zip(self.segments, fractions, strict=True)
        segments = tuple(dataclasses.replace(each, end=end) for each, end in own)
        options = longer.options.with_changes(**changes)
        if options.clearance.during:
            options = options.carrying(clock.clearance(options.clearance, now, lengths).during)
        return dataclasses.replace(longer, options=options, segments=segments)

    def graded(self, grid: Grid) -> Grid:
        """The grid with nodes where formulas of time change, unless the options name the grid."""
        return grid if self.tolerance is None else self._graded(grid)[0]

    def with_nodes_where_led_back(self) -> Self:
        """The job with nodes at the times until which its start is led back inside its limits.

        Bounds have a kink there, which no estimate sees inside an interval. The same job where the
        options name the grid.
        """
        limits, T = self.problem().limits, self.grid.duration
        if self.tolerance is None or limits is None or not limits.excused:
            return self
        times = self.node_times
        for time in sorted(each.until for each in limits.excused):
            if all(abs(time - other) > CLOSE_NODES * T for other in (0.0, *times, T)):
                times.append(time)
        return self.on(self.graded(self.grid.with_nodes(sorted(times), halved=True)))

    @property
    def fault_of_time(self) -> str:
        """What no grid of its options resolves of the formulas of time, a clause; "" if nothing."""
        return "" if self.tolerance is None else self._graded(self.grid)[1]

    def _graded(self, grid: Grid) -> tuple[Grid, str]:
        acting = [segment.acting.on(self.scene) for segment in self.segments] or [self.scene]
        ends = [*(T * grid.duration / self.grid.duration for T in self.ends), grid.duration]
        return graded(grid, tuple(zip(acting, ends, strict=True)))

    def lagrangian(self) -> Lagrangian:
        """The effort of the scene, or of the scene of every segment."""
        weight = self.options.weight
        if not self.segments:
            return self.scene.effort_lagrangian(weight)
        scenes = [segment.acting.on(self.scene) for segment in self.segments]
        return SegmentedLagrangian(tuple(x.effort_lagrangian(weight) for x in scenes), self.ends)

    def problem(self) -> TrajectoryProblem:
        """The trajectory problem, built on first use."""
        return self._problem

    @cached_property
    def _problem(self) -> TrajectoryProblem:
        ld = DiscreteLagrangian(self.lagrangian(), self.grid)
        clearance, weight = self.options.clearance, self.options.time_weight
        ends = self.start, self.goal
        asked = self.options.conditions
        return TrajectoryProblem(ld, *ends, self.limits, self.via, clearance, weight, asked)

    def __getstate__(self) -> dict[str, Any]:
        """The state without the problem, which worker processes build, and without the guess."""
        kept = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        return kept | {"options": self.options.with_changes(guess="cubic")}


@lru_cache(maxsize=64)
def _with_effects(scene: Scene, acting: Acting) -> Scene:
    keys = {effect.key for effect in acting.effects}
    kept = [effect for effect in scene.effects if effect.key not in keys]
    return dataclasses.replace(scene, effects=[*kept, *acting.effects])


def split_for_charts(job: Job, guess: str | Trajectory) -> Job:
    """The job with intervals halved until the charts contain the orientations of the guess.

    Raises ChartError if that takes more than MAX_CHART_INTERVALS.
    """
    if job.scene.robot.space.flat:
        return job
    while True:
        try:
            guess_path(job.problem(), guess)
            return job
        except ChartError:
            if 2 * job.grid.intervals > MAX_CHART_INTERVALS:
                raise
        job = job.on(job.grid.halved())


def grid_of(T: float, options: PlanOptions, scene: Scene) -> Grid:
    """The requested grid, or the first grid of the refinement to a tolerance.

    The latter is the guess's own grid if that is a finer one, so that the guess is not coarsened.
    """
    guess = options.guess
    if options.tolerance is None:
        grid = Grid.uniform(T, options.interval_count, of_order(options.table, scene.order))
    elif isinstance(guess, Trajectory) and _is_first_grid(guess.grid, options, scene.order):
        grid = guess.grid.stretched(T)
    else:
        limits = as_limits(scene.robot, options.limits)
        limited = limits.bounded.any() or limits.conditions or options.conditions
        kinks = limited or options.clearance.wanted or options.via
        grid = first_grid(T, options.interval_count, not kinks, scene.order)
    stops = [time for time in stops_of(options) if abs(time - T) > NODE_TOLERANCE * T]
    return grid.with_nodes(stops, options.intervals is None)


def stops_of(options: PlanOptions) -> list[float]:
    """The times of via points and of conditions at given times or in parts, ascending, in [s]."""
    parts = [t for each in options.conditions for t in each.during or () if t > 0]
    via = (each.time for each in options.via)
    return sorted({*via, *times_of(options.conditions), *parts})


def _is_first_grid(grid: Grid, options: PlanOptions, order: int) -> bool:
    """Whether a refinement begins on the grid of its guess.

    The grid has Galerkin tables only, and more intervals than the first grid would have, up to
    MAX_GUESS_INTERVALS; neither intervals nor via points ask for others. order: of the Lagrangian.
    """
    if options.intervals is not None or stops_of(options) or grid.order != order:
        return False
    refinable = all(is_galerkin(scheme) for scheme, _ in grid.groups)
    return refinable and options.interval_count < grid.intervals <= MAX_GUESS_INTERVALS
