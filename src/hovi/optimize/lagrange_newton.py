"""Newton's method for minima under equations c = 0, with the multipliers y as unknowns.

A step s and the new multipliers solve the KKT equations [H + shift D, A^T; A, 0] of the Lagrangian
f + y.c, with the smallest shift for which its Hessian is positive definite on the tangent space of
the constraints. A fraction of the step is accepted by a filter: it decreases the residual |c| or
the objective f, and neither undoes what earlier steps gained. Near a minimum whole steps converge
quadratically. Where no fraction is accepted, the residual is made smaller alone.
[WaechterBiegler2006]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Outputs, Reason
from hovi.optimize.kkt_model import EqualityObjective, KktFactor, KktModel, size_of
from hovi.optimize.observed import between_steps
from hovi.optimize.restoration import restore
from hovi.optimize.start import Start

Array = npt.NDArray[np.float64]
X = TypeVar("X")

FIRST_SHIFT = 1e-5
"""The first shift, relative to the curvature."""
SHIFT_DECREASE = 1.0 / 3.0
"""Factor from the last shift to the first one that is tried."""
SHIFT_GROWTH = 4.0
"""Factor from a shift that is too small to the next one."""
MAX_SHIFTS = 40
"""Number of shifts after which the model counts as not finite."""
LEAST_FRACTION = 1e-9
"""Smallest fraction of a step that is tried."""
MAX_SECOND_ORDER_CORRECTIONS = 2
"""Corrections of a step by the residual where it leads."""
CORRECTED_RATIO = 0.99
"""Ratio of the residuals after successive second-order corrections from which these end."""
LARGEST_RESIDUAL, SMALL_RESIDUAL = 1e4, 1e-4
"""Largest residual of a point that is accepted, and the residual up to which the objective alone
may decide; relative to the first one, or to 1 if that is larger."""
FILTER_MARGIN = 1e-5
"""Decrease of the residual that a step needs, relative to it."""
VALUE_MARGIN = 1e-8
"""Decrease of the objective that a step needs, relative to the residual."""
ARMIJO = 1e-4
"""Decrease of the objective that a step needs, relative to its slope, where |c| is small."""
LARGE_SLOPE = 1e100
"""Slope above which larger ones make no difference."""
ROUNDING = 1e-13
"""Relative rounding error of the objective."""
MAX_RESTORATIONS = 4
"""Maximum number of times that the residual is made smaller alone."""
LAST_RATIO = 0.1
"""Ratio of the relative decreases of successive Newton steps above which the second one is the
last: only rounding errors remain."""
LAST_DECREASE = 1e-12
"""Relative decrease in a Newton step after which only rounding errors remain."""
REMAINING_DECREASE = 1e-26
"""Estimated relative decrease that may remain after the last step."""


def minimize_under_equations(
    objective: EqualityObjective[X],
    start: Start[X, Array],
    criteria: Criteria,
    report: Callable[[int, float], None] | None = None,
) -> Ended[X, Array]:
    """Minimise f under c = 0 from a point; a KeyboardInterrupt ends it with the last point.

    It ends as INFEASIBLE where |c| has a minimum that is not zero.
    start.z: multipliers at a nearby minimum; zero when None.
    """
    outputs = objective.evaluate(start.x)
    z = np.zeros_like(outputs.y) if start.z is None else start.z
    ended = Ended(start.x, outputs, z)
    with ended.recorded_end(criteria.time_limit):
        _Search(objective, ended, criteria, report).run()
    return ended


class _Trial(NamedTuple):
    """An accepted step: where it leads, f and c there, its fraction, and whether f decides."""

    x: object
    outputs: Outputs
    fraction: float
    by_value: bool


class _Filter:
    """Pairs (f, |c|), of which no later point may be worse in both."""

    def __init__(self) -> None:
        self.entries: list[tuple[float, float]] = []

    def accepts(self, value: float, residual: float) -> bool:
        """Whether a point is better than every entry in one of the two."""
        return all(value < f or residual < c for f, c in self.entries)

    def add(self, value: float, residual: float) -> None:
        """Add a point, with its margins."""
        margins = value - VALUE_MARGIN * residual, (1.0 - FILTER_MARGIN) * residual
        self.entries.append(margins)


class _Search(Generic[X]):
    """The iteration; `ended` has its current point and multipliers."""

    def __init__(
        self,
        objective: EqualityObjective[X],
        ended: Ended[X, Array],
        criteria: Criteria,
        report: Callable[[int, float], None] | None,
    ) -> None:
        self.objective = objective
        self.ended = ended
        self.size = size_of(ended.outputs.y)
        self.criteria = criteria
        self.report = report
        first = max(1.0, self.size)
        self.largest, self.small = LARGEST_RESIDUAL * first, SMALL_RESIDUAL * first
        self.filter = _Filter()
        self.shift = 0.0
        self.restorations = 0
        self.before = math.inf

    def run(self) -> None:
        """Steps until one of the reasons to end."""
        if not (math.isfinite(self.ended.value) and np.isfinite(self.ended.outputs.y).all()):
            raise ArithmeticError("the problem is not defined at the first point")
        while len(self.ended.steps) < self.criteria.max_iterations:
            between_steps(self.objective, self.ended.x)
            model = self.objective.model(self.ended.x, self.ended.z)
            factor, shift = self._factor(model)
            if factor is not None and self._step(model, factor, shift):
                return
            if factor is None and not self._restore():
                return

    def _factor(self, model: KktModel) -> tuple[KktFactor | None, float]:
        """The factor with the smallest shift that is definite on A s = 0; None for none."""
        factor = model.factor(0.0)
        if factor is not None:
            return factor, 0.0
        known = self.shift > 0.0
        shift = SHIFT_DECREASE * self.shift if known else FIRST_SHIFT * model.curvature_scale
        for _ in range(MAX_SHIFTS):
            factor = model.factor(shift)
            if factor is not None:
                self.shift = shift
                return factor, shift
            shift *= SHIFT_GROWTH if known else SHIFT_GROWTH**2
        return None, 0.0

    def _step(self, model: KktModel, factor: KktFactor, shift: float) -> bool:
        """Take a step; whether the iteration ends."""
        ended, c = self.ended, self.ended.outputs.y
        step, change = factor.solve(-model.gradient, -c)
        if not np.isfinite(step).all():
            return not self._restore()
        curvature = abs(model.curvature(step))
        new = ended.z + change
        decrease = 0.5 * curvature + abs(float(new @ c))
        relative = decrease / max(abs(ended.value), self.objective.negligible, 1e-300)
        small = relative <= self.criteria.decrease or self._is_short(model, step)
        settled = small and self.objective.feasible(ended.x)
        if settled and shift > 0.0:  # perhaps a saddle
            ended.why = Reason.STATIONARY
            return True
        trial = self._last(model, step) if settled else None
        trial = trial or self._search_along(model, factor, step)
        value, fraction = (
            (ended.value, 0.0) if trial is None else (trial.outputs.value, trial.fraction)
        )
        length, residual = model.length(step), self.size
        ended.steps.append(Iteration(value, decrease, fraction, shift, length, residual))
        if self.report is not None:
            self.report(len(ended.steps), value)
        if trial is None:
            return self._at_minimum() if settled else not self._restore()
        if not trial.by_value:
            self.filter.add(ended.value, self.size)
        self._move(trial)
        ended.z = ended.z + trial.fraction * change
        last = settled and (self._is_last(relative) or self._is_short(model, step))
        self.before = relative if shift == 0.0 and trial.fraction == 1.0 else math.inf
        return last and self._at_minimum()

    def _is_short(self, model: KktModel, step: Array) -> bool:
        """Whether a step is rounding errors, relative to the data; also where nothing is unknown.

        Decreases are compared with the objective, which may be zero.
        """
        if not step.size:
            return True
        return self.objective.relative_size(self.ended.x, step, model) <= self.criteria.step

    def _is_last(self, decrease: float) -> bool:
        """Whether only rounding errors remain after a Newton step of this relative decrease."""
        if decrease <= LAST_DECREASE or decrease > LAST_RATIO * self.before:
            return True
        return decrease * (decrease / self.before) ** 2 <= REMAINING_DECREASE

    def _at_minimum(self) -> bool:
        """End in a minimum."""
        self.ended.why, self.ended.convex = Reason.STATIONARY, True
        return True

    def _move(self, trial: _Trial) -> None:
        self.ended.x = trial.x  # type: ignore[assignment]
        self.ended.outputs = trial.outputs
        self.size = size_of(trial.outputs.y)

    def _last(self, model: KktModel, step: Array) -> _Trial | None:
        """The whole step from a stationary point, if only rounding errors change by it."""
        x = self.objective.retract(self.ended.x, step, model)
        there, now = self.objective.evaluate(x), self.ended.value
        same = there.value <= now + ROUNDING * abs(now) and self.objective.feasible(x)
        return _Trial(x, there, 1.0, True) if same else None

    def _search_along(self, model: KktModel, factor: KktFactor, step: Array) -> _Trial | None:
        """The largest fraction of a step, halved again and again, that the filter accepts."""
        ended = self.ended
        slope = float(model.slope @ step)
        fraction = 1.0
        while fraction >= LEAST_FRACTION:
            x = self.objective.retract(ended.x, fraction * step, model)
            there = self.objective.evaluate(x)
            size = size_of(there.y)
            accepted = self._accepted(there.value, size, fraction, slope)
            if accepted is not None:
                return _Trial(x, there, fraction, accepted)
            if fraction == 1.0 and size >= 0.5 * self.size and math.isfinite(size):
                corrected = self._corrected(model, factor, there.y, slope)
                if corrected is not None:
                    return corrected
            fraction *= 0.5
        return None

    def _accepted(self, value: float, size: float, fraction: float, slope: float) -> bool | None:
        """Whether a point is accepted for its value; None if it is not accepted at all."""
        if not math.isfinite(value) or not size <= self.largest:
            return None
        if not self.filter.accepts(value, size):
            return None
        now, before = self.ended.value, self.size
        noise = ROUNDING * abs(now)
        if (
            before <= self.small
            and slope < 0.0
            and fraction * min(-slope, LARGE_SLOPE) ** 2.3 > before**1.1
        ):
            return True if value <= now + ARMIJO * fraction * slope + noise else None
        smaller = size <= (1.0 - FILTER_MARGIN) * before or value <= now - VALUE_MARGIN * before
        return False if smaller else None

    def _corrected(
        self, model: KktModel, factor: KktFactor, residual: Array, slope: float
    ) -> _Trial | None:
        """The whole step with second-order corrections, if it is accepted."""
        ended, total = self.ended, self.ended.outputs.y
        size = size_of(residual)
        for _ in range(MAX_SECOND_ORDER_CORRECTIONS):
            total = total + residual
            step, _ = factor.solve(-model.gradient, -total)
            x = self.objective.retract(ended.x, step, model)
            there = self.objective.evaluate(x)
            residual = there.y
            before, size = size, size_of(residual)
            accepted = self._accepted(there.value, size, 1.0, slope)
            if accepted is not None:
                return _Trial(x, there, 1.0, accepted)
            if not size < CORRECTED_RATIO * before:
                break
        return None

    def _restore(self) -> bool:
        """Make the residual alone smaller, and begin again there; whether that succeeded."""
        ended, left = self.ended, self.criteria.max_iterations - len(self.ended.steps)
        self.restorations += 1
        ended.why = Reason.DIVERGED
        if self.restorations > MAX_RESTORATIONS:
            return False
        found = restore(self.objective, Start(ended.x), Criteria(max_iterations=left))
        ended.x, ended.outputs, ended.steps = found.x, found.outputs, ended.steps + found.steps
        self.size = size_of(found.outputs.y)
        if found.why is Reason.INFEASIBLE:
            ended.why = found.why
            return False
        ended.z, ended.why = found.z, Reason.ITERATION_LIMIT
        self.filter, self.shift, self.before = _Filter(), 0.0, math.inf
        return True
