"""A primal-dual interior-point method for bounds on outputs y(x), with trust-region steps.

The outputs have slacks s strictly between the bounds, and y(x) = s only in the limit, so the
initial point may violate every bound. With zl, zu the multipliers of s, Newton's method on

    z_l (s - l) = mu,  z_u (u - s) = mu,  y(x) = s,  d action + J^T (z_u - z_l) = 0

condenses into the block system of the unconstrained problem: per output the Hessian gains
sigma = z_l/(s-l) + z_u/(u-s), and the gradient rho = mu/(u-s) - mu/(s-l) + sigma (y - s).

Where the model is convex, a step that aims at mu = 0 predicts how far mu can fall, its second-order
terms are corrected, and so are outliers among the products z gap, all with one factorisation
[Mehrotra1992; Gondzio1996]. Progress is measured by the action, the logarithmic barrier and an
exact penalty of |y - s|; the model keeps the barrier as it is and linearises y alone. Where such a
step fails, mu stays until its problem is solved. [WaechterBiegler2006; NocedalWright2006, chapter
19]

Steps satisfy equations c = 0 to first order, A s = -c, or a fraction of c where the trust region
shortens them, and their multipliers change with every step (hovi.optimize.equation_model). Progress
is then measured with the multipliers after the step, and by |c|^2 as what takes c away costs, or
more where that would be none. A step whose merit falls by less than half of what it predicts is
corrected for the curvature of c, and refused where that undoes what it gained or does not help.

Where the Hessian is indefinite, the objective may give a model without the negative curvature of
outputs, with which mu falls sooner. At a stationary point, and from there on, the model is exact:
saddles are left.

An objective may replace outputs by looser ones as mu falls: bounds that hold at all times are
imposed on outputs close to the motion, the closer the smaller mu.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier, Direction
from hovi.optimize.bounded_steps import LAST_MU, SHORT_FRACTION, BoundedStep, BoundedSteps
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import FEASIBILITY_TOLERANCE, KEPT, Ended, Iteration, Outputs, Reason
from hovi.optimize.kkt_model import size_of
from hovi.optimize.observed import between_steps
from hovi.optimize.program import Program, Refinement
from hovi.optimize.quadratic_model import (
    ACCEPTED_RATIO,
    QuadraticModel,
    decrease_ratio,
    next_shift,
)
from hovi.optimize.start import Start

Array = npt.NDArray[np.float64]
X = TypeVar("X")

INITIAL_MU = 0.1
"""First barrier parameter, relative to the mean density of the objective."""
WHOLE_STEP = 0.9
"""Fraction of a step from which it is a whole one, after which little remains."""
FIRST_REFINEMENT = 1e-2
"""Mean product z gap, relative to the mean density, below which outputs are first refined."""
NEXT_REFINEMENT = 0.1
"""Mean product z gap below which outputs are refined again, relative to that at the last time."""
REOPENED, MOST_REOPENED = 0.1, 1e-2
"""Least barrier parameter after a refinement with outputs outside their bounds, relative to how far
they are and to the mean density, and its largest value, relative to the mean density."""
LEAST_REOPENED, LARGEST_REOPENED, MAX_REOPENINGS = 1e-5, 0.1, 6
"""Where outputs may be missed for a while, slacks are moved away from their bounds instead of
ending as diverged: the least barrier parameter then, relative to the mean density, the largest
|y - s|, and how many times."""
SADDLE_LEVEL, SADDLE_MARGIN = 1e-4, 0.1
"""Least barrier parameter, relative to the mean density, with which a solve goes on from a saddle
that an inexact model led to, and the least distance of slacks from their bounds then, relative to
the range, per barrier parameter."""
REOPENED_LEVEL = 0.3
"""Least barrier parameter when slacks are moved away from their bounds, relative to the mean
product of multipliers and gaps."""
SAVED_AGAIN = 1.5
"""A saved iterate is replaced while the mean product is below this many times its first one."""
LAST_PRODUCT = 10.0
"""Largest mean product of multipliers and gaps at the end, relative to the last barrier
parameter."""
SOLVED_LEVEL, SOLVED_VIOLATION = 10.0, 0.1
"""When the problem of a barrier parameter mu is solved by plain steps: the largest predicted
decrease and complementarity, relative to mu, and the largest |y - s|, relative to mu over the mean
density."""
MU_DECREASE = 0.1
"""Largest ratio of successive barrier parameters of plain steps."""
MAX_REFINEMENTS = 40
"""Maximum number of refinements."""
CUT_FRACTION, MOST_CUT, RAISED = 0.5, 4, 10.0
"""Fraction of a step below which the bounds cut it where the model is not convex (SHORT_FRACTION
where it is), the number of such steps in a row after which the barrier parameter is raised, since
it has fallen too early, and the factor by which it is raised."""
LEAST_RAISED_GAP = 1e-9
"""Least distance of slacks from their bounds after the barrier parameter is raised, relative to the
range."""
OUTSIDE_RADIUS = 3.0
"""Radius to which the trust region is cut where outputs are added outside of their bounds."""
DENSITY_FLOOR = 1e-9
"""Mean density of the initial objective below which 1 is used as its scale."""
MAX_FORCE = 1e12
"""Multiplier, relative to the mean density, above which bounds that do not hold are taken as
impossible."""
MAX_STALLED_STEPS = 12
"""Consecutive steps that are refused, or that could take little of c away while it does not fall,
after which the iteration ends as diverged."""
CURVED = 0.5
"""Ratio of the actual and the predicted decrease below which a step under equations is corrected
for their curvature."""
CORRECTED = 0.5
"""Part that a correction may leave of what a step misses of c; the step is refused otherwise."""
LITTLE = 0.99
"""Part of c that is left where steps take little of it away."""
MAX_UNMET = 4
"""Steps that predict next to nothing after which a solve ends although equations do not hold."""
MAX_SADDLES = 5
"""Number of saddles from which steps along negative curvature go on."""


def minimize_bounded(
    objective: Program[X],
    start: Start[X, Barrier],
    criteria: Criteria,
    report: Callable[[int, float], None] | None = None,
) -> Ended[X, Barrier]:
    """Minimise from a point that may violate the bounds; Ctrl-C ends it with the current point.

    start.z: slacks and multipliers of a nearby solution, for a warm start.
    """
    outputs = objective.outputs(start.x)
    density = abs(outputs.value) / objective.bounds.measure
    if density < DENSITY_FLOOR:
        density = 1.0
    barrier = start.z or Barrier.central(objective.bounds, outputs.y, INITIAL_MU * density)
    ended = Ended(start.x, outputs, barrier)
    with ended.recorded_end(criteria.time_limit):
        if len(outputs.y) > 0:
            cold, warm = objective.radii
            criteria = dataclasses.replace(criteria, radius=cold if start.z is None else warm)
        _Iteration(objective, ended, criteria, density, report).run()
    return ended


class _Reached(NamedTuple, Generic[X]):
    """A point that a step leads to, its outputs and barrier, and the merit function there."""

    step: Array
    x: X
    outputs: Outputs
    barrier: Barrier
    merit: float


class _Iteration(BoundedSteps[X]):
    """The main loop: solve a subproblem, accept or reject its step, reduce mu."""

    def __init__(
        self,
        objective: Program[X],
        ended: Ended[X, Barrier],
        criteria: Criteria,
        density: float,
        report: Callable[[int, float], None] | None,
    ) -> None:
        super().__init__(objective, ended, criteria, density)
        self.report = report
        self.stalled = self.unmet = self.idle = 0
        self.first_residual = math.inf
        self.level = FIRST_REFINEMENT
        self.refinements = self.reopenings = self.saddles = 0
        self.first_product = 0.0
        self.cut = 0

    def run(self) -> None:
        """Iterate until stationary, or until a limit is reached."""
        if not np.isfinite(self.ended.value):
            raise ArithmeticError("the objective is not defined at the first point")
        self.ended.keep_best(self.objective.bounds)
        between_steps(self.objective, self.ended.x)
        model = self.model()
        while len(self.ended.steps) < self.criteria.max_iterations:
            between_steps(self.objective, self.ended.x)
            step = self.step(model)
            if self._is_saddle(step):
                self.ended.saddles.append(self.ended.value)
                if not self._leave_saddle():
                    return self._end(model)
            self._count_idle(step)
            accepted = self._try(step, model)
            finished = self._finished(step, accepted)
            refined = (accepted or finished) and self._refined(at_end=finished)
            if self.objective.blocked:
                return
            if finished and not refined:
                exact, self.exact_from_now_on = self.exact, True
                model = self.model()
                definite = model.factor(0.0) is not None
                if exact and (definite or not self._leave_saddle()):
                    return self._end(model)
                if not (exact or definite):  # a saddle, which is hardly left at the bounds
                    level = max(SADDLE_LEVEL, self.product / self.density)
                    self._move_inside(level * self.density, SADDLE_MARGIN * level)
                    model = self.model()
                continue
            if self._is_hopeless():
                if not self._reopened():
                    self.ended.why = Reason.DIVERGED
                    return
                refined = True
            if accepted or refined:
                model = self.model()

    def _try(self, step: BoundedStep, model: QuadraticModel) -> bool:
        ended, trial = self.ended, step.trial
        before = ended.outputs.value + step.before
        if step.reaction is not None:
            self.objective.hold(step.reaction)
            before += float(step.reaction @ self.residual)
        try:
            there = self._reached(step, step.along, step.fraction * trial.step, model)
            corrected = self._corrected_step(step, there, before, model)
        except BaseException:  # the multipliers stay those of the current point
            self._let_go(step)
            raise
        if corrected is not None and not there.merit < corrected.merit < before:
            there = corrected
        ratio, value = self._ratio(step, before, there), there.outputs.value
        residual = size_of(self.residual)
        ended.steps.append(
            Iteration(value, step.decrease, ratio, trial.shift, self.radius, residual)
        )
        if self.report is not None:
            self.report(len(ended.steps), value)
        last, radius = self.radius, self.radius_after(step, ratio)
        self.shift = next_shift(trial.shift, trial.norm, radius)
        self.radius = radius
        refused = ratio <= ACCEPTED_RATIO
        self.stalled = self.stalled + 1 if refused else 0
        if refused:
            if not self.cautious:  # the same again, as a plain step
                self.radius = last
            self._let_go(step)
            self.cautious = True
            return False
        self.objective.accept(there.step, model)
        ended.x, ended.outputs, ended.z = there.x, there.outputs, there.barrier
        if step.reaction is not None:  # by other multipliers costs cannot be compared
            ended.kept = None
        ended.keep_best(self.objective.bounds)
        if self.cautious:
            self._reduce_mu(step)
        self._raise_mu(step)
        self.cautious = False
        self.product = ended.z.mean_product()
        self._save(there.x)
        return True

    def _reached(
        self, step: BoundedStep, along: Direction, moved: Array, model: QuadraticModel
    ) -> _Reached[X]:
        """Where a fraction of a direction leads. moved: its part in the unknowns."""
        x = self.objective.retract(self.ended.x, moved, model)
        outputs, barrier = self.objective.outputs(x), step.barrier
        if not np.isfinite(outputs.value):
            return _Reached(moved, x, outputs, barrier, math.inf)
        barrier = barrier.moved(outputs.y, along, step.fraction, self.penalty)
        merit = outputs.value + barrier.merit(outputs.y, self.penalty, along, 0.0)
        if step.weight > 0.0:
            merit += 0.5 * step.weight * size_of(self.objective.residual(x)) ** 2
        return _Reached(moved, x, outputs, barrier, merit)

    def _ratio(self, step: BoundedStep, before: float, there: _Reached[X]) -> float:
        """The actual decrease of the merit function over the predicted one."""
        return decrease_ratio(before - there.merit, step.decrease, self.noise)

    def _corrected_step(
        self, step: BoundedStep, there: _Reached[X], before: float, model: QuadraticModel
    ) -> _Reached[X] | None:
        """Where a step leads with its second-order correction, if equations curve too much.

        None if they do not, or if the corrected step leaves the bounds. The merit is infinite where
        they curve so much that the correction is of no use.
        """
        poor = self._ratio(step, before, there) < CURVED and math.isfinite(there.merit)
        if step.reaction is None or not poor or step.fraction == 0.0:
            return None
        if self.objective.satisfies_equations(there.x):  # what they miss is rounding
            return None
        expected = self.residual + step.fraction * step.taken
        missed = self.objective.residual(there.x) - expected
        more = model.correction(step.trial.factor, missed)
        dy = step.along.dy + self.objective.push(more, model) / step.fraction
        along = step.barrier.aim(self.ended.outputs.y, dy, step.targets)
        if along.primal < 1.0 and step.barrier.boundary_fraction * along.primal < step.fraction:
            return None
        reached = self._reached(step, along, there.step + more, model)
        left = self.objective.residual(reached.x) - expected
        corrected = size_of(left) < CORRECTED * size_of(missed)
        return reached if corrected else reached._replace(merit=math.inf)

    def _let_go(self, step: BoundedStep) -> None:
        """Take the change of the multipliers of equations back that goes with a step."""
        if step.reaction is not None:
            self.objective.let_go()

    def _save(self, x: X) -> None:
        """Save an iterate: the last one before the product halves."""
        product, saved = self.product, self.ended.saved
        if not saved or product < 0.5 * self.first_product:
            self.first_product = product
            saved.append((product, x))
        elif product <= SAVED_AGAIN * self.first_product:
            saved[-1] = min(product, self.first_product), x

    def _end(self, model: QuadraticModel) -> None:
        """End at a stationary point with its exact model."""
        self.ended.why, self.ended.model = Reason.STATIONARY, model

    def _is_saddle(self, step: BoundedStep) -> bool:
        """Whether the gradient is zero, and a step follows negative curvature alone."""
        known = self.exact and self.ended.feasible and self.product <= LAST_PRODUCT * self.final_mu
        satisfied = self.objective.satisfies_equations(self.ended.x)
        return known and satisfied and step.trial.along_negative_curvature

    def _leave_saddle(self) -> bool:
        """Prepare for steps along negative curvature, which turned up at the end; False for none.

        None follow where a saddle is to be an end, and after the last of MAX_SADDLES.
        """
        self.saddles, self.stalled = self.saddles + 1, 0
        return self.criteria.escape_saddles and self.saddles <= MAX_SADDLES

    def _count_idle(self, step: BoundedStep) -> None:
        """Count steps in a row that could take little of c away, while it has not fallen either."""
        size = size_of(self.residual)
        held = step.reaction is None or self.objective.satisfies_equations(self.ended.x)
        moving = held or size_of(self.residual + step.taken) <= LITTLE * size
        if moving or size <= LITTLE * self.first_residual:
            self.idle, self.first_residual = 0, size
        else:
            self.idle += 1

    def _is_hopeless(self) -> bool:
        """Whether bounds or equations seem impossible to satisfy from here."""
        stalled = max(self.stalled, self.idle) >= MAX_STALLED_STEPS
        forced = self.penalty > MAX_FORCE * self.density and not self.ended.feasible
        return stalled or forced

    def _reopened(self) -> bool:
        """Whether the slacks were moved away from their bounds again, to go on from there."""
        ended, objective = self.ended, self.objective
        outside = ended.violation
        if not objective.reopens or self.reopenings >= MAX_REOPENINGS or outside > LARGEST_REOPENED:
            return False
        self.reopenings += 1
        level = REOPENED_LEVEL * self.product / self.density
        fraction = max(min(REOPENED * outside, MOST_REOPENED), LEAST_REOPENED, level)
        self._move_inside(fraction * self.density, max(REOPENED * outside, LEAST_REOPENED))
        return True

    def _move_inside(self, mu: float, margin: float) -> None:
        """Move slacks away from their bounds, with a barrier parameter to go on with."""
        ended = self.ended
        bounds, y = self.objective.bounds, ended.outputs.y
        ended.z = Barrier.central(bounds, y, mu, ended.z.scale, margin)
        self._drop_saved(mu)
        self.product = ended.z.mean_product()
        self.shift, self.radius = 0.0, max(self.radius, 1.0)
        self.stalled, self.cautious = 0, False

    def _drop_saved(self, mu: float) -> None:
        """Drop saved iterates with a smaller barrier parameter: they are no longer on the way."""
        saved = self.ended.saved
        saved[:] = [each for each in saved if each[0] > mu]
        self.first_product = saved[-1][0] if saved else 0.0

    def _finished(self, step: BoundedStep, accepted: bool) -> bool:
        """Whether the last step, of the last mu, predicts next to nothing for its whole length."""
        final = self.final_mu
        last = step.barrier.mu <= LAST_MU * final and self.product <= LAST_PRODUCT * final
        enough = max(self.criteria.decrease, self.criteria.enough) * self.scale()
        whole = accepted and step.fraction >= WHOLE_STEP
        small = max(step.remaining, step.decrease) <= enough
        if not (last and whole and small and self.ended.feasible):
            return False
        if self.objective.satisfies_equations(self.ended.x):
            self.unmet = 0
            return step.trial.newton
        self.unmet += 1
        return self.unmet % MAX_UNMET == 0

    def _reduce_mu(self, step: BoundedStep) -> None:
        """Reduce mu after a plain step once its problem is solved."""
        ended, barrier = self.ended, self.ended.z
        last, fraction = self.final_mu, barrier.mu / self.density
        solved = (
            step.trial.newton
            and step.decrease <= SOLVED_LEVEL * barrier.mu * self._measure
            and ended.violation <= max(FEASIBILITY_TOLERANCE, SOLVED_VIOLATION * fraction)
            and barrier.complementarity() <= SOLVED_LEVEL * barrier.mu
        )
        if solved:
            mu = max(last, min(MU_DECREASE * barrier.mu, self.density * fraction**1.5))
            ended.z = barrier.with_mu(mu)

    def _raise_mu(self, step: BoundedStep) -> None:
        """Raise mu if bounds have cut several steps in a row: steps along them would stay short."""
        ended, objective = self.ended, self.objective
        cut = step.fraction < (SHORT_FRACTION if step.trial.newton else CUT_FRACTION)
        self.cut = self.cut + 1 if cut and ended.feasible and not objective.reopens else 0
        mu = min(RAISED * max(ended.z.mu, self.product), INITIAL_MU * self.density)
        if self.cut < MOST_CUT or mu <= ended.z.mu:
            return
        bounds, y, scale = objective.bounds, ended.outputs.y, ended.z.scale
        ended.z = Barrier.central(bounds, y, mu, scale, LEAST_RAISED_GAP)
        self.cut = 0
        self._drop_saved(mu)

    def _refined(self, at_end: bool) -> bool:
        """Whether outputs were replaced by others, which bound less."""
        level, ended = self.product / self.density, self.ended
        early = level > self.level or ended.violation > level
        if early and not at_end:
            return self._replaced(self.objective.refine_at_once(ended.x))
        if self.refinements >= MAX_REFINEMENTS:
            return False
        self.level = NEXT_REFINEMENT * min(level, self.level)
        found = self._replaced(self.objective.refine(ended.x, level))
        self.refinements += int(found)
        return found

    def _replaced(self, found: Refinement | None) -> bool:
        """Whether outputs were replaced; then their slacks and multipliers are, too."""
        if found is None:
            return False
        ended, kept = self.ended, self.ended.kept
        outputs = self.objective.outputs(ended.x)  # these may run out of time, so first of all
        if kept is not None:
            last = kept[0] is ended.x
            kept = kept[0], outputs if last else self.objective.outputs(kept[0])
            outside = self.objective.bounds.excess(kept[1].y).max(initial=0.0)
            kept = kept if outside < KEPT else None
        before = ended.outputs.y[found.kept]
        barrier = ended.z.refined(
            self.objective.bounds, outputs.y, found.kept, found.origin, before
        )
        outside = float(barrier.outside(outputs.y)[len(found.kept) :].max(initial=0.0))
        if outside > 0.0:
            self.radius = min(self.radius, OUTSIDE_RADIUS)
        mu = min(REOPENED * outside, MOST_REOPENED) * self.density
        if mu > barrier.mu:  # room for the others to move
            margin = REOPENED * outside
            barrier = Barrier.central(barrier.bounds, outputs.y, mu, None, margin, barrier)
        ended.outputs, ended.kept = outputs, kept
        self.product = barrier.mean_product()
        ended.z = barrier.with_mu(max(barrier.mu, self.product))
        self.radius = max(self.radius, 1.0)
        return True
