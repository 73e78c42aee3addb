"""A primal-dual interior-point method for bounds on outputs y(x), with trust-region steps.

The outputs have slacks s strictly between the bounds, and y(x) = s only in the limit, so the
initial point may violate every bound. With zl, zu the multipliers of s, Newton's method on

    z_l (s - l) = mu,  z_u (u - s) = mu,  y(x) = s,  d action + J^T (z_u - z_l) = 0

condenses into the block system of the unconstrained problem: per output the Hessian gains
sigma = z_l/(s-l) + z_u/(u-s), and the gradient rho = mu/(u-s) - mu/(s-l) + sigma (y - s).
Progress is measured by the action, the logarithmic barrier and an exact penalty of |y - s|; the
model keeps the barrier as it is and linearises y alone. [WaechterBiegler2006; NocedalWright2006,
chapter 19]
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.trust_region import (
    Iteration,
    Options,
    Stop,
    Trial,
    decrease_ratio,
    next_radius,
    next_shift,
    solve_subproblem,
)
from hovi.system.deadline import Deadline, OutOfTimeError, raise_if_late
from hovi.system.interruption import raise_if_interrupted, record_interrupt

Array = npt.NDArray[np.float64]
X = TypeVar("X")

INITIAL_MU = 0.1
"""First barrier parameter, relative to the mean density of the objective."""
FINAL_MU = 1e-10
"""Last barrier parameter, relative to the mean density of the objective."""
STEP_FRACTIONS = np.array([1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.02, 0.01, 1e-3])
"""Candidate fractions of the longest step inside the bounds; the model chooses among them."""
DENSITY_FLOOR = 1e-9
"""Mean density of the initial objective below which 1 is used as its scale."""
FEASIBILITY_TOLERANCE = 1e-8
"""Largest |y - s| of a solution, relative to the range of a bound."""
SLACK_MATCHED = 1e-9
"""Largest |y - s| at which the slack has reached its output and limits the length of a step."""
MAX_STALLED_STEPS = 12
"""Consecutive steps without progress after which the iteration ends as diverged."""


@dataclass(frozen=True, eq=False)
class Outputs:
    """The objective and the bounded outputs at a point.

    value: the objective. y: outputs in units of their ranges, shape (P, K).
    """

    value: float
    y: Array


class BoundedObjective(ABC, Generic[X]):
    """An objective with bounded outputs at weighted points."""

    bounds: Bounds

    @abstractmethod
    def outputs(self, x: X) -> Outputs:
        """The objective and the outputs at x."""

    @abstractmethod
    def model(self, x: X, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        """The objective's quadratic model plus sum of weights (rho dy + sigma dy^2/2).

        multipliers: weights of the outputs' curvature, shape (P, K).
        """

    @abstractmethod
    def linear_outputs(self, step: Array, model: QuadraticModel) -> tuple[float, Array]:
        """First-order change of the objective and of the outputs in a step of the model."""

    @abstractmethod
    def apply_fraction(self, fraction: float) -> None:
        """Apply a fraction of the last step of `linear_outputs` to lifted variables, if any."""

    @abstractmethod
    def retract(self, x: X, step: Array, model: QuadraticModel) -> X:
        """The point that a step of a model leads to."""


@dataclass(eq=False)
class BoundedOutcome(Generic[X]):
    """The final point, its multipliers, and why the iteration ended.

    violation: |y - s| at the end, shape (P, K), in units of the ranges.
    """

    x: X
    outputs: Outputs
    barrier: Barrier
    stop: Stop
    iterations: int = 0
    history: list[Iteration] = field(default_factory=list)
    model: QuadraticModel | None = None

    @property
    def violation(self) -> Array:
        """|y - s|, shape (P, K)."""
        return np.abs(self.outputs.y - self.barrier.s)

    @property
    def feasible(self) -> bool:
        """Whether the outputs equal their slacks to tolerance, and so satisfy the bounds."""
        return bool(self.violation.max(initial=0.0) <= FEASIBILITY_TOLERANCE)


@dataclass(frozen=True, eq=False)
class _Step:
    """A step of the primal-dual system, shortened such that the slacks stay inside.

    fraction: share of the trial step taken. decrease: predicted decrease of the merit function.
    """

    trial: Trial
    fraction: float
    ds: Array
    dzl: Array
    dzu: Array
    decrease: float


def minimize_bounded(
    objective: BoundedObjective[X],
    x: X,
    options: Options,
    report: Callable[[int, float], None] | None = None,
    start: Barrier | None = None,
) -> BoundedOutcome[X]:
    """Minimise from x, which may violate the bounds; Ctrl-C ends it with the current point.

    start: slacks and multipliers of a nearby solution, for a warm start.
    """
    outputs = objective.outputs(x)
    density = abs(outputs.value) / float(np.sum(objective.bounds.weights))
    if density < DENSITY_FLOOR:
        density = 1.0
    barrier = start or Barrier.central(objective.bounds, outputs.y, INITIAL_MU * density)
    outcome = BoundedOutcome(x, outputs, barrier, Stop.ITERATION_LIMIT)
    if not np.isfinite(outputs.value):
        outcome.stop = Stop.DIVERGED
        return outcome
    try:
        with Deadline(options.time_limit).in_force():
            _Iteration(objective, outcome, options, density, report).run()
    except OutOfTimeError:
        outcome.stop = Stop.TIME_LIMIT
    except KeyboardInterrupt:
        record_interrupt()
        outcome.stop = Stop.INTERRUPTED
    except ArithmeticError:
        outcome.stop = Stop.DIVERGED
    return outcome


def _until_falling(decrease: Callable[[float], float], shares: Array) -> list[float]:
    """The decreases of descending shares, up to the second in a row that is smaller."""
    known: list[float] = []
    for share in shares:
        known.append(decrease(float(share)))
        if len(known) > 2 and known[-1] < known[-2] < known[-3]:
            break
    return known


class _Iteration(Generic[X]):
    """The main loop: solve a subproblem, accept or reject its step, reduce mu when converged."""

    def __init__(
        self,
        objective: BoundedObjective[X],
        outcome: BoundedOutcome[X],
        options: Options,
        density: float,
        report: Callable[[int, float], None] | None,
    ) -> None:
        self.objective = objective
        self.outcome = outcome
        self.options = options
        self.density = density
        self.report = report
        self.radius = options.radius
        self.shift = 0.0
        self.penalty = 0.0
        self.stalled = 0

    def run(self) -> None:
        """Iterate until stationary, or until a limit is reached."""
        raise_if_interrupted()
        raise_if_late()
        model = self._model()
        while self.outcome.iterations < self.options.max_iterations:
            raise_if_interrupted()
            raise_if_late()
            step = self._step(model)
            accepted = self._try(step, model)
            if accepted and self._reduce_mu(step):
                self.outcome.stop = Stop.STATIONARY
                self.outcome.model = self._model()
                return
            if self.stalled >= MAX_STALLED_STEPS:
                self.outcome.stop = Stop.DIVERGED
                return
            if accepted:
                model = self._model()

    def _model(self) -> QuadraticModel:
        outcome, barrier = self.outcome, self.outcome.barrier
        residual = outcome.outputs.y - barrier.s
        return self.objective.model(
            outcome.x,
            barrier.sigma,
            barrier.gradient + barrier.sigma * residual,
            barrier.multipliers,
        )

    def _step(self, model: QuadraticModel) -> _Step:
        barrier = self.outcome.barrier
        weights = self.objective.bounds.weights
        residual = self.outcome.outputs.y - barrier.s
        trial = solve_subproblem(model, self.radius, self.shift)
        slope, dy = self.objective.linear_outputs(trial.step, model)
        ds = dy + residual
        dzl, dzu = barrier.dual_step(ds)
        if np.max(np.abs(residual)) > 1e-12:
            largest = float(np.max(np.abs(barrier.multipliers + dzu - dzl)))
            self.penalty = max(self.penalty, 1.2 * largest)
        square = -float(np.vdot(model.gradient, trial.step)) - trial.shift * trial.norm**2
        square -= float(np.sum(weights * barrier.sigma * dy**2))
        y = self.outcome.outputs.y
        matched = np.abs(residual) <= SLACK_MATCHED
        before = barrier.merit(weights, y, self.penalty)

        def decrease(share: float) -> float:
            smooth = share * slope + 0.5 * share**2 * square
            after = barrier.with_slacks(ds, share).merit(weights, y + share * dy, self.penalty)
            return before - after - smooth

        shares = barrier.max_share(np.where(matched, ds, 0.0)) * STEP_FRACTIONS
        decreases = np.array(_until_falling(decrease, shares))
        # the largest share whose decrease equals the best up to rounding
        noise = 1e-13 * self._scale()
        best = int(np.argmax(decreases >= np.max(decreases) - noise))
        return _Step(trial, float(shares[best]), ds, dzl, dzu, float(decreases[best]))

    def _try(self, step: _Step, model: QuadraticModel) -> bool:
        outcome, barrier = self.outcome, self.outcome.barrier
        weights = self.objective.bounds.weights
        x = self.objective.retract(outcome.x, step.fraction * step.trial.step, model)
        outputs = self.objective.outputs(x)
        moved = barrier.moved(step.ds, step.dzl, step.dzu, step.fraction)
        moved = moved.with_reset_slacks(outputs.y, self.penalty)
        old = outcome.outputs.value + barrier.merit(weights, outcome.outputs.y, self.penalty)
        new = outputs.value + moved.merit(weights, outputs.y, self.penalty)
        ratio = decrease_ratio(old - new, step.decrease, 1e-13 * abs(old))
        outcome.iterations += 1
        trial = step.trial
        outcome.history.append(
            Iteration(outputs.value, step.decrease, ratio, trial.shift, self.radius)
        )
        if self.report is not None:
            self.report(outcome.iterations, outputs.value)
        length = trial.norm * step.fraction
        radius = next_radius(self.radius, length, ratio)
        self.shift = next_shift(trial.shift, trial.norm, radius)
        self.radius = radius
        stalled = ratio <= 1e-4 or (length < 1e-4 * max(1.0, radius) and not outcome.feasible)
        self.stalled = self.stalled + 1 if stalled else 0
        if ratio <= 1e-4:
            return False
        self.objective.apply_fraction(step.fraction)
        outcome.x, outcome.outputs, outcome.barrier = x, outputs, moved
        return True

    def _scale(self) -> float:
        """Magnitude of the objective, to which decreases are relative; positive."""
        total = float(np.sum(self.objective.bounds.weights))
        return max(abs(self.outcome.outputs.value), FINAL_MU * self.density * total)

    def _reduce_mu(self, step: _Step) -> bool:
        """Reduce mu once its problem is solved; True once the last one is."""
        outcome, barrier = self.outcome, self.outcome.barrier
        total = float(np.sum(self.objective.bounds.weights))
        last = FINAL_MU * self.density
        newton = step.trial.newton and step.fraction == 1.0
        scale = self._scale()
        if barrier.mu <= last:
            return newton and outcome.feasible and step.decrease <= self.options.decrease * scale
        share = barrier.mu / self.density
        solved = (
            step.trial.newton
            and step.decrease <= 10 * barrier.mu * total
            and outcome.violation.max(initial=0.0) <= max(FEASIBILITY_TOLERANCE, 0.1 * share)
            and barrier.complementarity() <= 10 * barrier.mu
        )
        if solved:
            mu = max(last, min(0.1 * barrier.mu, self.density * share**1.5))
            outcome.barrier = barrier.with_mu(mu)
            self.penalty = 0.0
        return False
