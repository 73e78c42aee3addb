"""Status of a solve, and the sentence that describes its outcome."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Reason
from hovi.optimize.trust_region import Outcome
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.non_finite import non_finite_sentence

Array = npt.NDArray[np.float64]


class Status(StrEnum):
    """Outcome of a solve.

    STATIONARY: a stationary point of any index, where one was sought.
    UNRESOLVED: a minimum at the quadrature points, on a grid that cannot carry the motion between
    them: see hovi.planning.refinement.resolution.
    """

    MINIMUM = "minimum"
    STATIONARY = "stationary"
    SADDLE = "saddle"
    INFEASIBLE = "infeasible"
    UNRESOLVED = "unresolved"
    ITERATION_LIMIT = "iteration_limit"
    TIME_LIMIT = "time_limit"
    INTERRUPTED = "interrupted"
    DIVERGED = "diverged"


def chart_sentence(problem: TrajectoryProblem, path: DiscretePath) -> str:
    """A warning if an orientation turns by more than pi within an interval; "" if none does."""
    if problem.ld.chart is None:
        return ""
    turns = problem.ld.turns(path)
    k = int(np.argmax(turns))
    if turns[k] <= np.pi:
        return ""
    return (
        f" An orientation turns by {turns[k]:.3g} rad in the interval at t = "
        f"{problem.grid.t[k]:.3g} s, more than half a turn: use more intervals."
    )


_UNFINISHED = {
    Reason.ITERATION_LIMIT: (Status.ITERATION_LIMIT, "the iteration limit was reached"),
    Reason.TIME_LIMIT: (Status.TIME_LIMIT, "the time limit was reached"),
    Reason.INTERRUPTED: (Status.INTERRUPTED, "the solve was interrupted"),
    Reason.DIVERGED: (Status.DIVERGED, "no step decreases the cost"),
}


def unfinished(why: Reason) -> tuple[Status, str]:
    """Status and reason for a method that ended before it found a stationary motion."""
    return _UNFINISHED[why]


def infeasible_sentence(reason: str) -> str:
    """The message about limits that no motion meets; reason: a clause."""
    return f"no motion within the limits was found: {reason}."


def diverged(reason: str, steps: int) -> str:
    """The message about a motion with a number that is not finite; reason: a clause."""
    return f"{reason}, after {steps} steps; try another initial guess."


def status_of(
    problem: TrajectoryProblem, outcome: Outcome[DiscretePath], n_neg: int
) -> tuple[Status, str]:
    """Status and message of an outcome."""
    if outcome.why is Reason.DIVERGED:
        reason = non_finite_sentence(problem, outcome.x)
        if reason:
            return Status.DIVERGED, diverged(reason, outcome.iterations)
    left = "".join(
        f" A saddle of cost {cost:.10g} was left along negative curvature."
        for cost in outcome.saddles_left
    )
    if outcome.why is Reason.STATIONARY and n_neg == 0:
        return (
            Status.MINIMUM,
            f"a minimum of cost {outcome.value:.10g} after {outcome.iterations} steps.{left}",
        )
    if outcome.why is Reason.STATIONARY:
        return (
            Status.SADDLE,
            f"a saddle of cost {outcome.value:.10g} with {n_neg} directions of negative curvature; "
            "solve again with escape_saddles=True or another guess.",
        )
    status, reason = unfinished(outcome.why)
    return status, (
        f"{reason} after {outcome.iterations} steps, before a minimum was found; the motion is the "
        f"best so far, of cost {outcome.value:.10g}.{left}"
    )
