"""Measurement of methods on a sequence of grids, with repeats, within a time budget."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.method import Method, Prepared, Stopwatch
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.run import Run
from hovi.errors import UnmeasurableError
from hovi.planning.search.job import Progress

INTERVALS = tuple(sorted([2**k for k in range(2, 13)] + [3 * 2**k for k in range(1, 12)]))
"""Numbers of intervals: 4, 6, 8, 12, 16, ..."""
SUFFICIENT_ERRORS = Thresholds(cost=1e-12, joints=1e-8, tip=1e-8)
"""Errors below which finer grids only show rounding."""
REPEATS = 7
"""Timed solves of a run after the first."""
FIRST_SOLVES_SHARE = 0.7
"""Fraction of the budget for first solves."""
MAX_SOLVE_SHARE = 0.1
"""A method stops after a first solve longer than this fraction of the budget; a run is no longer
repeated when its repeats have taken half of it."""
DOMINANCE = 15.0
"""A method stops when one of its family was at least as accurate in this many times less time."""
_MAX_TIME_RATIO = 2.0  # assumed from one grid to the next finer one


Solved = list[tuple[Prepared, Run]]
"""The prepared grids and runs of a method, by number of intervals."""


@dataclass(frozen=True, eq=False)
class Measured:
    """The result of a measurement.

    runs: by method, then by intervals. complete: whether no method ran out of time.
    notes: why methods were stopped.
    """

    runs: tuple[Run, ...]
    complete: bool
    notes: tuple[str, ...]


def measure(
    methods: Sequence[Method],
    reference: ReferenceMotion,
    budget: Budget,
    progress: Progress,
    share: float = 1.0,
    repeats: int = REPEATS,
    enough: Thresholds = SUFFICIENT_ERRORS,
) -> Measured:
    """Run every method on finer and finer grids until its errors are small or its time is up.

    First solves share their part of the budget evenly among the methods. The repeats follow in
    rounds over all runs, so that other load on the machine affects all runs alike.

    budget: of which `share` may be spent. repeats: of every valid run.
    enough: errors below which no finer grid is tried.
    """
    all_solved: list[Solved] = []
    notes, complete = [], True
    for number, method in enumerate(methods):
        part = (FIRST_SOLVES_SHARE * share - budget.fraction) / (len(methods) - number)
        solved: Solved = []
        all_solved.append(solved)
        progress(method.name, budget.fraction)
        try:
            ended = _refine(method, all_solved, reference, budget, budget.fraction + part, enough)
            complete = complete and ended
        except UnmeasurableError as error:
            notes.append(f"{method.name}: {error}")
    _repeat(all_solved, budget, progress, share, repeats)
    runs = tuple(run for solved in all_solved for _, run in solved)
    return Measured(runs, complete, tuple(notes))


def _refine(
    method: Method,
    all_solved: list[Solved],
    reference: ReferenceMotion,
    budget: Budget,
    share: float,
    enough: Thresholds,
) -> bool:
    """Run one method on finer and finer grids; returns False if its time ran out.

    all_solved: runs of all methods so far; those of this method are the last entry.
    """
    expected = 0.0
    for intervals in [each for each in INTERVALS if each >= method.coarsest]:
        if not budget.allows(expected, share):
            return False
        watch = Stopwatch()
        prepared = method.prepare(intervals)
        run = _first_run(method, intervals, prepared, reference)
        all_solved[-1].append((prepared, run))
        slow = run.first_seconds > MAX_SOLVE_SHARE * budget.seconds
        if slow or enough.met_by(run.error) or _dominated(run, all_solved):
            break
        expected = _MAX_TIME_RATIO * watch.seconds
    return True


def _dominated(run: Run, all_solved: list[Solved]) -> bool:
    """Whether a valid run of the same family was as accurate and much faster."""
    runs = (other for solved in all_solved for _, other in solved)
    others = [other for other in runs if other.family == run.family and other.counts]
    return run.counts and any(
        other.error.cost <= run.error.cost and DOMINANCE * other.first_seconds <= run.first_seconds
        for other in others
    )


def _first_run(
    method: Method, intervals: int, prepared: Prepared, reference: ReferenceMotion
) -> Run:
    answer = prepared.solve()
    return Run(
        method=method.name,
        family=method.family,
        order=method.order,
        intervals=intervals,
        success=answer.success,
        message=answer.message,
        cost=answer.cost,
        steps=answer.steps,
        error=reference.error(answer.cost, answer.configurations),
        setup_seconds=prepared.seconds,
        first_seconds=answer.seconds,
    )


def _repeat(
    all_solved: list[Solved], budget: Budget, progress: Progress, share: float, repeats: int
) -> None:
    """Repeat all valid runs in rounds, as often as the budget allows."""
    for number in range(repeats):
        for solved in all_solved:
            for i, (prepared, run) in enumerate(solved):
                enough = sum(run.repeats) > MAX_SOLVE_SHARE * budget.seconds / 2
                if not run.counts or enough or not budget.allows(run.first_seconds, share):
                    continue
                progress(f"repeat {number + 1} of {repeats}, {run.method}", budget.fraction)
                seconds = (*run.repeats, prepared.solve().seconds)
                solved[i] = prepared, dataclasses.replace(run, repeats=seconds)
