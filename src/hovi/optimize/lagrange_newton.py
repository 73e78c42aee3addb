"""Newton's method for minima under equations c = 0, with the multipliers y as unknowns.

A step s and the new multipliers solve the KKT equations [H + shift D, A^T; A, 0] of the Lagrangian
f + y.c, with the smallest shift for which its Hessian is positive definite on the tangent space of
the constraints. A share of the step is accepted by a filter: it decreases the residual |c| or the
objective f, and neither undoes what earlier steps gained. Near a minimum whole steps converge
quadratically. Where no share is accepted, the residual is made smaller alone.
[WaechterBiegler2006]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.constrained_model import ConstrainedModel, EqualityObjective, size_of
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Iteration, Reason
from hovi.optimize.quadratic_model import Factor
from hovi.optimize.restoration import restore
from hovi.optimize.trust_region import Outcome
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError, raise_if_late
from hovi.system.interruption import raise_if_interrupted, record_interrupt

Array = npt.NDArray[np.float64]
X = TypeVar("X")

PENALTY_GROWTH = 10.0
"""Factor to the next penalty, where the largest one makes the Hessian definite."""
MAX_PENALTY_RATIO = 1e3
"""Maximum penalty, relative to the initial one."""
FIRST_SHIFT = 1e-5
"""The first shift, relative to the curvature."""
SHIFT_DECREASE = 1.0 / 3.0
"""Factor from the last shift to the first one that is tried."""
SHIFT_GROWTH = 4.0
"""Factor from a shift that is too small to the next one."""
MAX_SHIFTS = 40
"""Number of shifts after which the model counts as not finite."""
LEAST_SHARE = 1e-9
"""Smallest share of a step that is tried."""
MAX_SECOND_ORDER_CORRECTIONS = 2
"""Corrections of a step by the residual where it leads."""
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
FIRST_ACCURACY, LEAST_ACCURACY = 1e-2, 1e-10
"""Accuracy of linearised equations: far from a minimum, and at most; between them the squared
relative decrease of the last Newton step, so that the last steps converge quadratically."""
EXACT_DECREASE = 1e-2
"""Relative decrease of a step after which models are exact."""
MAX_RESTORATIONS = 4
"""How often the residual is made smaller alone."""
LAST_DECREASE = 1e-12
"""Relative decrease in a Newton step after which only rounding errors remain."""
REMAINING_DECREASE = 1e-26
"""Estimated relative decrease that may remain after the last step."""


@dataclass()
class ConstrainedOutcome(Outcome[X]):
    """The final point with its multipliers.

    penalty: with which a minimum has a positive definite Hessian. stuck: whether |c| has a minimum
    there that is not zero, so that the equations cannot be met nearby.
    """

    multipliers: Array = field(default_factory=lambda: np.zeros(0))
    penalty: float = 1.0
    stuck: bool = False


def minimize_under_equations(
    objective: EqualityObjective[X],
    x: X,
    penalty: float,
    criteria: Criteria,
    multipliers: Array | None = None,
    report: Callable[[int, float], None] | None = None,
) -> ConstrainedOutcome[X]:
    """Minimise f under c = 0 from x; a KeyboardInterrupt ends it with the last point.

    penalty: the first one, by which A^T A is to exceed the negative curvature across c = 0.
    multipliers: at a nearby minimum; zero when None.
    """
    value, residual = objective.evaluate(x)
    start = np.zeros_like(residual) if multipliers is None else multipliers
    first = x, value, Reason.ITERATION_LIMIT, 0
    outcome = ConstrainedOutcome(*first, multipliers=start, penalty=penalty)
    if not math.isfinite(value) or not np.isfinite(residual).all():
        outcome.why = Reason.DIVERGED
        return outcome
    try:
        with Deadline(criteria.time_limit).in_force():
            _Search(objective, outcome, residual, criteria, report).run()
    except OutOfTimeError:
        outcome.why = Reason.TIME_LIMIT
    except KeyboardInterrupt:
        record_interrupt()
        outcome.why = Reason.INTERRUPTED
    except (ArithmeticError, np.linalg.LinAlgError):
        outcome.why = Reason.DIVERGED
    return outcome


class _Trial(NamedTuple):
    """An accepted step: where it leads, f and c there, its share, and whether f decides."""

    x: object
    value: float
    residual: Array
    share: float
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
    """The iteration; the outcome holds its point and multipliers."""

    def __init__(
        self,
        objective: EqualityObjective[X],
        outcome: ConstrainedOutcome[X],
        residual: Array,
        criteria: Criteria,
        report: Callable[[int, float], None] | None,
    ) -> None:
        self.objective = objective
        self.outcome = outcome
        self.residual = residual
        self.size = size_of(residual)
        self.criteria = criteria
        self.report = report
        self.max_penalty = MAX_PENALTY_RATIO * outcome.penalty
        first = max(1.0, self.size)
        self.largest, self.small = 1e4 * first, 1e-4 * first
        self.filter = _Filter()
        self.shift = 0.0
        self.restorations = 0
        self.before = self.decrease = math.inf
        self.exact = False

    def run(self) -> None:
        """Steps until a stop."""
        while self.outcome.iterations < self.criteria.max_iterations:
            raise_if_interrupted()
            raise_if_late()
            self.exact = self.decrease <= EXACT_DECREASE
            model = self.objective.model(self.outcome.x, self.outcome.multipliers, self.exact)
            factor, shift = self._factor(model)
            if factor is not None and self._step(model, factor, shift):
                return
            if factor is None and not self._restore():
                return

    def _factor(self, model: ConstrainedModel) -> tuple[Factor | None, float]:
        """The factor of a definite K with the smallest shift; None where there is none."""
        outcome = self.outcome
        factor = model.factor(outcome.penalty, 0.0)
        if factor is None and model.factor(self.max_penalty, 0.0) is not None:
            while factor is None and outcome.penalty < self.max_penalty:
                outcome.penalty = min(PENALTY_GROWTH * outcome.penalty, self.max_penalty)
                factor = model.factor(outcome.penalty, 0.0)
        if factor is not None:
            return factor, 0.0
        known = self.shift > 0.0
        shift = SHIFT_DECREASE * self.shift if known else FIRST_SHIFT * model.curvature_scale
        for _ in range(MAX_SHIFTS):
            factor = model.factor(outcome.penalty, shift)
            if factor is not None:
                self.shift = shift
                return factor, shift
            shift *= SHIFT_GROWTH if known else SHIFT_GROWTH**2
        return None, 0.0

    def _step(self, model: ConstrainedModel, factor: Factor, shift: float) -> bool:
        """Take a step; whether the iteration ends."""
        outcome, c = self.outcome, self.residual
        accuracy = min(max(min(self.before, 1.0) ** 2, LEAST_ACCURACY), FIRST_ACCURACY)
        step, change = model.solve(factor, outcome.penalty, c, accuracy)
        if not np.isfinite(step).all():
            return not self._restore()
        curvature = abs(float(step @ model.hessian_product(step)))
        new = outcome.multipliers + change
        decrease = 0.5 * curvature + abs(float(new @ c))
        relative = decrease / max(abs(outcome.value), 1e-300)
        self.decrease = relative
        settled = self.exact and relative <= self.criteria.decrease
        settled = settled and self.objective.feasible(outcome.x)
        if settled and shift > 0.0:
            return self._at_saddle(model, factor, shift)
        trial = self._search_along(model, factor, step)
        outcome.iterations += 1
        value, share = (outcome.value, 0.0) if trial is None else (trial.value, trial.share)
        length, residual = model.length(step), self.size
        outcome.history.append(Iteration(value, decrease, share, shift, length, residual))
        if self.report is not None:
            self.report(outcome.iterations, value)
        if trial is None:
            return self._ended(outcome.x) if settled else not self._restore()
        if not trial.by_value:
            self.filter.add(outcome.value, self.size)
        self._move(trial)
        outcome.multipliers = outcome.multipliers + trial.share * change
        last = settled and self._is_last(relative)
        self.before = relative if shift == 0.0 and trial.share == 1.0 else math.inf
        return last and self._ended(outcome.x)

    def _is_last(self, decrease: float) -> bool:
        """Whether only rounding errors remain after a Newton step of this relative decrease."""
        if decrease <= LAST_DECREASE or decrease > 0.1 * self.before:
            return True
        return decrease * (decrease / self.before) ** 2 <= REMAINING_DECREASE

    def _ended(self, x: X) -> bool:
        """End in a minimum."""
        self.outcome.why, self.outcome.convex = Reason.STATIONARY, True
        return True

    def _move(self, trial: _Trial) -> None:
        self.outcome.x = trial.x  # type: ignore[assignment]
        self.outcome.value, self.residual = trial.value, trial.residual
        self.size = size_of(trial.residual)

    def _search_along(self, model: ConstrainedModel, factor: Factor, step: Array) -> _Trial | None:
        """The largest share of a step, halved again and again, that the filter accepts."""
        outcome = self.outcome
        slope = float(model.slope @ step)
        share = 1.0
        while share >= LEAST_SHARE:
            x = self.objective.retract(outcome.x, share * step, model)
            value, residual = self.objective.evaluate(x)
            size = size_of(residual)
            accepted = self._accepted(value, size, share, slope)
            if accepted is not None:
                return _Trial(x, value, residual, share, accepted)
            if share == 1.0 and size >= 0.5 * self.size and math.isfinite(size):
                corrected = self._corrected(model, factor, residual, slope)
                if corrected is not None:
                    return corrected
            share *= 0.5
        return None

    def _accepted(self, value: float, size: float, share: float, slope: float) -> bool | None:
        """Whether a point is accepted for its value; None if it is not accepted at all."""
        if not math.isfinite(value) or not size <= self.largest:
            return None
        if not self.filter.accepts(value, size):
            return None
        now, before = self.outcome.value, self.size
        noise = ROUNDING * abs(now)
        if (
            before <= self.small
            and slope < 0.0
            and share * min(-slope, LARGE_SLOPE) ** 2.3 > before**1.1
        ):
            return True if value <= now + ARMIJO * share * slope + noise else None
        smaller = size <= (1.0 - FILTER_MARGIN) * before or value <= now - VALUE_MARGIN * before
        return False if smaller else None

    def _corrected(
        self, model: ConstrainedModel, factor: Factor, residual: Array, slope: float
    ) -> _Trial | None:
        """The whole step with second-order corrections, if it is accepted."""
        outcome, total = self.outcome, self.residual
        size = size_of(residual)
        for _ in range(MAX_SECOND_ORDER_CORRECTIONS):
            total = total + residual
            step, _ = model.solve(factor, outcome.penalty, total, FIRST_ACCURACY)
            x = self.objective.retract(outcome.x, step, model)
            value, residual = self.objective.evaluate(x)
            before, size = size, size_of(residual)
            accepted = self._accepted(value, size, 1.0, slope)
            if accepted is not None:
                return _Trial(x, value, residual, 1.0, accepted)
            if not size < 0.99 * before:
                break
        return None

    def _restore(self) -> bool:
        """Make the residual alone smaller, and begin again there; whether that succeeded."""
        outcome, left = self.outcome, self.criteria.max_iterations - self.outcome.iterations
        self.restorations += 1
        outcome.why = Reason.DIVERGED
        if self.restorations > MAX_RESTORATIONS:
            return False
        found = restore(self.objective, outcome.x, left)
        outcome.x, outcome.value, self.residual = found.x, found.value, found.residual
        self.size = size_of(found.residual)
        for size, step in zip(found.residuals, found.lengths, strict=True):
            outcome.history.append(Iteration(found.value, 0.0, 1.0, 0.0, step, size))
        outcome.iterations += len(found.residuals)
        outcome.stuck = found.stuck
        if found.stuck:
            return False
        outcome.multipliers = found.multipliers
        self.filter, self.shift, self.before = _Filter(), 0.0, math.inf
        outcome.why = Reason.ITERATION_LIMIT
        return True

    def _at_saddle(self, model: ConstrainedModel, factor: Factor, shift: float) -> bool:
        """Leave a saddle along negative curvature; whether the iteration ends instead."""
        outcome = self.outcome
        outcome.why = Reason.STATIONARY
        along = self._lowest(model, factor)
        curvature = float(along @ model.hessian_product(along))
        if not self.criteria.escape_saddles or curvature >= 0.0:
            return True
        trial = self._along_curvature(model, factor, along, curvature)
        if trial is None:
            return True
        outcome.saddles_left.append(outcome.value)
        outcome.iterations += 1
        decrease = outcome.value - trial.value
        radius = trial.share
        outcome.history.append(Iteration(trial.value, decrease, 1.0, shift, radius, self.size))
        self._move(trial)
        self.filter, self.before = _Filter(), math.inf
        outcome.why = Reason.ITERATION_LIMIT
        return False

    def _lowest(self, model: ConstrainedModel, factor: Factor) -> Array:
        """The tangent direction of lowest curvature relative to D, by inverse iteration."""
        none, penalty = np.zeros_like(self.residual), self.outcome.penalty
        u = model.plain.random_vector(seed=0)
        for _ in range(4):
            force = model.plain.metric_product(u)
            u, _ = model.solve_for(force, factor, penalty, none, 1e-4)
            u = u / model.length(u)
        return u if float(model.gradient @ u) <= 0.0 else -u

    def _along_curvature(
        self, model: ConstrainedModel, factor: Factor, along: Array, curvature: float
    ) -> _Trial | None:
        """A point on c = 0 with a smaller value, along a direction of negative curvature."""
        outcome, length = self.outcome, self.criteria.radius
        none = np.zeros_like(model.gradient)
        weight = 2.0 * float(np.linalg.norm(outcome.multipliers))
        while length > LEAST_SHARE * self.criteria.radius:
            step = length * along
            x = self.objective.retract(outcome.x, step, model)
            value, residual = self.objective.evaluate(x)
            if np.isfinite(residual).all():
                back, _ = model.solve_for(none, factor, outcome.penalty, residual, 1e-4)
                x = self.objective.retract(outcome.x, step + back, model)
                value, residual = self.objective.evaluate(x)
                merit = value + weight * size_of(residual)
                if merit < outcome.value + 0.25 * length**2 * curvature:
                    return _Trial(x, value, residual, length, True)
            length *= 0.5
        return None
