"""How a minimisation ended: why, and by which steps."""

from __future__ import annotations

from enum import StrEnum

from hovi.system.dataclass import dataclass


class Reason(StrEnum):
    """Why the iteration ended."""

    STATIONARY = "stationary"
    ITERATION_LIMIT = "iteration_limit"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"
    DIVERGED = "diverged"
    STALLED = "stalled"


@dataclass(frozen=True)
class Iteration:
    """One accepted or rejected step.

    value: the objective after the step. decrease: predicted by the model. ratio: actual over
        predicted decrease. shift: multiplier of the radius. radius: before the step.
    residual: |c| of equations before the step. With these, decrease is |s.H s| / 2 + |z.c|, ratio
        the fraction of the step that was taken, and radius the length of the whole step.
    """

    value: float
    decrease: float
    ratio: float
    shift: float
    radius: float
    residual: float = 0.0
