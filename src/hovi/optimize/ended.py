"""How a minimisation ended: where, with which multipliers, why, and by which iterations."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from enum import StrEnum
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.optimize.barrier import Barrier, Bounds
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import record_interrupt

Array = npt.NDArray[np.float64]
X = TypeVar("X")
Z = TypeVar("Z")

LEAST_VALUE = 1e-12
"""Least magnitude of an objective that densities and penalties are relative to."""
FEASIBILITY_TOLERANCE = 1e-8
"""Largest |y - s| of a solution, relative to the range of a bound."""
KEPT = 1e-6
"""Excess over a bound, relative to its range, up to which a point keeps it."""


class Reason(StrEnum):
    """Why a minimisation ended."""

    STATIONARY = "stationary"
    ITERATION_LIMIT = "iteration_limit"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"
    DIVERGED = "diverged"
    STALLED = "stalled"


STOPPED = Reason.TIME_LIMIT, Reason.INTERRUPTED
"""Reasons that end the whole search."""
STOPS = KeyboardInterrupt, OutOfTimeError
"""What ends a solve from outside: Ctrl-C, and the end of its time."""


def why_stopped(stopped: BaseException) -> Reason:
    """Why a solve ended, where one of STOPS ended it; Ctrl-C is recorded."""
    if isinstance(stopped, OutOfTimeError):
        return Reason.TIME_LIMIT
    record_interrupt()
    return Reason.INTERRUPTED


@dataclass(frozen=True)
class Iteration:
    """One accepted or rejected step.

    value: the objective after the step. decrease: predicted by the model. ratio: actual over
        predicted decrease. shift: multiplier of the radius. radius: before the step.
    residual: |c| of equations before the step.
    """

    value: float
    decrease: float
    ratio: float
    shift: float
    radius: float
    residual: float = 0.0


@dataclass(frozen=True, eq=False)
class Outputs:
    """The objective and what is constrained at a point.

    value: the objective. y: bounded outputs in units of their ranges, shape (R,), or the residual c
        of equations, shape (E,).
    """

    value: float
    y: Array

    def density(self, measure: float) -> float:
        """The mean density of the objective, an integral over a measure; positive."""
        return max(abs(self.value), LEAST_VALUE) / measure


@dataclass(eq=False)
class Ended(Generic[X, Z]):
    """The final point, its multipliers, and why the iteration ended; the current ones before.

    x, outputs: the point, with the objective and what is constrained there.
    z: slacks and multipliers of bounds; None without any.
    steps: one record per step that was tried.
    model: the last quadratic model, of a stationary point. convex: whether that was exact, with a
        Hessian that is positive definite, under equations on their tangent space.
    saddles: values at the saddles that were left along negative curvature.
    saved: the last iterates before the mean product z gap had halved, with that product.
    kept: the point of least objective so far that keeps the bounds to KEPT, and the outputs there;
        None for none. It is the final point where time runs out.
    """

    x: X
    outputs: Outputs
    z: Z
    why: Reason = Reason.ITERATION_LIMIT
    steps: list[Iteration] = field(default_factory=list)
    model: QuadraticModel | None = None
    convex: bool = False
    saddles: list[float] = field(default_factory=list)
    saved: list[tuple[float, X]] = field(default_factory=list)
    kept: tuple[X, Outputs] | None = None
    _measured: tuple[Array, Array, float] | None = field(default=None, init=False, repr=False)

    @property
    def value(self) -> float:
        """The objective at the point."""
        return self.outputs.value

    @contextmanager
    def recorded_end(self, time_limit: float | None) -> Iterator[None]:
        """An iteration whose end by its time limit, by Ctrl-C or by arithmetic becomes `why`.

        time_limit: in [s]; None for none.
        """
        try:
            with Deadline(time_limit).in_force():
                yield
        except STOPS as stopped:
            self.why = why_stopped(stopped)
            if self.why is Reason.TIME_LIMIT:
                self.x, self.outputs = self.kept or (self.x, self.outputs)
        except (ArithmeticError, np.linalg.LinAlgError):
            self.why = Reason.DIVERGED

    def keep_best(self, bounds: Bounds) -> None:
        """Keep the current point if it is within the bounds, and better than the one kept."""
        if self.kept is not None and self.kept[1].value <= self.outputs.value:
            return
        if bounds.excess(self.outputs.y).max(initial=0.0) < KEPT:
            self.kept = self.x, self.outputs

    @property
    def violation(self: Ended[X, Barrier]) -> float:
        """The largest |y - s|, relative to the ranges; cached, as a step asks up to eight times."""
        y, s, known = self.outputs.y, self.z.s, self._measured
        if known is None or known[0] is not y or known[1] is not s:
            known = self._measured = y, s, float(np.abs(y - s).max(initial=0.0))
        return known[2]

    @property
    def feasible(self: Ended[X, Barrier]) -> bool:
        """Whether the outputs equal their slacks to tolerance, and so satisfy the bounds."""
        return self.violation <= FEASIBILITY_TOLERANCE

    @property
    def converged(self: Ended[X, Barrier]) -> bool:
        """Whether it ended at a stationary point within the bounds."""
        return self.feasible and self.why is Reason.STATIONARY

    @property
    def settled(self: Ended[X, Barrier]) -> bool:
        """Whether no other attempt is needed: it converged, or the whole search is stopped."""
        return self.converged or self.why in STOPPED
