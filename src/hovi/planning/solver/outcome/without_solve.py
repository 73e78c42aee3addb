"""Solutions that no solve has found: what is a minimum already, and what has no motion."""

from __future__ import annotations

from hovi.discrete.grid import DiscretePath
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.presolve.swings import too_many_swings
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.initial_path import guess_path
from hovi.planning.solver.outcome.cost_with_time import cost_of
from hovi.planning.solver.solver import Solution, solution_of
from hovi.planning.solver.status import Status, infeasible_sentence

WIDER = "make what changes wider than that, or leave it out"
"""Advice about formulas of time that change too fast."""
SHORTER = (
    "plan a motion of seconds and rest before or after it, or add the effect viscous_friction or a "
    "cost on the motion"
)
"""Advice about motions that would swing too often."""


def minimum_at(
    problem: TrajectoryProblem, path: DiscretePath, steps: int, seconds: float
) -> Solution:
    """A Solution from a path that is known to be a minimum, without limits or constraints.

    steps: of the optimiser. seconds: wall time.
    """
    value = cost_of(problem, path)
    message = f"a minimum of cost {value:.10g} after {steps} steps."
    result = Answer(problem, path, value, Status.MINIMUM, message, steps, n_neg=0)
    return solution_of(result, solve_seconds=seconds)


def unresolved_at_once(
    problem: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath,
    reason: str,
    advice: str = WIDER,
) -> Solution:
    """The guess of a problem that a grid is not likely to resolve. reason, advice: as clauses."""
    path = guess_path(problem, guess)
    message = f"no motion was sought, since a grid is not likely to resolve it: {reason}; {advice}."
    return solution_of(Answer.at(problem, path, Status.UNRESOLVED, message))


def infeasible_at_once(
    problem: TrajectoryProblem, guess: str | Trajectory | DiscretePath, reason: str
) -> Solution:
    """The guess of a problem that is known to have no motion. reason: as a clause."""
    path, message = guess_path(problem, guess), infeasible_sentence(reason, problem)
    return solution_of(Answer.at(problem, path, Status.INFEASIBLE, message))


def without_search(
    problem: TrajectoryProblem,
    longest: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath,
    reason: str,
    fault: str,
) -> Solution | None:
    """The solution of a plan that is not searched for; None if one is.

    longest: the problem with its longest duration, the same one for a given duration. reason: why
    there is no motion, as a clause; "" if one may exist. fault: of the formulas of time, likewise.
    """
    if reason:
        return infeasible_at_once(longest, guess, reason)
    if fault:
        return unresolved_at_once(problem, guess, fault)
    if longest is problem and (often := too_many_swings(problem)):
        return unresolved_at_once(problem, guess, often, SHORTER)
    return None
