"""The duration of least cost plus weight times duration.

Where the cost J(T) of the motion that solves the problem in time T is least together with w T, its
derivative is J'(T) = -w: Pontryagin's Hamiltonian is w. The derivative comes exactly from the
discrete action (see DiscreteLagrangian.duration_derivative), every motion is the guess of the
next, and the root is bracketed, so that limits and equations need nothing of their own.

With a tolerance two searches alternate: the best duration on a grid, and a grid that is fine enough
for the motion of that duration. A finer grid hardly moves the duration, and another duration hardly
asks for another grid.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hovi.discrete.grid import Grid
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.tolerance import Round
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.system.interruption import record_interrupt

SolveFor = Callable[[float, Trajectory], Solution]
"""The solution for a duration in [s], from a guess."""
OnGrid = Callable[[Grid], SolveFor]
"""What solves on a grid that is stretched to a duration."""
Refine = Callable[[Solution], Solution]
"""The motion within the tolerance, for its duration; on its own grid where that is fine enough."""

MAX_GRIDS = 4
"""Grids on which the best duration is looked for."""
FINER_GRID_STRIDE = 1.001
"""Ratio of the first two durations that are tried on a finer grid."""
STRIDE = 1.3
"""Ratio of two durations while a bracket is looked for."""
PRECISION = 1e-12
"""Of the duration, relative."""


@dataclass(frozen=True)
class FreeDuration:
    """Bounds and weight of a free duration.

    lower, upper: in [s]. weight: w, in cost per [s]; 0 asks for the cost alone.
    Raises InputError for bounds that do not rise or a weight that is not finite.
    """

    lower: float
    upper: float
    weight: float = 0.0

    def __post_init__(self) -> None:
        if not (0 < self.lower < self.upper < np.inf):
            raise InputError(
                f"a free duration is a pair 0 < lower < upper in seconds, got "
                f"({self.lower}, {self.upper})."
            )
        if not (np.isfinite(self.weight) and self.weight >= 0):
            raise InputError(f"the weight of time must be 0 or more, got {self.weight}.")

    @property
    def first(self) -> float:
        """Where the search starts: the geometric mean of the bounds, in [s]."""
        return float(np.sqrt(self.lower * self.upper))


@dataclass(frozen=True, eq=False)
class BestDuration:
    """The motion at the best duration, its cost without w T.

    steps: of the optimiser, in all solves. ending: what is to be said before the duration.
    """

    free: FreeDuration
    solution: Solution
    steps: int
    ending: str

    def with_time(self) -> Solution:
        """The motion as a solution whose cost includes w T."""
        best, weight = self.solution, self.free.weight
        T = best.trajectory.duration
        cost = best.cost + weight * T
        message = f"{best.message} {self.ending} {T:.10g} s."
        if best.success:
            message = (
                f"a minimum of cost {cost:.10g}, {weight * T:.6g} of it for time, after "
                f"{self.steps} steps. {self.ending} {T:.10g} s."
            )
        minima = (cost,) if best.success else ()
        return dataclasses.replace(
            best, cost=cost, message=message, nit=self.steps, minima=minima, history=()
        )


def best_duration(
    free: FreeDuration, solve: SolveFor, first: Solution, stride: float = STRIDE
) -> BestDuration:
    """A motion whose duration is a local minimum of cost + w T between the bounds.

    first: a solution for some duration between them; its valley is followed.
    stride: ratio of the first two durations; its square is the next, up to STRIDE.
    A motion that is not a minimum is returned as it is.
    """
    search = _Search(free, solve, first, stride)
    best = search.run()
    return BestDuration(free, best, search.steps, search.ending)


def solve_duration(free: FreeDuration, solve: SolveFor, first: Solution) -> Solution:
    """As best_duration, with a cost that includes w T."""
    return best_duration(free, solve, first).with_time()


class _Search:
    """A bracket by strides from the first duration, then Brent's root of J' + w."""

    def __init__(self, free: FreeDuration, solve: SolveFor, first: Solution, stride: float) -> None:
        self.free = free
        self.solve = solve
        self.stride = stride
        self.best = first
        self.steps = first.nit
        self.ending = "The best duration is" if first.success else "The duration is"

    def run(self) -> Solution:
        """The motion at the best duration, or the last minimum where a solve failed."""
        T = self.best.trajectory.duration
        slope = self.slope(self.best)
        while self.best.success and slope != 0.0:
            bound = self.free.lower if slope > 0 else self.free.upper
            if bound == T:
                self.ending = "The duration is kept at its bound,"
                break
            further = T / self.stride if slope > 0 else T * self.stride
            self.stride = min(self.stride**2, STRIDE)
            further = float(np.clip(further, self.free.lower, self.free.upper))
            try:
                next_slope = self.at(further)
                if np.sign(next_slope) != np.sign(slope):
                    self.between({T: slope, further: next_slope})
                    break
            except _FailedError as failed:
                return self.unfinished(failed.solution)
            except KeyboardInterrupt:  # between two solves, each of which hears its own
                record_interrupt()
                self.ending = "The search for a better one was interrupted; the last duration is"
                return dataclasses.replace(self.best, success=False, status=Status.INTERRUPTED)
            T, slope = further, next_slope
        return self.best

    def between(self, known: dict[float, float]) -> None:
        """Brent's method on a bracket, of which both slopes are known, to where J' + w vanishes."""
        from scipy.optimize import brentq  # a quarter of a second, for free durations alone

        def slope_at(T: float) -> float:
            if T not in known:
                known[T] = self.at(T)
            return known[T]

        a, b = known
        xtol, rtol = PRECISION * min(a, b), 4 * np.finfo(float).eps
        root = float(brentq(slope_at, a, b, xtol=xtol, rtol=rtol, disp=False))
        if self.best.trajectory.duration != root:
            self.at(root)

    def at(self, T: float) -> float:
        """Solve for a duration from the best motion so far; J' + w there.

        Raises _FailedError where that is no minimum.
        """
        solution = self.solve(T, self.best.trajectory)
        self.steps += solution.nit
        if not solution.success:
            raise _FailedError(T, solution)
        self.best = solution
        return self.slope(solution)

    def slope(self, solution: Solution) -> float:
        """J' + w, in cost per [s]."""
        return solution.duration_derivative + self.free.weight

    def unfinished(self, failed: Solution) -> Solution:
        """The last minimum, with the reason why the search went no further."""
        T = failed.trajectory.duration
        self.ending = f"For {T:.6g} s none was found ({failed.status}); the last duration is"
        return dataclasses.replace(self.best, success=False, status=failed.status)


class _FailedError(Exception):
    """A duration for which no minimum was found."""

    def __init__(self, duration: float, solution: Solution) -> None:
        super().__init__(duration)
        self.solution = solution


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
    for turn in range(MAX_GRIDS):
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
        if settled or turn == MAX_GRIDS - 1:
            break
        found = best_duration(free, on_grid(refined.trajectory.grid), refined, FINER_GRID_STRIDE)
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
