"""A trust-region method whose subproblems are solved by factorisations of H + shift D.

It handles indefinite Hessians, leaves saddles along directions of negative curvature, and stops
on relative quantities: the predicted decrease of a Newton step relative to the cost, or its size
relative to the data. [ConnGouldToint2000, chapter 7; MoreSorensen1983]
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.chord_steps import REMAINING_DECREASE, polish
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Outputs, Reason
from hovi.optimize.observed import between_steps
from hovi.optimize.quadratic_model import (
    ACCEPTED_RATIO,
    Factor,
    QuadraticModel,
    decrease_ratio,
    next_radius,
    next_shift,
)
from hovi.optimize.start import Start

Array = npt.NDArray[np.float64]
X = TypeVar("X")

MAX_FACTORIZATIONS = 30
"""Maximum number of factorisations per subproblem."""
EXACT_MODEL_DECREASE = 1e-5
"""Relative decrease of a Newton step below which models are exact, if Criteria.exact."""
SIZE_TEST_LENGTH = 1e-4
"""Step length, relative to the first radius, up to which the relative size is evaluated."""
LAST_DECREASE = 1e-14
"""Relative predicted decrease below which an exact Newton step is the last in any case."""
LEAST_SHIFT = 1e-9
"""Shift, relative to the curvature, with which a short step is taken for a longer Newton step."""
SINGULAR = 1e-13
"""Negative curvature, relative to the largest, that is one of rounding errors."""
STALLED_STEPS = 5
"""Number of steps that Criteria.stalled compares."""
ROUNDING = 1e-14
"""Change of the objective that is rounding, relative to its value."""
LEAST_RADIUS = 1e-14
"""Radius below which a solve ends as diverged, relative to the first one."""
FAILED_GROWTH, LONG_GROWTH = 4.0, 10.0
"""Ratio of successive shifts without an upper end: after a factorisation that failed, and after a
step that is too long."""
NEAR_SHIFT, FAR_SHIFT, LONG_SHIFT = 1e-5, 0.03, 1e-6
"""Least next shift without an upper end, relative to the curvature: after a factorisation that
failed in a search that began with a shift, in another one, and after a step that is too long."""
FAILED_PART, STEP_PART = 0.1, 1e-3
"""Least next shift between two ends, relative to the upper one: after a factorisation that failed,
and after a step."""
SHORTEST, LONGEST = 0.75, 1.25
"""Lengths of a step, relative to the radius, between which it fits."""
HARD_WIDTH = 0.2
"""Width of the bracket of the shift, relative to the shift, at which a short step is extended."""
ALONE = 1e-6
"""Length of a short step, relative to the radius, below which only its extension counts."""


NO_OUTPUTS: Array = np.zeros(0)
"""What is constrained where nothing is."""


class Objective(ABC, Generic[X]):
    """An objective to minimise on a manifold: value, quadratic model, retraction and norm."""

    @property
    def negligible(self) -> float:
        """Value that counts as none: decreases are relative to no smaller one."""
        return 0.0

    @abstractmethod
    def value(self, x: X) -> float:
        """The objective at x; not finite where it is not defined."""

    @abstractmethod
    def model(self, x: X, previous: QuadraticModel | None, step: Array | None) -> QuadraticModel:
        """The quadratic model at x: exact if `previous` is None, otherwise perhaps an update.

        previous: the model at the last point, from which `step` led to x.
        """

    def gradient(self, x: X, model: QuadraticModel) -> Array | None:
        """The gradient at x in the unknowns of a model elsewhere; None without gradients."""
        return None

    @abstractmethod
    def retract(self, x: X, step: Array, model: QuadraticModel) -> X:
        """The point that a step of a model leads to."""

    @abstractmethod
    def relative_size(self, x: X, step: Array, model: QuadraticModel) -> float:
        """The largest component of a step relative to the size of the data."""


class Trial(NamedTuple):
    """A solution of the subproblem min g.s + 1/2 s.H s, |s| <= radius.

    decrease: predicted by the model. shift: multiplier of the radius; 0 for a Newton step.
    norm: |s| in the metric. along_negative_curvature: whether the step is a direction of negative
        curvature alone, since the gradient is negligible.
    """

    step: Array
    decrease: float
    shift: float
    norm: float
    factor: Factor
    along_negative_curvature: bool = False

    @property
    def newton(self) -> bool:
        """Whether this is an unconstrained Newton step of a convex model."""
        return self.shift == 0.0


def minimize(
    objective: Objective[X],
    start: Start[X, None],
    criteria: Criteria,
    report: Callable[[int, float], None] | None = None,
) -> Ended[X, None]:
    """Minimise from a point; a KeyboardInterrupt ends it with the best point so far."""
    ended = Ended(start.x, _values(objective.value(start.x)), None)
    with ended.recorded_end(criteria.time_limit):
        _iterate(objective, ended, criteria, report)
    return ended


def _values(value: float) -> Outputs:
    """The value of an objective without constraints."""
    return Outputs(value, NO_OUTPUTS)


def _iterate(
    objective: Objective[X],
    ended: Ended[X, None],
    criteria: Criteria,
    report: Callable[[int, float], None] | None,
) -> None:
    if not math.isfinite(ended.value):
        raise ArithmeticError("the objective is not defined at the first point")
    between_steps(objective, ended.x)
    radius, shift = criteria.radius, 0.0
    values = deque([ended.value], STALLED_STEPS + 1)
    model, exact, before = objective.model(ended.x, None, None), True, math.inf
    while len(ended.steps) < criteria.max_iterations:
        between_steps(objective, ended.x)
        trial = solve_subproblem(model, radius, shift)
        stationary = _is_stationary(objective, ended, model, trial, criteria)
        if stationary and trial.along_negative_curvature and not criteria.escape_saddles:
            ended.why = Reason.STATIONARY
            return
        settled = stationary and trial.newton
        last = settled and _is_last(ended, trial, exact, before, criteria)
        candidate = objective.retract(ended.x, trial.step, model)
        value = objective.value(candidate)
        noise = ROUNDING * abs(ended.value)
        ratio = decrease_ratio(ended.value - value, trial.decrease, noise)
        ended.steps.append(Iteration(value, trial.decrease, ratio, trial.shift, radius))
        if report is not None:
            report(len(ended.steps), min(value, ended.value))
        radius = next_radius(radius, trial.norm, ratio)
        accepted = ratio > ACCEPTED_RATIO
        if accepted:
            if trial.along_negative_curvature and stationary:
                ended.saddles.append(ended.value)
            ended.x, ended.outputs = candidate, _values(value)
        if settled and accepted and exact and not last:
            polished = polish(objective, candidate, value, model, trial.factor, trial.decrease)
            if polished is not None:
                last, ended.x, ended.outputs = True, polished[0], _values(polished[1])
        if last or (settled and not accepted):
            ended.why, ended.convex, ended.model = Reason.STATIONARY, exact, model
            return
        values.append(ended.value)
        gained, enough = values[0] - values[-1], criteria.stalled * abs(values[0])
        if len(values) > STALLED_STEPS and gained < enough and enough > 0.0:
            ended.why = Reason.STALLED
            return
        shift = next_shift(trial.shift, trial.norm, radius)
        if accepted:
            before = trial.decrease if trial.newton else math.inf
            exact = criteria.exact and (settled or before <= EXACT_MODEL_DECREASE * abs(value))
            known = (None, None) if exact else (model, trial.step)
            model = objective.model(ended.x, *known)
        elif radius < LEAST_RADIUS * criteria.radius:
            ended.why = Reason.DIVERGED
            return


def _is_stationary(
    objective: Objective[X],
    ended: Ended[X, None],
    model: QuadraticModel,
    trial: Trial,
    criteria: Criteria,
) -> bool:
    """Whether the gradient is zero to working precision; says nothing about the curvature."""
    if trial.along_negative_curvature:
        return True
    if not trial.newton:
        return False
    if trial.decrease <= criteria.decrease * max(abs(ended.value), objective.negligible):
        return True
    short = trial.norm <= SIZE_TEST_LENGTH * criteria.radius
    return short and objective.relative_size(ended.x, trial.step, model) <= criteria.step


def _is_last(
    ended: Ended[X, None], trial: Trial, exact: bool, before: float, criteria: Criteria
) -> bool:
    """Whether the Newton step from a stationary point is accurate enough to be the last one.

    The decrease that remains after it is decrease^3 / before^2 by quadratic convergence. See
    Criteria.exact.
    exact: whether the model is exact. before: predicted decrease of the previous step, infinite
        if that was not a Newton step.
    """
    size, decrease = abs(ended.value), trial.decrease
    if not criteria.exact or not exact:
        return not criteria.exact
    if decrease <= LAST_DECREASE * size or decrease > criteria.decrease * size:
        return True
    return before < math.inf and decrease * (decrease / before) ** 2 <= REMAINING_DECREASE * size


def solve_subproblem(model: QuadraticModel, radius: float, guess: float) -> Trial:
    """A step with |s| within a quarter of the radius, or a shorter Newton step.

    guess: initial shift, from the previous subproblem.
    """
    search = _ShiftSearch(model, radius, guess)
    shift = guess
    last: tuple[Factor, Trial] | None = None
    for _ in range(MAX_FACTORIZATIONS):
        factor = model.factor(shift)
        if factor is None:
            if last is not None and last[1].norm < radius and search.is_hard_case(last[1].shift):
                return search.complete(*last)
            shift = search.after_failure(shift)
            continue
        trial = search.step_at(factor, shift)
        if search.fits(trial):
            return trial
        if trial.norm < radius and search.is_hard_case(shift):
            return search.complete(factor, trial)
        last = factor, trial
        shift = search.after_step(factor, trial)
    if last is not None:
        factor, trial = last
        return search.complete(factor, trial) if search.is_short(trial) else trial
    raise ArithmeticError("H + shift D stays indefinite: the model has non-finite entries")


class _ShiftSearch:
    """Bracket and safeguarded Newton iteration on 1/|s(shift)| = 1/radius."""

    def __init__(self, model: QuadraticModel, radius: float, guess: float) -> None:
        self.model, self.radius = model, radius
        self.low, self.high = 0.0, math.inf
        self.indefinite, self.reached = False, guess > 0.0
        self.newton_too_long = False

    def after_failure(self, shift: float) -> float:
        """The next shift where H + shift D is not positive definite."""
        self.indefinite = True
        self.low = max(self.low, shift)
        if math.isfinite(self.high):
            return max(math.sqrt(self.low * self.high), FAILED_PART * self.high)
        least = (NEAR_SHIFT if self.reached else FAR_SHIFT) * self._scale()
        return max(FAILED_GROWTH * shift, least)

    def step_at(self, factor: Factor, shift: float) -> Trial:
        """The step for a shift."""
        s, slope, norm2 = self.model.descend(factor, self.radius)
        norm2 = max(norm2, 0.0)
        decrease = -0.5 * slope + 0.5 * shift * norm2
        if not math.isfinite(decrease) or (decrease == 0.0 and self.model.gradient.any()):
            raise ArithmeticError("the model has non-finite entries")
        return Trial(s, decrease, shift, math.sqrt(norm2), factor)

    def after_step(self, factor: Factor, trial: Trial) -> float:
        """The next shift after a step that is too long or too short."""
        shift, Ds = trial.shift, self.model.metric_product(trial.step)
        slope = float(np.vdot(Ds, factor.solve(Ds)))  # s.D (H + shift D)^-1 D s
        if trial.norm > self.radius:
            self.low = max(self.low, shift)
            self.newton_too_long |= trial.newton
        else:
            self.high = min(self.high, shift)
        norm, radius = trial.norm, self.radius
        newton = shift + (norm**2 / slope * (norm - radius) / radius if slope > 0 else 0.0)
        if self.low < newton < self.high:
            return newton
        free = not (self.indefinite or self.newton_too_long)
        if trial.norm < self.radius and free and self.low == 0.0:
            return 0.0
        if not math.isfinite(self.high):
            return max(LONG_GROWTH * shift, LONG_SHIFT * self._scale())
        return max(math.sqrt(self.low * self.high), STEP_PART * self.high)

    def _scale(self) -> float:
        scale = self.model.curvature_scale()
        if not math.isfinite(scale):
            raise ArithmeticError("the model has non-finite entries")
        return scale or float(np.max(np.abs(self.model.gradient))) / self.radius

    def fits(self, trial: Trial) -> bool:
        """Whether a step is within a quarter of the radius, or a shorter Newton step."""
        within = trial.norm <= LONGEST * self.radius
        # under equations steps for small shifts may stay short where the Newton step is long
        least = self.newton_too_long and trial.shift <= LEAST_SHIFT * self._scale()
        return within and (trial.newton or least or trial.norm >= SHORTEST * self.radius)

    def is_short(self, trial: Trial) -> bool:
        """Whether a step ends inside the radius although H is indefinite."""
        return self.indefinite and trial.norm < self.radius

    def is_hard_case(self, shift: float) -> bool:
        """Whether the step is too short even at the smallest shift with H + shift D definite."""
        return self.indefinite and (shift - self.low) <= HARD_WIDTH * shift

    def complete(self, factor: Factor, trial: Trial) -> Trial:
        """A short step extended to the radius along the lowest eigenvector of H relative to D.

        Where H is singular to rounding errors, such as along a symmetry, it is a Newton step.
        """
        if trial.shift <= SINGULAR * self._scale():
            return trial._replace(shift=0.0)
        u = self.model.random_vector(seed=0)
        for _ in range(4):
            u = factor.solve(self.model.metric_product(u))
            square = float(np.vdot(u, self.model.metric_product(u)))
            if not square > 0.0:
                raise ArithmeticError("H + shift D is singular to rounding errors")
            u /= math.sqrt(square)
        u = -u if np.vdot(self.model.gradient, u) > 0 else u
        Du = self.model.metric_product(u)
        b = float(np.vdot(trial.step, Du))
        length = -b + np.sqrt(max(b * b + self.radius**2 - trial.norm**2, 0.0))
        step = trial.step + length * u
        # Rayleigh quotient u.H u by one more inverse iteration
        rayleigh = 1.0 / float(np.vdot(Du, factor.solve(Du))) - trial.shift
        decrease = trial.decrease + trial.shift * b * length - 0.5 * length**2 * min(rayleigh, 0.0)
        alone = trial.norm < ALONE * self.radius
        return Trial(step, decrease, trial.shift, self.radius, factor, alone)
