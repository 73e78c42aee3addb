"""A free duration with a tolerance.

Two searches alternate: for the best duration on a grid, and for a grid that is fine enough at that
duration. Each hardly changes the result of the other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

from hovi.planning.problem.tolerance import Accuracy, Round
from hovi.planning.refinement.candidate import Candidate
from hovi.planning.refinement.error_estimate import estimate_against, with_estimate
from hovi.planning.search.free_duration import BestDuration, FreeDuration
from hovi.planning.search.joint_duration import (
    NEXT_STRIDE,
    JointSolve,
    OnGrid,
    best_on_its_grid,
    is_best,
    unless_best,
)
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status

Refine = Callable[[Solution], Solution]
"""Refines a motion of fixed duration to the tolerance; keeps its grid if that is fine enough."""

MAX_GRIDS = 4
"""Maximum number of grids on which the best duration is computed."""


def free_to_tolerance(
    free: FreeDuration,
    on_grid: OnGrid,
    refine: Refine,
    first: Solution,
    jointly: JointSolve | None = None,
) -> Solution:
    """A motion within a tolerance, whose duration is the best one on its grid.

    first: a solution for some duration between the bounds, on a coarse grid.
    jointly: solves for the duration, too; none if None.
    The accuracy is that of the motion for its fixed duration, relative to the cost with w T.
    Where J' + w vanishes, an error of the duration changes the cost to second order only.
    If a later round fails, the motion within the tolerance of the round before is returned, as a
    success only if its duration `is_best`; after an interrupt it counts as none.
    """
    found = best_on_its_grid(free, on_grid, first, jointly=jointly)
    steps, rounds = found.steps, tuple[Round, ...]()
    kept: BestDuration | None = None
    for number in range(MAX_GRIDS):
        if not found.solution.success:
            break
        refined = refine(found.solution)
        assert refined.accuracy is not None
        rounds += refined.accuracy.rounds
        steps += sum(done.nit for done in refined.accuracy.rounds[1:])
        settled = refined.trajectory.grid is found.solution.trajectory.grid
        ending = found.ending if refined.success else "The duration is"
        steepest = found.steepest if settled else 0.0  # else the jump is one of another grid
        found = dataclasses.replace(found, solution=refined, ending=ending, steepest=steepest)
        kept = found if refined.accuracy.reached else kept
        if settled or not refined.success:
            break
        found = best_on_its_grid(free, on_grid, refined, NEXT_STRIDE, jointly)
        steps += found.steps - refined.nit
        if not refined.accuracy.reached or number == MAX_GRIDS - 1:
            found = _measured(found, refined.accuracy)
            break
    best = found if kept is None or kept is found else _better(kept, found)
    return _with_rounds(dataclasses.replace(unless_best(best), steps=steps), rounds)


def _measured(last: BestDuration, before: Accuracy) -> BestDuration:
    """The motion of the last search, which is not refined, with its own accuracy.

    before: accuracy of the motion that the search began with.
    """
    solution = last.solution
    if not solution.success:
        return last
    candidate = Candidate.of(solution, before.tolerance)
    solution, finer = with_estimate(solution, candidate.error_of_cost), candidate.finer
    frame = before.tolerance.frame
    reached = candidate.within_tolerance
    why = before.reason or f"the best duration changed on each of {MAX_GRIDS} grids"
    accuracy = dataclasses.replace(
        before,
        error=candidate.error,
        reached=reached,
        reason="" if reached else why,
        compare=None if finer is None else partial(estimate_against, solution, finer, frame),
        along=candidate.along,
    )
    return dataclasses.replace(last, solution=dataclasses.replace(solution, accuracy=accuracy))


def _better(kept: BestDuration, later: BestDuration) -> BestDuration:
    """The motion within the tolerance, or the later one if only that has the best duration.

    later: of a round that failed, or whose motion may not be within the tolerance.
    """
    failed = later.solution
    if failed.success and is_best(later) and not is_best(kept):
        return later
    return _with_failure(unless_best(kept, failed.status), failed)


def _with_failure(kept: BestDuration, failed: Solution) -> BestDuration:
    """The last motion within the tolerance, with the reason why the next round failed."""
    if not kept.solution.success:
        return kept
    reason = str(failed.status) if not failed.success else "the tolerance was not reached again"
    if failed.status is Status.INTERRUPTED:  # so that the search ends
        kept = kept.unfinished(failed.status, "the search for the best duration was interrupted")
    ending = f"The best duration, found on a coarser grid ({reason} on the finer one), is"
    return dataclasses.replace(kept, ending=ending)


def _with_rounds(found: BestDuration, rounds: tuple[Round, ...]) -> Solution:
    """The solution with all rounds, and with its accuracy in the message if it was estimated."""
    solution = found.with_time()
    if solution.accuracy is None:
        return solution
    accuracy = dataclasses.replace(solution.accuracy, rounds=rounds)
    message = f"{solution.message.removesuffix('.')}; {accuracy}"
    return dataclasses.replace(solution, message=message, accuracy=accuracy)
