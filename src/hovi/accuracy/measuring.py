"""Measuring: methods on finer and finer grids, then again and again, within a time budget."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.method import Method, Prepared, Stopwatch
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.run import Run
from hovi.errors import UnmeasurableError

Progress = Callable[[str, float], None]
"""Called with a line of text and the fraction done."""

INTERVALS = tuple(sorted([2**k for k in range(2, 13)] + [3 * 2**k for k in range(1, 12)]))
"""Numbers of intervals, from 4 on, each about 1.4 times the last."""
ENOUGH = Thresholds(cost=1e-12, joints=1e-8, tip=1e-8)
"""Errors below which finer grids would measure rounding."""
REPEATS = 7
"""Solves by which a time is judged, after the first."""
FIRST_SOLVES = 0.7
"""Share of the budget in which first solves may start."""
SLOWEST = 0.1
"""Share of the budget that one solve may take, and about what its repeats may take."""
DOMINATED = 15.0
"""A method stops where one of its family was more accurate in so many times less time."""
_GROWTH = 2.0  # of time from one number of intervals to the next, at most


Solved = list[tuple[Prepared, Run]]
"""What a method has solved, by number of intervals."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What came of measuring.

    runs: by method, then by intervals. complete: whether every method reached what is enough.
    notes: why methods dropped out.
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
    enough: Thresholds = ENOUGH,
) -> Measured:
    """Every method on finer and finer grids, until it is exact or its time is up.

    First solves come first; each method may take an equal part of what is left for them. The
    repeats follow in rounds over all runs, so that a busy moment of the machine meets all alike.

    budget: of which `share` may be spent. repeats: of every run that counts.
    enough: errors at which a method need not become finer.
    """
    all_solved: list[Solved] = []
    notes, complete = [], True
    for number, method in enumerate(methods):
        part = (FIRST_SOLVES * share - budget.fraction) / (len(methods) - number)
        solved: Solved = []
        all_solved.append(solved)
        progress(method.name, budget.fraction)
        try:
            ended = _refine(method, all_solved, reference, budget, budget.fraction + part, enough)
            complete = complete and ended
        except UnmeasurableError as refused:
            notes.append(f"{method.name}: {refused}")
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
    """Finer and finer grids, as long as the next one is worth its time.

    all_solved: of all methods so far, of which the last is this one's. Returns whether it ended
    for another reason than time.
    """
    expected = 0.0
    for intervals in [each for each in INTERVALS if each >= method.coarsest]:
        if not budget.allows(expected, share):
            return False
        watch = Stopwatch()
        prepared = method.prepare(intervals)
        run = _first(method, intervals, prepared, reference)
        all_solved[-1].append((prepared, run))
        slow = run.first_seconds > SLOWEST * budget.seconds
        if slow or enough.met_by(run.error) or _dominated(run, all_solved):
            break
        expected = _GROWTH * watch.seconds
    return True


def _dominated(run: Run, all_solved: list[Solved]) -> bool:
    """Whether finer grids of a method have no hope of being worth their time.

    A run that went astray says nothing of them.
    """
    runs = (other for solved in all_solved for _, other in solved)
    others = [other for other in runs if other.family == run.family and other.counts]
    return run.counts and any(
        other.error.cost <= run.error.cost and DOMINATED * other.first_seconds <= run.first_seconds
        for other in others
    )


def _first(method: Method, intervals: int, prepared: Prepared, reference: ReferenceMotion) -> Run:
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
    """Rounds over all runs that count, as many as the budget allows."""
    for number in range(repeats):
        for solved in all_solved:
            for i, (prepared, run) in enumerate(solved):
                often = sum(run.repeats) > SLOWEST * budget.seconds / 2
                if not run.counts or often or not budget.allows(run.first_seconds, share):
                    continue
                progress(f"repeat {number + 1} of {repeats}, {run.method}", budget.fraction)
                seconds = (*run.repeats, prepared.solve().seconds)
                solved[i] = prepared, dataclasses.replace(run, repeats=seconds)
