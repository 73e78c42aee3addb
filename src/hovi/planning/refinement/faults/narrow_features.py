"""Features of effects that are narrower than the points of a grid: pulses, steps, thin walls."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.discrete.cells import INSTANTS
from hovi.discrete.curve_integral import integral_along
from hovi.discrete.grid import Grid
from hovi.planning.problem.tolerance import CURVE_TOLERANCE
from hovi.planning.refinement.error_estimate import with_estimate
from hovi.planning.refinement.faults.along_motion import (
    AlongMotion,
    along_motion,
    may_be_narrow,
)
from hovi.planning.refinement.faults.on_curve import (
    RESOLVED,
    costs_nothing,
    has_own_curve,
)
from hovi.planning.solver.solver import Solution
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

ESTIMATE_FRACTION = 0.05
"""Error that the integral along the curve may have, relative to the estimate of the cost's."""
LEAST_ERROR = 1e-8
"""Least error that the integral along the curve may have, relative to the cost."""
NARROW = "narrow features"
"""What the reasons of faults name."""


@dataclass(frozen=True, eq=False)
class Features:
    """The cost of a motion with all narrow features of its effects.

    along: its integral. by_interval: the cost at the points of each interval, (N,). size: absolute
    value of the cost, which errors are relative to. error: of the cost at the points, and what the
    integral may miss. allowed: largest one of a success, with room for what that may miss.
    """

    along: AlongMotion
    by_interval: Array
    size: float
    error: float
    allowed: float

    @property
    def fault(self) -> str:
        """What the points miss, a clause; "" if nothing."""
        if self.error <= self.allowed:
            return ""
        missed = f"its cost is {self.by_interval.sum():.6g} at the quadrature points, but"
        if self.along.fault:
            return f"{missed} {self.along.fault}, which are {NARROW} that no points resolve"
        return (
            f"{missed} {self.along.cost:.6g} along its own curve with all {NARROW} of the effects"
        )

    def seen_by(self, grid: Grid) -> Grid:
        """The motion's grid with nodes where its points miss something."""
        cells, N = self.along.cells, grid.intervals
        missed = np.abs(self.along.by_interval - self.by_interval)
        here = missed > self.allowed * self.size / N
        begin = grid.t[cells.interval] + cells.begin * grid.steps[cells.interval]
        inside = begin[here[cells.interval] & (cells.begin > 0)]
        return grid.split_at(np.sort(np.concatenate([grid.t, inside])))

    @property
    def note(self) -> str:
        """What was looked at by samples alone, a sentence; "" if nothing."""
        if not self.along.sampled:
            return ""
        names = " and ".join(self.along.sampled)
        return (
            f"Between {INSTANTS:,} instants {names} has no bounds: narrower features may be missed."
        )


def features_of(solution: Solution) -> Features | None:
    """What narrow features add to the cost; None if no effect of the scene can have any."""
    problem, estimate = solution.problem, solution.error_estimate or CURVE_TOLERANCE
    chosen = solution.accuracy
    assert problem is not None
    lagrangian, motion = problem.ld.lagrangian, solution.trajectory
    if not may_be_narrow(lagrangian) or costs_nothing(solution):
        return None
    values = problem.ld.values(motion.path)
    size = max(abs(solution.cost), problem.negligible_cost, 1e-300)
    along = along_motion(lagrangian, motion, size, max(ESTIMATE_FRACTION * estimate, LEAST_ERROR))
    if has_own_curve(problem):
        missed = abs(along.cost - float(values.sum()))
    else:
        missed = abs(along.cost - integral_along(lagrangian, motion).value)
    error = (missed + along.error) / size
    least = RESOLVED if chosen is None else CURVE_TOLERANCE
    allowed = (1.0 + 2.0 * ESTIMATE_FRACTION) * max(min(estimate, RESOLVED), least)
    return Features(along, values, size, float(np.nan_to_num(error, nan=np.inf)), allowed)


def with_features(solution: Solution) -> tuple[Solution, str]:
    """The solution with an estimate that covers narrow features, and what hides them, or ""."""
    features = features_of(solution)
    if features is None:
        return solution, ""
    known = solution.error_estimate
    if known is not None and features.error > known:
        solution = with_estimate(solution, features.error)
    message = " ".join(filter(None, (solution.message, features.note)))
    return dataclasses.replace(solution, message=message), features.fault
