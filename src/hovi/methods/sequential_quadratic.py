"""Sequential quadratic programming: a second method for programs, by solvers of CasADi's wheel.

Every step solves a quadratic program with the Hessian of the Lagrangian and the linearised bounds
and equations. Where that Hessian is not positive definite, squares of the outputs that are held at
their bounds are added, which change nothing where they stay there, and then a multiple of the
metric. Where the linearised bounds contradict each other they may be exceeded at a price. Steps are
shortened until an exact penalty function decreases. [NocedalWright2006, chapter 18]
"""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.methods.method import Method, Report
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import FEASIBILITY_TOLERANCE, Ended, Iteration, Reason
from hovi.optimize.observed import between_steps
from hovi.optimize.program import Program
from hovi.optimize.quadratic_program import OPTIONS, QuadraticProgram, QuadraticStep
from hovi.optimize.start import Start
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
X = TypeVar("X")

HELD = 0.0, 1e2, 1e4, 1e6
"""Squares of outputs at their bounds that are added, relative to their forces: the first ones that
make the Hessian positive definite."""
FIRST_SHIFT, GROWTH = 1e-12, 3.0
"""First multiple of the metric that is added to an indefinite Hessian, relative to its magnitude,
and the ratio of the next ones."""
MORE_SHIFT, MAX_REFUSED = 100.0, 6
"""Factor on that multiple after a step that was refused, and how many in a row end the solve."""
PRICE, DEARER = 10.0, 10.0
"""Price of exceeding linearised bounds that contradict each other, relative to the mean density,
and the ratio of the next ones where there is no solution at one."""
MAX_PRICE = 1e6
"""Largest such price, at which bounds count as impossible."""
PENALTY_RATIO = 1.5
"""Penalty of what is exceeded, relative to the largest force."""
DECREASE = 1e-4
"""Decrease of the penalty function, relative to the predicted one, that a step needs."""
LEAST_FRACTION = 1e-5
"""Smallest fraction of a step that is tried."""
FORGOTTEN = 5
"""A step has to end below the largest of this many last values of the penalty function: one that
follows curved bounds may increase it for a while."""
FLOOR = 1e-12
"""Least magnitude of the objective, to which decreases are relative."""


@dataclass(frozen=True)
class SequentialQuadratic(Method):
    """Sequential quadratic programming.

    solver: of the quadratic programs: "piqp", or "osqp", "proxqp" or "highs" of CasADi's wheel,
        which take far longer for arms.
    Raises InputError for another solver.
    """

    solver: str = "piqp"

    def __post_init__(self) -> None:
        if not isinstance(self.solver, str) or self.solver not in OPTIONS:
            raise InputError(
                f"solver must be one of {', '.join(OPTIONS)}, got {self.solver!r:.60}."
            )

    def minimize(
        self,
        program: Program[X],
        start: Start[X, Array],
        criteria: Criteria,
        report: Report | None = None,
    ) -> Ended[X, Array]:
        """See Method.minimize."""
        outputs = program.outputs(start.x)
        z = np.zeros_like(outputs.y) if start.z is None else start.z
        ended = Ended(start.x, outputs, z)
        with ended.recorded_end(None):
            _Iteration(program, ended, criteria, self.solver).run(report)
        return ended


class _Iteration(Generic[X]):
    """The steps.

    penalty, equation_penalty: of the excess over bounds, and of equations, in the merit function.
    shift: multiple of the metric in the last Hessian. merits: last values of the merit function.
    refused: number of steps in a row. finished: whether the last step predicted next to nothing.
    """

    def __init__(
        self, program: Program[X], ended: Ended[X, Array], criteria: Criteria, solver: str
    ) -> None:
        self.program, self.ended, self.criteria, self.solver = program, ended, criteria, solver
        self.penalty, self.equation_penalty = 0.0, 0.0
        self.shift, self.merits = 0.0, [-np.inf]
        self.refused, self.finished = 0, False

    def run(self, report: Report | None) -> None:
        """Iterate until stationary, or until a limit is reached."""
        ended = self.ended
        if not np.isfinite(ended.value):
            raise ArithmeticError("the objective is not defined at the first point")
        while len(ended.steps) < self.criteria.max_iterations:
            between_steps(self.program, ended.x)
            quadratic = self._convex()
            step = self._step(quadratic)
            if step is None or not self._try(step, quadratic):
                self.refused += 1
            elif self.finished:
                ended.why = Reason.STATIONARY
                return
            if self.refused > MAX_REFUSED:
                ended.why = Reason.DIVERGED
                return
            if report is not None:
                report(len(ended.steps), ended.value)

    def _convex(self) -> QuadraticProgram:
        """The quadratic program at the current point, with a positive definite Hessian."""
        program, ended = self.program, self.ended
        z, y, bounds = ended.z, ended.outputs.y, program.bounds
        missed = y - np.where(z > 0.0, bounds.upper, np.where(z < 0.0, bounds.lower, y))
        for ratio in HELD:
            sigma = ratio * np.abs(z)
            quadratic = program.quadratic(ended.x, z, sigma, sigma * missed)
            if quadratic.definite(0.0) and self.refused == 0:
                self.shift = 0.0
                return quadratic
        least = FIRST_SHIFT * quadratic.model.curvature_scale()
        change = MORE_SHIFT if self.refused else GROWTH**-2
        self.shift = max(change * self.shift, least)
        while not quadratic.definite(self.shift):
            self.shift *= GROWTH
        return quadratic.convex(self.shift)

    def _step(self, quadratic: QuadraticProgram) -> QuadraticStep | None:
        """Its solution within the bounds, or at a price outside of them; None for none."""
        scale = max(abs(self.ended.value), FLOOR)
        found = quadratic.solved(self.solver, scale)
        price = PRICE / quadratic.bounds.measure
        while found is None and price * quadratic.bounds.measure <= MAX_PRICE:
            found = quadratic.solved(self.solver, scale, price)
            price *= DEARER
        return found

    def _try(self, step: QuadraticStep, quadratic: QuadraticProgram) -> bool:
        """Take a step, shortened until the merit function decreases; False where it does not."""
        program, ended, s = self.program, self.ended, step.step
        weights, c = quadratic.bounds.weights, quadratic.residual
        largest = float(np.abs(step.forces).max(initial=0.0))
        self.penalty = max(self.penalty, PENALTY_RATIO * largest)
        reacted = float(np.abs(step.reaction).max(initial=0.0))
        self.equation_penalty = max(self.equation_penalty, PENALTY_RATIO * reacted)
        before = self._merit(ended.value, ended.outputs.y, c)
        square = float(s @ (quadratic.hessian @ s))
        decrease = -float(quadratic.gradient @ s) - 0.5 * square
        decrease += self.penalty * float(
            weights @ (quadratic.bounds.excess(quadratic.y) - step.excess)
        )
        decrease += self.equation_penalty * float(np.abs(c).sum())
        most, fraction = max(before, *self.merits), 1.0
        noise = self.criteria.decrease * max(abs(ended.value), FLOOR)
        while True:
            x = program.retract(ended.x, fraction * s, quadratic.model)
            outputs, residual = program.outputs(x), program.residual(x)
            merit = self._merit(outputs.value, outputs.y, residual)
            small = decrease <= noise and merit <= before + noise
            if small or merit <= most - DECREASE * fraction * decrease:
                break
            fraction /= 2
            if fraction < LEAST_FRACTION:
                return False
        if len(c) > 0:
            program.hold(fraction * step.reaction)
            outputs = program.outputs(x)
        ended.x, ended.outputs = x, outputs
        ended.z = ended.z + fraction * (step.forces - ended.z)
        self.merits = [*self.merits, merit][-FORGOTTEN:]
        ratio = (before - merit) / decrease if decrease > 0.0 else 1.0
        steps = Iteration(outputs.value, decrease, ratio, self.shift, fraction)
        ended.steps.append(steps)
        kept = program.bounds.excess(outputs.y).max(initial=0.0) <= FEASIBILITY_TOLERANCE
        done = fraction == 1.0 and decrease <= noise and kept
        self.finished = done and program.satisfies_equations(x)
        self.refused = 0
        return True

    def _merit(self, value: float, y: Array, c: Array) -> float:
        """The exact penalty function, infinite where the objective is."""
        if not np.isfinite(value):
            return np.inf
        bounds = self.program.bounds
        merit = value + self.penalty * float(bounds.weights @ bounds.excess(y))
        return merit + self.equation_penalty * float(np.abs(c).sum())
