"""The reference motion of a diagram, refined until it no longer changes."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import field
from functools import cached_property

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.variational_method import on_grid
from hovi.discrete.grid import Grid
from hovi.discrete.measures.motion_error import MotionError
from hovi.discrete.trajectory import Trajectory
from hovi.errors import UnmeasurableError
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.limit_sensitivity import cost_of_tolerance
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.planning.solver.status import Status
from hovi.schemes import galerkin
from hovi.system.dataclass import dataclass

INNER_MODES = 8
"""Inner modes of a resolved motion without limits: more than any scheme in SCHEMES has."""
LIMITED_MODES = 4
"""Least number of inner modes within limits, where more do not resolve kinks any better."""
MIN_INTERVALS, MAX_INTERVALS = 16, 1024
CONVERGED = Thresholds(cost=1e-13, joints=1e-9, tip=1e-9)
"""Changes by a doubling of the intervals below which the motion is resolved."""
CONVERGED_FRACTION = 0.2
"""Change of the cost within limits below which the motion is resolved, relative to the effect of
the tolerance of the limits: below that, no run is any better."""
LIMIT_TOLERANCE_FRACTION = 0.01
"""Tolerance of the limits of the reference motion, relative to the scene's."""
SLOW_DECREASE = 0.25
"""Ratio of successive changes below which the last one is an upper estimate of the error."""
MAX_COST_CHANGE = 1e-3
"""Relative change of the cost at the last doubling above which the motion is no reference."""
COST_FLOOR = 1e-12
"""Cost below which only rounding is left."""
MAX_STEPS, MAX_LIMITED_STEPS = 100, 500
"""Numbers of steps of a solve, without and within limits, after which it has left its guess."""
MAX_FAILURES = 1
"""Number of first grids that may be too coarse for the motion."""
MAX_TIME_RATIO = 2.0
"""Ratio of solving times that is assumed from one grid to the next finer one."""


@dataclass(frozen=True, eq=False)
class ResolvedMotion:
    """A minimum that has converged under doubling of the intervals, or nearly so.

    trajectory, cost: the motion. uncertainty: change by the last doubling of the intervals, an
    upper estimate of the motion's own error. converged: whether it is as small as is asked for.
    limit_effect: relative change of the cost by which a motion may differ from this one because its
        limits hold to the scene's tolerance only; 0 without limits.
    """

    trajectory: Trajectory = field(repr=False)
    cost: float
    uncertainty: MotionError
    converged: bool = True
    limit_effect: float = 0.0

    @property
    def scheme(self) -> str:
        """Name of the scheme, or a range of names."""
        return self.trajectory.grid.scheme_range

    @property
    def intervals(self) -> int:
        """Number of intervals."""
        return self.trajectory.grid.intervals

    @property
    def tip_frames(self) -> tuple[str, ...]:
        """At which errors of the tip are measured; the largest of them counts."""
        return self.reference.robot.tip_frames

    @cached_property
    def reference(self) -> ReferenceMotion:
        """The motion as the reference for errors."""
        return _reference(self.trajectory, self.cost)

    def doubted(self, cost: float) -> ResolvedMotion:
        """The motion, with an uncertainty that a motion of this cost within its limits allows.

        Without limits costs prove nothing, as the action need not be the integral along the curve.
        """
        excess = (self.cost - cost) / abs(self.cost) - self.limit_effect
        if self.limit_effect == 0 or excess <= self.uncertainty.cost:
            return self
        larger = dataclasses.replace(self.uncertainty, cost=excess)
        return dataclasses.replace(self, uncertainty=larger, converged=False)


def resolve(
    problem: TrajectoryProblem, found: Solution, budget: Budget, fraction: float = 1.0
) -> ResolvedMotion:
    """Refine a coarse solution to the minimum that it approximates.

    Without limits on uniform grids of `galerkin-8`, else on the solution's own grid, which is
    finer where limits become active; all intervals are halved again and again.

    problem: on the grid of the solution; its limits hold to LIMIT_TOLERANCE_FRACTION of their
    tolerance. found: the coarse solution. budget: of which `fraction` may be spent.
    If there is no time for that, the coarse solution has its estimated error.
    Raises UnmeasurableError when no minimum can be resolved.
    """
    solutions = _Halving(problem, found, budget, fraction)
    solutions.run()
    finest, change = solutions.finest, solutions.change
    if change is None and solutions.late:
        change = _estimated_error(found)
    if change is None:
        raise UnmeasurableError(f"the motion could not be refined: {solutions.failure}")
    if abs(finest.cost) < COST_FLOOR:
        raise UnmeasurableError(
            f"the cost of the motion is {finest.cost:.0e}, and errors are relative to its cost; "
            "choose a goal away from the start."
        )
    if change.cost > MAX_COST_CHANGE:
        raise UnmeasurableError(
            f"the cost of the motion still changes by {change.cost:.0e} when all intervals are "
            f"halved to {finest.trajectory.grid.intervals}; use a smoother scene or a larger "
            "budget."
        )
    return ResolvedMotion(
        finest.trajectory, finest.cost, change, solutions.converged, solutions.limit_effect
    )


class _Halving:
    """Solutions on successively halved intervals, each the guess of the next.

    finest: the last of them, at first the solution to begin with. change: from the one before, or
    more if the changes decrease slowly; None until then. failure: why there is no change.
    late: whether it is time.
    """

    def __init__(
        self, problem: TrajectoryProblem, found: Solution, budget: Budget, fraction: float
    ) -> None:
        self._budget, self._fraction = budget, fraction
        self._problem = _with_strict_limits(problem) if problem.limited else problem
        cost = problem.ld.action(found.trajectory.path)  # without the cost of a free duration
        self.finest = dataclasses.replace(found, cost=cost)
        self.change: MotionError | None = None
        self.failure, self.late = "the budget ended before; use a larger budget.", True

    def run(self) -> None:
        """Halve the intervals until the motion no longer changes, a solve fails or time is up."""
        grid, expected, failures = self._first_grid(), 0.0, 0
        while grid.intervals <= MAX_INTERVALS and self._budget.allows(expected, self._fraction):
            began = time.monotonic()
            left = self._budget.left_of(self._fraction)
            problem = on_grid(self._problem, grid)
            most = MAX_LIMITED_STEPS if problem.limited else MAX_STEPS
            solution = solve_on_grid(
                problem, self.finest.trajectory, max_iterations=most, time_limit=left
            )
            expected = MAX_TIME_RATIO * (time.monotonic() - began)
            if solution.success:
                self._add(solution)
            else:
                self.failure, failures = solution.message, failures + 1
                self.late = solution.status is Status.TIME_LIMIT
            if self.converged or failures > (MAX_FAILURES if self.change is None else 0):
                break
            grid = solution.trajectory.grid.halved()

    @property
    def converged(self) -> bool:
        """Whether the last change is small."""
        if self.change is None or not self._problem.limited:
            return self.change is not None and CONVERGED.met_by(self.change)
        return self.change.cost <= CONVERGED_FRACTION * self.limit_effect

    @property
    def limit_effect(self) -> float:
        """Relative effect of the limits' tolerance on the cost."""
        strict = self.change is not None
        return cost_of_tolerance(self.finest) / (LIMIT_TOLERANCE_FRACTION if strict else 1.0)

    def _first_grid(self) -> Grid:
        grid = self.finest.trajectory.grid
        if not self._problem.limited:
            scheme = galerkin(INNER_MODES, grid.order)
            return Grid.uniform(self._problem.grid.duration, _first_intervals(grid), scheme)
        fewer = LIMITED_MODES - grid.inner_modes
        return (grid.enriched(fewer) if fewer > 0 else grid).halved()

    def _add(self, solution: Solution) -> None:
        fine = _reference(solution.trajectory, solution.cost)
        change = fine.error(self.finest.cost, self.finest.trajectory.configurations)
        if self.change is not None:  # a small change may be a coincidence
            least = SLOW_DECREASE * self.change.cost if self._problem.limited else 0.0
            change = dataclasses.replace(change, cost=max(change.cost, least))
        self.change, self.finest = change, solution


def _estimated_error(found: Solution) -> MotionError | None:
    """The error of a minimum as `plan` estimates it."""
    accuracy = found.accuracy if found.success else None
    return None if accuracy is None else accuracy.estimate


def _first_intervals(grid: Grid) -> int:
    """MIN_INTERVALS times a power of two, with as many unknowns as the grid or more."""
    modes = sum((scheme.inner_modes + 2) * len(index) for scheme, index in grid.groups)
    intervals = MIN_INTERVALS
    while intervals * (INNER_MODES + 2) < modes and intervals < MAX_INTERVALS:
        intervals *= 2
    return intervals


def _with_strict_limits(problem: TrajectoryProblem) -> TrajectoryProblem:
    """The problem with a smaller tolerance of its limits."""
    limits = problem.limits or no_limits(problem.robot)
    strict = dataclasses.replace(limits, tolerance=LIMIT_TOLERANCE_FRACTION * limits.tolerance)
    return dataclasses.replace(problem, limits=strict)


def _reference(trajectory: Trajectory, cost: float) -> ReferenceMotion:
    robot = trajectory.robot
    assert robot is not None
    return ReferenceMotion(robot, trajectory.duration, trajectory.configurations, cost)
