"""Measurement of methods on a sequence of grids, with repeats, within a time budget."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import field

from hovi.accuracy.budget import Budget
from hovi.accuracy.measures import Thresholds
from hovi.accuracy.method import Method, Prepared, Stopwatch
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.run import Run
from hovi.errors import UnmeasurableError
from hovi.system.dataclass import dataclass
from hovi.system.progress import Progress

INTERVALS = tuple(sorted([2**k for k in range(2, 13)] + [3 * 2**k for k in range(1, 12)]))
"""Numbers of intervals: 4, 6, 8, 12, 16, ..."""
SUFFICIENT_ERRORS = Thresholds(cost=1e-12, joints=1e-8, tip=1e-8)
"""Errors below which finer grids only show rounding."""
REPEATS = 7
"""Timed solves of a run after the first."""
FIRST_SOLVES_FRACTION = 0.8
"""Fraction of the time left for first solves."""
MAX_SOLVE_FRACTION = 0.1
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
    fraction: float = 1.0,
    repeats: int = REPEATS,
    enough: Thresholds = SUFFICIENT_ERRORS,
) -> Measured:
    """Run every method on finer and finer grids until its errors are small or the time is up.

    The next grid is that of the method whose first solves took the least time so far. The repeats
    follow in rounds over all runs, so that other load on the machine affects all runs alike.

    budget: of which `fraction` may be spent. repeats: of every valid run.
    enough: errors below which no finer grid is tried.
    """
    last = budget.fraction + FIRST_SOLVES_FRACTION * max(fraction - budget.fraction, 0.0)
    refinements = [_Refinement(method) for method in methods]
    notes, complete, going = [], True, list(refinements)
    while going:
        one = min(going, key=lambda each: each.spent)
        progress(one.method.name, budget.fraction)
        if not budget.allows(one.expected, last):
            complete = False
            going.remove(one)
            continue
        try:
            run = one.run_next(reference)
        except UnmeasurableError as error:
            notes.append(f"{one.method.name}: {error}")
            going.remove(one)
            continue
        slow = run.first_seconds > MAX_SOLVE_FRACTION * budget.seconds
        if slow or one.finished or enough.met_by(run.error) or _dominated(run, refinements):
            going.remove(one)
    all_solved = [each.solved for each in refinements]
    _repeat(all_solved, budget, progress, fraction, repeats)
    runs = tuple(run for solved in all_solved for _, run in solved)
    return Measured(runs, complete, tuple(notes))


@dataclass(eq=False)
class _Refinement:
    """A method on finer and finer grids.

    solved: its runs so far. spent: time of their solves. expected: wall time of the next run,
    set-up included. Both in [s].
    """

    method: Method
    solved: Solved = field(default_factory=list)
    spent: float = 0.0
    expected: float = 0.0

    @property
    def finished(self) -> bool:
        """Whether the last run was on the finest grid."""
        return bool(self._done >= INTERVALS[-1])

    def run_next(self, reference: ReferenceMotion) -> Run:
        """The first run on the next finer grid. Raises UnmeasurableError."""
        watch = Stopwatch("wall")
        intervals = next(each for each in INTERVALS if each > self._done)
        prepared = self.method.prepare(intervals)
        run = _first_run(self.method, intervals, prepared, reference)
        self.solved.append((prepared, run))
        self.spent += run.first_seconds
        self.expected = _MAX_TIME_RATIO * watch.seconds
        return run

    @property
    def _done(self) -> int:
        """Number of intervals of the last run; of limits it may be larger than that asked for."""
        return self.solved[-1][1].intervals if self.solved else self.method.coarsest - 1


def _dominated(run: Run, refinements: Sequence[_Refinement]) -> bool:
    """Whether a valid run of the same family was as accurate and much faster."""
    runs = (other for each in refinements for _, other in each.solved)
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
        intervals=answer.intervals or intervals,
        success=answer.success,
        message=answer.message,
        cost=answer.cost,
        steps=answer.steps,
        error=reference.error(answer.cost, answer.configurations),
        setup_seconds=prepared.seconds,
        first_seconds=answer.seconds,
    )


def _repeat(
    all_solved: list[Solved], budget: Budget, progress: Progress, fraction: float, repeats: int
) -> None:
    """Repeat all valid runs in rounds, as often as the budget allows."""
    for number in range(repeats):
        for solved in all_solved:
            for i, (prepared, run) in enumerate(solved):
                enough = sum(run.repeats) > MAX_SOLVE_FRACTION * budget.seconds / 2
                if not run.counts or enough or not budget.allows(run.first_seconds, fraction):
                    continue
                progress(f"repeat {number + 1} of {repeats}, {run.method}", budget.fraction)
                seconds = (*run.repeats, prepared.solve().seconds)
                solved[i] = prepared, dataclasses.replace(run, repeats=seconds)
