"""A free duration and a tolerance at once.

By turns, the best duration on a grid, and a grid that is fine enough for the motion of that
duration: a finer grid hardly moves the duration, and another duration hardly asks for another grid.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from hovi.discrete.grid import Grid
from hovi.planning.problem.tolerance import Round
from hovi.planning.search.free_duration import BestDuration, FreeDuration, SolveFor, best_duration
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status

OnGrid = Callable[[Grid], SolveFor]
"""What solves on a grid that is stretched to a duration."""
Refine = Callable[[Solution], Solution]
"""The motion within the tolerance, for its duration; on its own grid where that is fine enough."""

TURNS = 4
"""Grids on which the best duration is looked for."""
STRIDE = 1.001
"""Ratio of the first two durations that are tried on a finer grid."""


def free_to_tolerance(
    free: FreeDuration, on_grid: OnGrid, refine: Refine, first: Solution
) -> Solution:
    """A motion whose duration is the best one on a grid that brings it within a tolerance.

    first: a solution for some duration between the bounds, on a coarse grid.
    The accuracy is that of the motion among those of its duration, relative in the cost without
    w T. That J' + w vanishes on the grid and not in the limit costs the square of a small error.
    Where a later turn fails, the motion within the tolerance of the one before is returned; after
    an interrupt it is no success, as elsewhere.
    """
    found = best_duration(free, on_grid(first.trajectory.grid), first)
    steps, rounds = found.steps, tuple[Round, ...]()
    kept: BestDuration | None = None
    for turn in range(TURNS):
        if not found.solution.success:
            break
        refined = refine(found.solution)
        assert refined.accuracy is not None
        rounds += refined.accuracy.rounds
        steps += sum(done.nit for done in refined.accuracy.rounds[1:])
        settled = refined.trajectory.grid is found.solution.trajectory.grid
        found = dataclasses.replace(found, solution=refined)
        if not refined.accuracy.reached:
            break
        kept = found
        if settled or turn == TURNS - 1:
            break
        found = best_duration(free, on_grid(refined.trajectory.grid), refined, STRIDE)
        steps += found.steps - refined.nit
    best = found if kept is None or kept is found else _held(kept, found.solution)
    return _told(dataclasses.replace(best, steps=steps), rounds)


def _held(kept: BestDuration, failed: Solution) -> BestDuration:
    """The last motion within the tolerance, with what became of the search for a better one."""
    reason = str(failed.status) if not failed.success else "the tolerance was not reached again"
    ending = f"Its duration is the best on a coarser grid, as the finer one gave none ({reason}):"
    solution = kept.solution
    if failed.status is Status.INTERRUPTED:  # so that no other motion is tried either
        solution = dataclasses.replace(solution, success=False, status=failed.status)
    return dataclasses.replace(kept, solution=solution, ending=ending)


def _told(found: BestDuration, rounds: tuple[Round, ...]) -> Solution:
    """The motion with all rounds, and with its accuracy in the message if it was estimated."""
    solution = found.with_time()
    if solution.accuracy is None:
        return solution
    accuracy = dataclasses.replace(solution.accuracy, rounds=rounds)
    message = f"{solution.message.removesuffix('.')}; {accuracy}"
    return dataclasses.replace(solution, message=message, accuracy=accuracy)
