"""Objectives with bounds on outputs, and what their minimisation returns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.ended import Iteration, Reason
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import record_interrupt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
X = TypeVar("X")

FEASIBILITY_TOLERANCE = 1e-8
"""Largest |y - s| of a solution, relative to the range of a bound."""

STOPPED = Reason.TIME_LIMIT, Reason.INTERRUPTED
"""Reasons that end the whole search."""

KEPT = 1e-6
"""Excess over a bound, relative to its range, up to which a point keeps it."""


@dataclass(frozen=True, eq=False)
class Outputs:
    """The objective and the bounded outputs at a point.

    value: the objective. y: outputs in units of their ranges, shape (R,).
    """

    value: float
    y: Array

    def density(self, measure: float) -> float:
        """The mean density of the objective, an integral over a measure; positive."""
        return max(abs(self.value), 1e-12) / measure


class Refinement(NamedTuple):
    """Outputs that took the place of others.

    kept: numbers of those that remain, ascending; the new ones follow them.
    origin: number of the former output at the place of each new one; -1 for none.
    handed: numbers, as they are now, of new outputs and of kept ones beside them, whose multipliers
        new ones take over that are outside their lower bounds. A kept output occurs once.
    """

    kept: Index
    origin: Index
    handed: tuple[Index, Index] | None = None


class BoundedObjective(ABC, Generic[X]):
    """An objective with bounded outputs."""

    bounds: Bounds
    blocked: bool = False
    """Whether refining found outputs so far from their bounds that the iteration is to end."""
    reopens: bool = False
    """Whether new outputs may be outside their bounds, which an iteration then recovers from."""
    radii: tuple[float, float] = 50.0, 1000.0
    """First radius of the trust region, as the norm of a step in the metric, in a cold start and in
    a warm one, which is near to a solution of a similar problem."""

    @abstractmethod
    def outputs(self, x: X) -> Outputs:
        """The objective and the outputs at x."""

    @abstractmethod
    def model(self, x: X, sigma: Array, rho: Array, multipliers: Array) -> QuadraticModel:
        """The objective's quadratic model plus sum of weights (rho dy + sigma dy^2/2).

        multipliers: weights of the outputs' curvature, shape (R,).
        """

    @property
    def may_be_concave(self) -> bool:
        """Whether models may leave out negative curvature of outputs."""
        return False

    def model_without_concavity(self, x: X) -> QuadraticModel | None:
        """The last model, at x, without negative curvature of outputs; None if it has none.

        It takes the place of the last model, and need not be convex: the objective may not be.
        """
        return None

    @abstractmethod
    def push(self, step: Array, model: QuadraticModel) -> Array:
        """First-order change of the outputs in a step of the last model, shape (R,)."""

    @abstractmethod
    def pull(self, forces: Array, model: QuadraticModel) -> Array:
        """Gradient of sum of weights (forces y) in the unknowns of the last model."""

    @abstractmethod
    def accept(self, step: Array, model: QuadraticModel) -> None:
        """Take note of a step of the last model, for lifted variables, if any."""

    @abstractmethod
    def retract(self, x: X, step: Array, model: QuadraticModel) -> X:
        """The point that a step of a model leads to."""

    def hold(self, x: X, change: Array) -> float:
        """Add a change to the multipliers of equations; returns what it adds to the value at x."""
        return 0.0

    def meets_equations(self, x: X) -> bool:
        """Whether equations hold at x to their tolerance; true without any."""
        return True

    def refine(self, x: X, level: float) -> Refinement | None:
        """Replace outputs by others, which come after those that remain and bound x less.

        Returns None if nothing changed.
        level: mean product z gap at x, relative to the mean density of the objective.
        """
        return None

    def refine_at_once(self, x: X) -> Refinement | None:
        """The same after any step, for outputs that cannot wait for a smaller product."""
        return None


@dataclass(eq=False)
class BoundedOutcome(Generic[X]):
    """The final point, its multipliers, and why the iteration ended.

    corrected: whether some steps were corrected ones, without which it may end otherwise.
    marks: the last points on the way before the mean product z gap had halved, with that product.
    kept: the point of least objective so far that keeps the bounds to KEPT, and the outputs there;
        None for none. It is the final point where time runs out.
    """

    x: X
    outputs: Outputs
    barrier: Barrier
    why: Reason
    iterations: int = 0
    history: list[Iteration] = field(default_factory=list)
    model: QuadraticModel | None = None
    corrected: bool = False
    marks: list[tuple[float, X]] = field(default_factory=list)
    kept: tuple[X, Outputs] | None = None
    _measured: tuple[Array, Array, float] | None = field(default=None, init=False, repr=False)

    @property
    def converged(self) -> bool:
        """Whether it ended at a stationary point within the bounds."""
        return self.feasible and self.why is Reason.STATIONARY

    @property
    def settled(self) -> bool:
        """Whether no other attempt is needed: it converged, or the whole search is stopped."""
        return self.converged or self.why in STOPPED

    @contextmanager
    def recorded_end(self, time_limit: float | None) -> Iterator[None]:
        """An iteration whose end by its time limit, by Ctrl-C or by arithmetic becomes `stop`.

        time_limit: in [s]; None for none.
        """
        try:
            with Deadline(time_limit).in_force():
                yield
        except OutOfTimeError:
            self.why = Reason.TIME_LIMIT
            self.x, self.outputs = self.kept or (self.x, self.outputs)
        except KeyboardInterrupt:
            record_interrupt()
            self.why = Reason.INTERRUPTED
        except ArithmeticError:
            self.why = Reason.DIVERGED

    def keep_best(self, bounds: Bounds) -> None:
        """Keep the current point if it is within the bounds, and better than the one kept."""
        if self.kept is not None and self.kept[1].value <= self.outputs.value:
            return
        y = self.outputs.y
        if max(np.max(bounds.lower - y, initial=0.0), np.max(y - bounds.upper, initial=0.0)) < KEPT:
            self.kept = self.x, self.outputs

    @property
    def violation(self) -> float:
        """The largest |y - s|, relative to the ranges; cached, as a step asks up to eight times."""
        y, s, known = self.outputs.y, self.barrier.s, self._measured
        if known is None or known[0] is not y or known[1] is not s:
            known = self._measured = y, s, float(np.abs(y - s).max(initial=0.0))
        return known[2]

    @property
    def feasible(self) -> bool:
        """Whether the outputs equal their slacks to tolerance, and so satisfy the bounds."""
        return self.violation <= FEASIBILITY_TOLERANCE
