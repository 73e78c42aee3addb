"""Newton's method for a problem with bounds from the solution of a nearby one.

At a solution every product z gap of a multiplier and a gap is mu. Where the problem changes, the
step of the primal-dual system predicts the change of the solution to first order, with the bounds
that hold it; the whole step is taken, whatever bounds it crosses. Then every bound is put back on
the central path by itself: z and gap become the pair with z gap = mu and with z - c gap as the step
predicts, which is the multiplier of a bound that holds the solution and the gap of one that does
not. This is a semismooth Newton method with a smoothed complementarity function, and, for mu -> 0,
one of active sets, which converges quadratically once the bounds that hold the solution are found.
[Kanzow1996; HintermuellerItoKunisch2002]

There is neither a merit function nor a shorter step: from a point that is too far it does not
converge, which a few steps show, and hovi.optimize.interior_point is needed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier
from hovi.optimize.criteria import ROOM, Criteria
from hovi.optimize.ended import Ended, Iteration, Reason
from hovi.optimize.observed import between_steps
from hovi.optimize.program import Program
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.start import Start

Array = npt.NDArray[np.float64]
X = TypeVar("X")

FIRST_MU, LARGEST_FIRST_MU = 0.3, 1e-3
"""First barrier parameter, relative to the square of how far outputs are outside their bounds and
to the mean density of the objective, and the largest one, relative to the density."""
DECREASE = 0.1
"""Ratio of the barrier parameters of two steps."""
GAP_WEIGHT = 3.0
"""Least weight c of a gap against a multiplier, relative to the mean density."""
LARGEST_GROWTH, LEAST_OUTSIDE = 4.0, 3e-4
"""Largest distance of outputs outside their bounds after a step, relative to their first distance
from the bounds or the known slacks; and the least value of that first distance. Beyond, the
iteration does not converge."""


def follow_bounded(
    objective: Program[X],
    start: Start[X, Barrier],
    criteria: Criteria,
    report: Callable[[int, float], None] | None = None,
) -> Ended[X, Barrier]:
    """Minimise from a point near the solution, whose slacks and multipliers are nearly known.

    It ends as DIVERGED where the steps do not converge, or not to a minimum.
    start.z: of the solution of a similar problem with as many outputs.
    criteria: `barrier` is the last barrier parameter; it ends where the next step predicts, and the
        distance of slacks from outputs means, less than `enough` of the objective. Outputs are
        not refined.
    """
    assert start.z is not None
    ended = Ended(start.x, objective.outputs(start.x), start.z, Reason.DIVERGED)
    if np.isfinite(ended.value):
        with ended.recorded_end(criteria.time_limit):
            _Newton(objective, ended, criteria, report).run()
    return ended


class _Newton(Generic[X]):
    """The main loop: whole Newton steps, each of which ends on the central path."""

    def __init__(
        self,
        objective: Program[X],
        ended: Ended[X, Barrier],
        criteria: Criteria,
        report: Callable[[int, float], None] | None,
    ) -> None:
        self.objective, self.ended = objective, ended
        self.criteria, self.report = criteria, report
        self.density = abs(ended.value) / objective.bounds.measure
        self.last_mu = criteria.barrier * self.density
        self.weight = GAP_WEIGHT * self.density
        self._begin(dataclasses.replace(ended.z, bounds=objective.bounds.shrunk(ROOM)))
        ended.keep_best(objective.bounds)

    def _begin(self, known: Barrier) -> None:
        """Begin with slacks and multipliers that are nearly those of the solution."""
        ended = self.ended
        outside = float(known.outside(ended.outputs.y).max(initial=0.0))
        apart = float(np.max(np.abs(ended.outputs.y - known.s), initial=0.0))
        self.farthest = LARGEST_GROWTH * max(outside, LEAST_OUTSIDE, apart)
        mu = min(FIRST_MU * outside**2, LARGEST_FIRST_MU) * self.density
        ended.z = known.recentered(self.weight, max(self.last_mu, mu))
        self.outside, self.work = 0.0, math.inf

    def run(self) -> None:
        """Iterate until stationary, or until it does not converge."""
        ended = self.ended
        while self.outside <= self.farthest:  # not where it is no number
            between_steps(self.objective, ended.x)
            terms = ended.z.condensed(ended.outputs.y)
            model = self.objective.model(ended.x, *terms)
            factor = model.factor(0.0)
            if factor is None:
                return
            step, slope, length = model.descend(factor)
            if self._is_solved(-0.5 * slope):
                if self._tightened():
                    continue
                ended.z = ended.z.at_outputs(self.objective.bounds, ended.outputs.y)
                ended.model, ended.why = model, Reason.STATIONARY
                ended.saved.append((ended.z.mu, ended.x))
                return
            if len(ended.steps) >= self.criteria.max_iterations:
                return
            self._take(step, -0.5 * slope, math.sqrt(max(length, 0.0)), model)

    def _tightened(self) -> bool:
        """Whether bounds changed for what the motion violates that outputs do not show."""
        ended, objective = self.ended, self.objective
        if not objective.tighten(ended.x, ended.z.mu / self.density):
            return False
        self._begin(ended.z.within(objective.bounds.shrunk(ROOM)))
        return True

    def _take(self, step: Array, decrease: float, norm: float, model: QuadraticModel) -> None:
        """Take a Newton step, which predicts a decrease."""
        ended, objective = self.ended, self.objective
        barrier, before = ended.z, ended.outputs
        dy = objective.push(step, model)
        x = objective.retract(ended.x, step, model)
        outputs = objective.outputs(x)
        objective.accept(step, model)
        mu = max(self.last_mu, DECREASE * barrier.mu)
        moved, self.outside, self.work = barrier.followed(before.y, dy, outputs.y, mu, self.weight)
        ended.x, ended.outputs, ended.z = x, outputs, moved
        ended.steps.append(Iteration(outputs.value, decrease, 1.0, 0.0, norm))
        if self.report is not None:
            self.report(len(ended.steps), outputs.value)
        ended.keep_best(objective.bounds)

    def _is_solved(self, decrease: float) -> bool:
        """Whether outputs are within their bounds, and next to nothing is to be gained.

        decrease: what the next step predicts.
        """
        ended = self.ended
        if len(ended.steps) == 0 or ended.z.mu > self.last_mu:
            return False
        enough = max(self.criteria.decrease, self.criteria.enough) * abs(ended.outputs.value)
        return self.outside <= ROOM and max(decrease, self.work) <= enough
