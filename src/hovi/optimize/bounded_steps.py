"""Steps of an interior point: directions of the primal-dual system, and how far to follow them.

See hovi.optimize.interior_point for the method.
"""

from __future__ import annotations

import math
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier, Direction, Pair
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended
from hovi.optimize.program import Program
from hovi.optimize.quadratic_model import (
    ACCEPTED_RATIO,
    AT_RADIUS,
    PREDICTED_NOISE,
    QuadraticModel,
    next_radius,
)
from hovi.optimize.trust_region import Trial, solve_subproblem
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
X = TypeVar("X")

LEAST_CENTRING = 1e-3
"""Smallest ratio of mu in one step."""
CORRECTIONS = 3
"""Maximum number of corrections of outliers in one step."""
LEAST_GAIN = 1e-3
"""Increase of the sum of the fractions of a direction below which the last correction is
dropped."""
LAST_MU = 1.01
"""Ratio of a barrier parameter to the last one up to which it counts as the last one."""
PENALTY_RATIO = 1.2
"""Penalty of |y - s| in the merit function, relative to the largest force of a direction."""
MAX_STRETCH = 1.5
"""Largest length of a corrected step, relative to the radius."""
LARGER_DENSITY, LEAST_DENSITY = 3.0, 1e-5
"""Mean density of the objective, relative to the present one, up to which the first one is the unit
of the last barrier parameter, and the least unit, relative to the first one."""
WEIGHED = 0.3
"""What a step under equations predicts, relative to the decrease of |c|^2 with its weight."""
LONG_STEP = 0.95
"""Fractions of a direction above which it needs no correction."""
SHORTER_FRACTIONS = 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.01, 1e-3
"""Fractions of the longest step that are tried: of a plain one while they predict more, so that
it ends away from the bounds; of a corrected one until one of them predicts a decrease."""
ALIKE, MOST_GROWTH = 0.05, 4.0
"""Relative difference of the actual and the predicted decrease up to which the radius grows by the
second of these, if the objective reopens; others begin with a radius that is wide enough."""
CUT_GROWTH = 2.0
"""Growth of the radius of other objectives where bounds, which are not satisfied yet, cut a step at
the radius."""
SHORT_FRACTION = 0.1
"""Fraction of a step at the radius below which it was too long for the bounds that cut it."""
MATCHED = 1e-4
"""Largest |y - s| at which the radius follows steps that bounds cut."""
CUT_RADIUS = 10.0
"""Largest radius after a step that bounds cut, relative to the length that was left of it."""
LEAST_CUT_RADIUS = 1e-3
"""Least value of that bound of the radius after a step that bounds cut."""
SHORTENED = 0.3
"""Radius after a step that bounds cut while |y - s| is above MATCHED, relative to the step; the
square of this where the step was refused."""
LEAST_VALUE = 1e-10
"""Least magnitude of the objective that decreases are relative to, relative to the first one."""
NOISE = 1e-2
"""Change of the merit function that is rounding, relative to the decrease at which a solve ends."""


@dataclass(frozen=True, eq=False)
class BoundedStep:
    """A step of the primal-dual system, shortened such that the slacks stay inside.

    along: the whole direction. fraction: of it that is taken.
    decrease: predicted decrease of the merit function.
    remaining: decrease that the whole direction predicts for the objective with its barrier.
    barrier: of the current point, with the mu that the step aims at. before: its merit there.
    targets: of the products of multipliers and gaps.
    reaction: change of the multipliers of equations that goes with it; None without any.
    taken: change A s of equations to first order, with the whole step, (E,).
    weight: of |c|^2 / 2 in the merit function.
    """

    trial: Trial
    along: Direction
    fraction: float
    decrease: float
    remaining: float
    barrier: Barrier
    before: float
    targets: Pair
    reaction: Array | None
    taken: Array
    weight: float


class BoundedSteps(Generic[X]):
    """The steps of an interior point: plain ones of one mu, and corrected ones that lower it.

    objective: with its bounds. ended: the current point and its barrier.
    criteria: see Criteria.
    density: mean density of the objective, its scale.
    """

    def __init__(
        self,
        objective: Program[X],
        ended: Ended[X, Barrier],
        criteria: Criteria,
        density: float,
    ) -> None:
        self.objective = objective
        self.ended = ended
        self.criteria = criteria
        self.density = density
        self.product = ended.z.mean_product()
        self.radius = criteria.radius
        self.shift = 0.0
        self.penalty = 0.0
        self.cautious = False
        self.exact, self.exact_from_now_on = True, False

    def model(self) -> QuadraticModel:
        """The model at the current point, whose multipliers of the bounds steps start from.

        Where it is not convex, the objective may replace it by one that is not `exact`: see
        Program.model_without_concavity.
        """
        ended = self.ended
        sigma, rho, force = ended.z.condensed(ended.outputs.y)
        self.sigma, self.rho, self.force, self.exact = sigma, rho, force, True
        model = self.objective.model(ended.x, sigma, rho, force)
        self.residual = self.objective.residual(ended.x)
        known = self.exact_from_now_on or not self.objective.may_be_concave
        if known or model.factor(0.0) is not None:
            return model
        other = self.objective.model_without_concavity(ended.x)
        self.exact = other is None
        return model if other is None else other

    def step(self, model: QuadraticModel) -> BoundedStep:
        """A corrected step towards a smaller mu if the model is convex, else a plain one."""
        trial = solve_subproblem(model, self.radius, self.shift)
        ahead = self.product > 2.0 * self.final_mu or self.ended.z.mu > LAST_MU * self.final_mu
        if trial.newton and not self.cautious and ahead:
            step = self._corrected(trial, model)
            short = step.fraction * step.trial.norm <= MAX_STRETCH * self.radius
            if short and step.decrease > -PREDICTED_NOISE * self.noise:
                return step
        self.cautious = True
        barrier = self.ended.z
        return self._shortened(trial, trial.step, None, barrier.central_targets(), model)

    def _corrected(self, trial: Trial, model: QuadraticModel) -> BoundedStep:
        """A predictor, its second-order correction, and corrections of outliers."""
        barrier, y, product = self.ended.z, self.ended.outputs.y, self.product
        zero = np.zeros_like(y)
        affine, _, _ = self._direction(trial, (zero, zero), model)
        after = barrier.mean_product(affine)
        centring = min(1.0, max((after / product) ** 3, LEAST_CENTRING)) if product > 0 else 1.0
        mu = max(self.final_mu, centring * product)
        targets = barrier.corrected_targets(y, affine, mu)
        along, s, pulled = self._direction(trial, targets, model)
        for _ in range(CORRECTIONS):
            if min(along.primal, along.dual) > LONG_STEP:
                break
            further = barrier.centered_targets(y, along, mu, targets)
            other, other_s, other_pulled = self._direction(trial, further, model)
            if other.primal + other.dual < along.primal + along.dual + LEAST_GAIN:
                break
            targets, along, s, pulled = further, other, other_s, other_pulled
        barrier = barrier.with_mu(mu)
        return self._shortened(trial, s, pulled, targets, model, barrier, along)

    def _direction(
        self, trial: Trial, targets: Pair, model: QuadraticModel
    ) -> tuple[Direction, Array, Array]:
        """The direction for given targets, its step, and the change of the gradient."""
        barrier, y = self.ended.z, self.ended.outputs.y
        pulled = self.objective.pull(barrier.shift(barrier.mu, targets), model)
        s = trial.step - trial.factor.solve(pulled)
        return barrier.aim(y, self.objective.push(s, model), targets), s, pulled

    def _shortened(
        self,
        trial: Trial,
        s: Array,
        pulled: Array | None,
        targets: Pair,
        model: QuadraticModel,
        barrier: Barrier | None = None,
        along: Direction | None = None,
    ) -> BoundedStep:
        """The longest step inside the bounds, or a shorter one if that predicts no decrease.

        s: the step, for the model's gradient plus `pulled`. barrier: with the mu that it aims at.
        along: its direction, if it is known.
        """
        barrier = barrier or self.ended.z
        y, weights = self.ended.outputs.y, self.objective.bounds.weights
        along = along or barrier.aim(y, self.objective.push(s, model), targets)
        self.penalty = PENALTY_RATIO * along.largest_force  # of this step alone
        slope = float(np.vdot(model.gradient, s)) - float(np.vdot(weights * self.rho, along.dy))
        gradient = model.gradient if pulled is None else model.gradient + pulled
        norm2 = trial.norm**2 if pulled is None else float(np.vdot(s, model.metric_product(s)))
        change, As = self._reaction(trial, s, gradient, model)
        reacted = 0.0 if change is None else -float(change @ As)
        whole = reacted - float(np.vdot(gradient, s))
        square = model.curvature(s) if model.equations else whole - trial.shift * norm2
        square -= float(np.vdot(weights * self.sigma, along.dy**2))
        before = barrier.merit(y, self.penalty, along, 0.0)
        missed = model.equations and not self.objective.satisfies_equations(self.ended.x)
        weight = model.residual_weight(trial.factor) if missed else 0.0

        def decrease(fraction: float) -> float:
            # the merit function has the multipliers after the step
            smooth = fraction * (slope - reacted) + 0.5 * fraction**2 * square
            smooth -= weight * self._residual_decrease(fraction, As)
            return before - barrier.merit(y, self.penalty, along, fraction) - smooth

        inside = along.primal >= 1.0  # a slack at the end of a whole step is kept off its bound
        longest = 1.0 if inside else barrier.boundary_fraction * along.primal
        fraction, predicted = longest, decrease(longest)
        if predicted < 0.0 and missed:
            gain = self._residual_decrease(longest, As)
            weight = self._weight(predicted - weight * gain, gain)
            predicted = decrease(longest)
        for shorter in SHORTER_FRACTIONS:
            if abs(predicted) <= PREDICTED_NOISE * self.noise or (
                pulled is not None and predicted > 0
            ):
                break
            other = decrease(shorter * longest)
            if other < predicted:
                break
            fraction, predicted = shorter * longest, other
        trial = trial._replace(step=s, norm=math.sqrt(max(norm2, 0.0)))
        if weight > 0.0:
            before += 0.5 * weight * float(self.residual @ self.residual)
        ends = barrier, before, targets, change, As, weight
        return BoundedStep(trial, along, fraction, predicted, 0.5 * whole, *ends)

    def _reaction(
        self, trial: Trial, s: Array, gradient: Array, model: QuadraticModel
    ) -> tuple[Array | None, Array]:
        """The change of the multipliers of equations, None without, and A s.

        A step that is kept within a radius has those of least squares, for the forces of the bounds
        as they are: rho of a slack at its bound is a stiff penalty, which no multiplier balances.
        """
        if not model.equations:
            return None, np.zeros_like(self.residual)
        if not trial.newton:
            gradient = gradient + self.objective.pull(self.force - self.rho, model)
        return model.reaction(gradient, s, trial.factor)

    def _residual_decrease(self, fraction: float, As: Array) -> float:
        """The predicted decrease of |c|^2 / 2, to |c + fraction A s|^2 / 2.

        As: shape (E,).
        """
        return -fraction * float((self.residual + 0.5 * fraction * As) @ As)

    def _weight(self, predicted: float, gain: float) -> float:
        """The weight w of |c|^2 / 2 with which a step predicts WEIGHED w gain.

        predicted: without it, predicted + w gain with it. gain: decrease of |c|^2 / 2.
        """
        return -predicted / ((1.0 - WEIGHED) * gain) if gain > 0.0 else 0.0

    def radius_after(self, step: BoundedStep, ratio: float) -> float:
        """The radius after a step, which the bounds may have cut."""
        norm, last = step.trial.norm, self.radius
        length = norm * step.fraction
        radius, reopens = next_radius(last, length, ratio), self.objective.reopens
        alike = abs(ratio - 1.0) <= ALIKE
        if alike and reopens and length > AT_RADIUS * last:
            return max(radius, MOST_GROWTH * last)
        unmatched = self.ended.violation > MATCHED
        if alike and unmatched and not (reopens or step.trial.newton):
            return max(radius, CUT_GROWTH * last)  # bounds cut the step, and not the model
        if step.trial.newton or step.fraction >= SHORT_FRACTION:
            return radius
        if not unmatched:
            return min(radius, max(CUT_RADIUS * length, LEAST_CUT_RADIUS))
        if not reopens:
            return radius
        # a radius as short as the step would lead nowhere while bounds are not satisfied
        return min(last, norm) * (SHORTENED if ratio > ACCEPTED_RATIO else SHORTENED**2)

    def scale(self) -> float:
        """Magnitude of the objective, to which decreases are relative; positive."""
        return max(abs(self.ended.outputs.value), LEAST_VALUE * self.density * self._measure)

    @property
    def final_mu(self) -> float:
        """The last mu, for the first mean density, or the present one where that is far smaller."""
        fraction = LARGER_DENSITY * self.scale() / (self.density * self._measure)
        return self.criteria.barrier * self.density * min(max(fraction, LEAST_DENSITY), 1.0)

    @property
    def noise(self) -> float:
        """Change of the merit function that is none."""
        return NOISE * self.criteria.decrease * self.scale()

    @property
    def _measure(self) -> float:
        return self.objective.bounds.measure
