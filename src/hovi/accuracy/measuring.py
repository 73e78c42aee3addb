"""Measuring: methods on finer and finer grids, then again and again, within a time budget."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hovi.accuracy.budget import Budget
from hovi.accuracy.method import Answer, Method, Prepared
from hovi.accuracy.motion_error import MotionError, Yardstick
from hovi.accuracy.run import Run
from hovi.errors import UnmeasurableError

Progress = Callable[[str, float], None]
"""What is told how far the work is: a line of text and the fraction done."""

LADDER = tuple(sorted([2**k for k in range(2, 13)] + [3 * 2**k for k in range(1, 12)]))
"""Numbers of intervals, from 4 on, each about 1.4 times the last."""
ENOUGH = MotionError(cost=1e-12, joints=1e-8, tip=1e-5)
"""Errors below which finer grids would measure rounding."""
REPEATS = 7
"""Solves by which a time is judged, after the first."""
CLIMBING = 0.6
"""Share of the budget in which first solves may start."""
SLOWEST = 0.1
"""Share of the budget that one solve may take."""
HOPELESS = 30.0
"""A method stops where another one was more accurate in so many times less time."""
_GROWTH = 2.0  # of time from one number of intervals to the next, at most


@dataclass(eq=False)
class _Climber:
    """A method on its way up the ladder."""

    method: Method
    rungs: list[tuple[Prepared, Run]] = field(default_factory=list)
    climbing: bool = True

    def expected(self) -> float:
        """Time of the next first solve, by that of the last, in [s]."""
        return _GROWTH * self.rungs[-1][1].cold_seconds if self.rungs else 0.0


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
    yardstick: Yardstick,
    budget: Budget,
    progress: Progress,
    share: float = 1.0,
    repeats: int = REPEATS,
) -> Measured:
    """Every method on every grid of the ladder, until it is exact or the time is up.

    First solves come first, all methods on one number of intervals and then on the next. The
    repeats follow in rounds over all runs, so that a busy moment of the machine meets all alike.

    budget: of which `share` may be spent. repeats: of every run that counts.
    """
    climbers = [_Climber(method) for method in methods]
    notes, complete = [], True
    for intervals in LADDER:
        for climber in [each for each in climbers if each.climbing]:
            if not budget.allows(climber.expected(), CLIMBING * share):
                climber.climbing = complete = False
                continue
            progress(f"{climber.method.name} on {intervals} intervals", budget.fraction)
            try:
                run = _climb(climber, intervals, yardstick)
                slow = run.first_seconds > SLOWEST * budget.seconds or _beaten(run, climbers)
                climber.climbing = not slow and not _exact(run.error)
            except UnmeasurableError as refused:
                climber.climbing = False
                notes.append(f"{climber.method.name}: {refused}")
    _repeat(climbers, budget, progress, share, repeats)
    runs = tuple(run for climber in climbers for _, run in climber.rungs)
    return Measured(runs, complete, tuple(notes))


def _climb(climber: _Climber, intervals: int, yardstick: Yardstick) -> Run:
    """One more grid."""
    prepared = climber.method.prepare(intervals)
    run = _first(climber.method, intervals, prepared, yardstick)
    climber.rungs.append((prepared, run))
    return run


def _exact(error: MotionError) -> bool:
    return all(getattr(error, m) <= getattr(ENOUGH, m) for m in ("cost", "joints", "tip"))


def _beaten(run: Run, climbers: list[_Climber]) -> bool:
    """Whether finer grids of a method have no hope of being worth their time."""
    others = [other for climber in climbers for _, other in climber.rungs if other.counts]
    return any(
        other.error.cost <= run.error.cost and HOPELESS * other.first_seconds <= run.first_seconds
        for other in others
    )


def _first(method: Method, intervals: int, prepared: Prepared, yardstick: Yardstick) -> Run:
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
        error=_error(answer, yardstick),
        setup_seconds=prepared.seconds,
        first_seconds=answer.seconds,
    )


def _error(answer: Answer, yardstick: Yardstick) -> MotionError:
    if not math.isfinite(answer.cost):
        return MotionError(math.inf, math.inf, math.inf)
    return yardstick.error(answer.cost, answer.configurations)


def _repeat(
    climbers: list[_Climber], budget: Budget, progress: Progress, share: float, repeats: int
) -> None:
    """Rounds over all runs that count, as many as the budget allows."""
    for number in range(repeats):
        for climber in climbers:
            for i, (prepared, run) in enumerate(climber.rungs):
                if not (run.counts and budget.allows(run.first_seconds, share)):
                    continue
                progress(f"repeat {number + 1} of {repeats}, {run.method}", budget.fraction)
                seconds = (*run.repeats, prepared.solve().seconds)
                climber.rungs[i] = prepared, dataclasses.replace(run, repeats=seconds)
