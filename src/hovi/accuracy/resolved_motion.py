"""The reference motion of a diagram, refined until it no longer changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

from hovi.accuracy.measures import Thresholds
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.variational_method import on_grid
from hovi.discrete.grid import Grid
from hovi.discrete.motion_error import MotionError
from hovi.discrete.trajectory import Trajectory
from hovi.errors import UnmeasurableError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import Solution, solve_on_grid
from hovi.schemes import galerkin

INNER_MODES = 8
"""Inner modes of the resolved motion: more than any scheme in SCHEMES has."""
MIN_INTERVALS, MAX_INTERVALS = 16, 1024
CONVERGED = Thresholds(cost=1e-13, joints=1e-9, tip=1e-9)
"""Changes by a doubling of the intervals below which the motion is resolved."""
MAX_COST_CHANGE = 1e-6
"""Relative change of the cost at the last doubling above which the motion is no reference."""
COST_FLOOR = 1e-12
"""Cost below which only rounding is left."""


@dataclass(frozen=True, eq=False)
class ResolvedMotion:
    """A minimum of `galerkin-8`, converged under doubling of the intervals.

    trajectory, cost: the motion. uncertainty: change by the last doubling of the intervals, an
    upper estimate of the motion's own error.
    """

    trajectory: Trajectory = field(repr=False)
    cost: float
    uncertainty: MotionError

    @property
    def scheme(self) -> str:
        """Name of the scheme."""
        return self.trajectory.grid.schemes[0].name

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


def resolve(
    problem: TrajectoryProblem, found: Solution, expired: Callable[[], bool]
) -> ResolvedMotion:
    """Refine a coarse solution to the minimum that it approximates.

    problem: on any grid; its limits are ignored. found: the coarse solution.
    expired: whether time is up. Raises UnmeasurableError when no minimum can be resolved.
    """
    scheme, T = galerkin(INNER_MODES), problem.grid.duration
    intervals, previous = MIN_INTERVALS, found
    change = None
    while True:
        grid = Grid.uniform(T, intervals, scheme)
        solution = solve_on_grid(on_grid(problem, grid), previous.trajectory)
        if not solution.success:
            raise UnmeasurableError(
                f"no reference motion was found with {scheme.name} on {intervals} intervals: "
                f"{solution.message}"
            )
        if intervals > MIN_INTERVALS:
            fine = _reference(solution.trajectory, solution.cost)
            change = fine.error(previous.cost, previous.trajectory.configurations)
            if CONVERGED.met_by(change) or intervals >= MAX_INTERVALS or expired():
                break
        previous, intervals = solution, 2 * intervals
    if abs(solution.cost) < COST_FLOOR:
        raise UnmeasurableError(
            f"the cost of the motion is {solution.cost:.0e}, and errors are relative to its cost; "
            "choose a goal away from the start."
        )
    if change.cost > MAX_COST_CHANGE:
        raise UnmeasurableError(
            f"the cost still changes by {change.cost:.0e} from {intervals // 2} to {intervals} "
            f"intervals of {scheme.name}; use a smoother scene or a larger budget."
        )
    return ResolvedMotion(solution.trajectory, solution.cost, change)


def _reference(trajectory: Trajectory, cost: float) -> ReferenceMotion:
    robot = trajectory.robot
    assert robot is not None
    return ReferenceMotion(robot, trajectory.duration, trajectory.configurations, cost)
