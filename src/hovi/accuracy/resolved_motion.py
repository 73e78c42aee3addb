"""The motion that methods are measured against: resolved until it stops changing."""

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
from hovi.planning.solver.solver import Solution, solve
from hovi.schemes import galerkin

MODES = 8
"""Inner modes of the resolved motion: more than those of any scheme that is measured by default."""
COARSEST, FINEST = 16, 1024
STILL = Thresholds(cost=1e-13, joints=1e-9, tip=1e-9)
"""Changes below which a doubling of the intervals has changed nothing."""
TRUSTED = 1e-6
"""Change of the cost at the last doubling above which there is nothing to measure against."""

NO_COST = 1e-12
"""A cost that is nothing but rounding."""


@dataclass(frozen=True, eq=False)
class ResolvedMotion:
    """A minimum by `galerkin-8` on so many intervals that half of them give the same.

    trajectory, cost: the motion. uncertainty: what the last doubling of the intervals changed,
    an upper estimate of its own error.
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

    @cached_property
    def reference(self) -> ReferenceMotion:
        """What measures the distance from it."""
        return _reference(self.trajectory, self.cost)


def resolve(
    problem: TrajectoryProblem, found: Solution, expired: Callable[[], bool]
) -> ResolvedMotion:
    """The minimum that a coarse solution stands for.

    problem: on any grid; its limits are left out. found: where to start.
    expired: whether time is up. Raises UnmeasurableError when no minimum can be resolved.
    """
    scheme, T = galerkin(MODES), problem.grid.duration
    intervals, previous = COARSEST, found
    change = None
    while True:
        grid = Grid.uniform(T, intervals, scheme)
        solution = solve(on_grid(problem, grid), previous.trajectory)
        if not solution.success:
            raise UnmeasurableError(
                f"no motion to measure against was found with {scheme.name} on {intervals} "
                f"intervals: {solution.message}"
            )
        if intervals > COARSEST:
            fine = _reference(solution.trajectory, solution.cost)
            change = fine.error(previous.cost, previous.trajectory.configurations)
            if STILL.met_by(change) or intervals >= FINEST or expired():
                break
        previous, intervals = solution, 2 * intervals
    if abs(solution.cost) < NO_COST:
        raise UnmeasurableError(
            f"the motion costs {solution.cost:.0e}, and errors are relative to its cost; give it "
            "somewhere to go."
        )
    if change.cost > TRUSTED:
        raise UnmeasurableError(
            f"the motion still changes by {change.cost:.0e} in its cost from {intervals // 2} to "
            f"{intervals} intervals of {scheme.name}; give it a smoother scene or more time."
        )
    return ResolvedMotion(solution.trajectory, solution.cost, change)


def _reference(trajectory: Trajectory, cost: float) -> ReferenceMotion:
    robot = trajectory.robot
    assert robot is not None
    return ReferenceMotion(robot, trajectory.duration, trajectory.configurations, cost)
