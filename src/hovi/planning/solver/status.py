"""Status of a solve, and the sentence that describes how it ended."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Ended, Reason
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.non_finite import non_finite_sentence

Array = npt.NDArray[np.float64]


class Status(StrEnum):
    """Ended of a solve.

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


STOPPED = Status.TIME_LIMIT, Status.INTERRUPTED
"""Statuses after which nothing else is tried."""


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


def infeasible_sentence(reason: str, problem: TrajectoryProblem) -> str:
    """The message about a problem that no motion satisfies; reason: a clause."""
    if not problem.limited:
        return f"{reason}."
    within = problem.has_limits or bool(problem.bounds) or problem.distances is None
    place = "within the limits" if within else "that keeps its distances"
    return f"no motion {place} was found: {reason}."


def diverged(reason: str, steps: int) -> str:
    """The message about a motion with a number that is not finite; reason: a clause."""
    return f"{reason}, after {steps} steps; try another initial guess."


def status_of(
    problem: TrajectoryProblem, ended: Ended[DiscretePath, Any], cost: float, nit: int, n_neg: int
) -> tuple[Status, str]:
    """Status and message of a solve.

    cost: with the price of time. nit: number of all its iterations.
    """
    if ended.why is Reason.DIVERGED:
        reason = non_finite_sentence(problem, ended.x)
        if reason:
            return Status.DIVERGED, diverged(reason, nit)
    saddles = dict.fromkeys(f"{value:.10g}" for value in ended.saddles)
    left = "".join(
        f" A saddle of cost {each} was left along negative curvature." for each in saddles
    )
    if ended.why is Reason.STATIONARY and n_neg == 0:
        return (
            Status.MINIMUM,
            f"a minimum of cost {cost:.10g} after {nit} steps.{left}",
        )
    if ended.why is Reason.STATIONARY:
        advice = "solve again with escape_saddles=True or another guess"
        return Status.SADDLE, f"{saddle_in_words(cost, n_neg)}; {advice}."
    status, reason = unfinished(ended.why)
    return status, (
        f"{reason} after {nit} steps, before a minimum was found; the motion is the "
        f"best so far, of cost {cost:.10g}.{left}"
    )


def saddle_in_words(cost: float, n_neg: int) -> str:
    """A stationary motion that is no minimum, as a clause. n_neg: -1 if it is not known."""
    if n_neg > 0:
        return f"a saddle of cost {cost:.10g} with {n_neg} directions of negative curvature"
    return f"perhaps a saddle, of cost {cost:.10g}: rounding errors hide its curvature"
