"""The best durations of the segments of a sequence: all in one solve where that is supported.

Else one after the other until none changes. With a motion at its minimum for given durations, the
cost J + w T changes with the duration of each segment by minus its Hamiltonian plus w. So each
duration is searched for as that of a single motion is, with the others as they are; where the
motion rests between segments, they do not depend on each other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.planning.problem.clock import Clock
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.search.free_duration import (
    EDGE_PRECISION,
    MAX_STRIDE,
    BestDuration,
    FreeDuration,
    action_of,
    best_so_far,
    cost_in_parts,
    ended_search,
)
from hovi.planning.search.job import Job
from hovi.planning.search.joint_duration import (
    NEXT_STRIDE,
    OnGrid,
    best_on_its_grid,
    is_best,
    unless_best,
)
from hovi.planning.solver.solver import Solution
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.system.dataclass import dataclass

MAX_SWEEPS = 10
"""Maximum number of searches for the duration of every segment."""

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
SolverOf = Callable[[Job, Clock], OnGrid]
"""Returns a solver of a job on a grid, whose free part has each length."""
JointSolveOf = Callable[[TimePrice, Array, Solution], Solution | None]
"""Solves for lengths of parts, too, from those of a motion; None where that is not supported."""


@dataclass(frozen=True)
class FreeSegments:
    """Free durations of segments.

    bounds: of the duration of each segment, in [s], equal for a given one. weight: w of time.
    """

    bounds: tuple[tuple[float, float], ...]
    weight: float = 0.0

    @classmethod
    def of(cls, durations: Sequence[float | tuple[float, float]], weight: float) -> Self:
        """Those of segments with these durations, in [s], or bounds of them."""
        return cls(tuple(T if isinstance(T, tuple) else (T, T) for T in durations), weight)

    @property
    def first(self) -> list[list[float]]:
        """First durations of the segments, in [s]: geometric means, and then the longest ones.

        Limits bind at short durations.
        """
        means = [float(np.sqrt(lower * upper)) for lower, upper in self.bounds]
        longest = [upper for _, upper in self.bounds]
        return [means, longest] if self.any else [longest]

    @property
    def chosen(self) -> Mask:
        """Which durations are free, one for each segment."""
        lower, upper = np.array(self.bounds).T
        return np.asarray(lower < upper)

    @property
    def any(self) -> bool:
        """Whether any duration is free."""
        return bool(self.chosen.any())

    def part(self, number: int, job: Job) -> FreeDuration | None:
        """The duration of a segment, with those of a job in the others; None for a given one."""
        lower, upper = self.bounds[number]
        if lower == upper:
            return None
        begin, end = _ends(job)[number : number + 2]
        return FreeDuration(lower, upper, self.weight, Clock((begin, job.grid.duration - end)))

    def all_parts(self, lengths: Array) -> TimePrice:
        """The price of time of all free segments. lengths: of all segments, in [s]."""
        lower, upper = np.array(self.bounds).T
        clock = Clock.of_parts(len(lower))
        return TimePrice(self.weight, lower, upper, clock).with_given(lengths, ~self.chosen)


def best_segments(
    free: FreeSegments, job: Job, first: Solution, solver_of: SolverOf, jointly: JointSolveOf
) -> tuple[Job, Solution, str]:
    """The job with the best durations of its segments, its motion, and what else to say of these.

    first: the motion of the job, with its problem. The motion is no success unless the duration of
    every segment is the best one, with those of the others as they are.
    """
    if _all_are_best(free, job, first):
        return job, first, ""
    together = _all_at_once(free, job, first, jointly)
    if together is None:
        return _one_by_one(free, job, first, solver_of)
    job, best = together
    if not best.success or _all_are_best(free, job, best):
        return job, best, ""
    return _one_by_one(free, job, best, solver_of)


def _all_are_best(free: FreeSegments, job: Job, motion: Solution) -> bool:
    """Whether every duration is the best one, with those of the others as they are."""
    parts = (free.part(number, job) for number in range(len(free.bounds)))
    found = (BestDuration(part, motion, motion.nit, "") for part in parts if part is not None)
    return all(is_best(each) for each in found)


def _all_at_once(
    free: FreeSegments, job: Job, first: Solution, jointly: JointSolveOf
) -> tuple[Job, Solution] | None:
    """The job and the motion by one solve for all durations; None where that does not succeed."""
    now = np.diff(_ends(job))
    price = free.all_parts(now)
    found = jointly(price, now[free.chosen], first)
    problem = None if found is None else found.problem
    if found is None or problem is None:
        return None
    found = dataclasses.replace(found, nit=first.nit + found.nit)
    if not found.success:
        found = _stopped(found, price.weight)
    grid, lagrangian = found.trajectory.grid, problem.ld.lagrangian
    assert isinstance(lagrangian, SegmentedLagrangian)
    lengths = np.diff([0.0, *lagrangian.ends, grid.duration])
    return job.lasting(Clock.of_parts(len(now)), lengths, now=now, grid=grid), found


def _stopped(found: Solution, weight: float) -> Solution:
    """The best motion of a solve that was stopped, whose message counts all steps and the time."""
    time = weight * found.trajectory.duration
    cost, why = action_of(found) + time, ended_search(found.status)
    message = f"{best_so_far(why, cost_in_parts(cost, time, found.nit))}."
    return dataclasses.replace(found, cost=cost, message=message)


def _one_by_one(
    free: FreeSegments, job: Job, first: Solution, solver_of: SolverOf
) -> tuple[Job, Solution, str]:
    """As `best_segments`, with a search for one duration after the other."""
    best, steps, found = first, first.nit, dict[int, BestDuration]()
    for _ in range(MAX_SWEEPS):
        changed = False
        for number in range(len(free.bounds)):
            part, known = free.part(number, job), found.get(number)
            if part is None or (known is not None and is_best(_again(known, part, best))):
                continue
            stride = MAX_STRIDE if known is None else NEXT_STRIDE
            reached = best_on_its_grid(part, solver_of(job, part.clock), best, stride)
            changed, found[number] = True, reached
            steps, best = steps + reached.steps - best.nit, reached.solution
            job = job.lasting(part.clock, part.length(best), grid=best.trajectory.grid)
            if not best.success:
                reached = dataclasses.replace(reached, steps=steps)
                return job, reached.with_time(), ""
        if not changed:
            break
    for number, known in found.items():
        part = free.part(number, job)
        assert part is not None
        again = dataclasses.replace(_again(known, part, best), steps=steps)
        if not is_best(again):
            best = unless_best(again).with_time()
    edges = [number for number, known in found.items() if known.at_edge]
    said = "".join(
        f" That of segment {number + 1} is, to {100 * EDGE_PRECISION:g} %, the last one for which "
        "a motion was found, with less cost expected beyond."
        for number in edges
    )
    return job, dataclasses.replace(best, nit=steps), said


def _again(found: BestDuration, part: FreeDuration, motion: Solution) -> BestDuration:
    """What was found for a segment, with another motion."""
    return dataclasses.replace(found, free=part, solution=motion)


def _ends(job: Job) -> list[float]:
    """The times at which the segments begin and end, in [s]."""
    return [0.0, *job.ends, job.grid.duration]


def lengths_in_words(job: Job) -> str:
    """How long the segments of a job last, as a sentence."""
    lengths = [f"{T:.10g}" for T in np.diff(_ends(job))]
    return f"The segments last {', '.join(lengths[:-1])} and {lengths[-1]} s."
