"""The duration of least cost plus weight times duration.

With J(T) the minimal cost for the duration T, J(T) + w T has a minimum where J'(T) = -w, that is,
where Pontryagin's Hamiltonian equals w. The derivative of the discrete action is exact (see
DiscreteLagrangian.duration_derivative). Each motion is the guess for the next, and the root is
bracketed; limits and constraints need no special treatment.

With a tolerance two searches alternate: for the best duration on a grid, and for a grid that is
fine enough at that duration. Each hardly changes the result of the other.
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
"""Solves for a duration in [s], from a guess."""
OnGrid = Callable[[Grid], SolveFor]
"""Returns a solver on a grid, scaled to each duration."""
Refine = Callable[[Solution], Solution]
"""Refines a motion of fixed duration to the tolerance; keeps its grid if that is fine enough."""

MAX_GRIDS = 4
"""Maximum number of grids on which the best duration is computed."""
FINER_GRID_STRIDE = 1.001
"""Ratio of the first two durations on a finer grid."""
MAX_STRIDE = 1.3
"""Maximum ratio of successive durations while a bracket is sought."""
DURATION_PRECISION = 1e-12
"""Relative tolerance of the duration."""


@dataclass(frozen=True)
class FreeDuration:
    """Bounds and weight of a free duration.

    lower, upper: in [s]. weight: w, in cost per [s]; 0 minimises the cost alone.
    Raises InputError unless 0 < lower < upper and the weight is finite and not negative.
    """

    lower: float
    upper: float
    weight: float = 0.0

    def __post_init__(self) -> None:
        if not (0 < self.lower < self.upper < np.inf):
            raise InputError(
                f"a free duration must be a pair 0 < lower < upper in seconds, got "
                f"({self.lower}, {self.upper})."
            )
        if not (np.isfinite(self.weight) and self.weight >= 0):
            raise InputError(f"the weight of time must be 0 or more, got {self.weight}.")

    @property
    def first(self) -> float:
        """The first duration of the search: the geometric mean of the bounds, in [s]."""
        return float(np.sqrt(self.lower * self.upper))


@dataclass(frozen=True, eq=False)
class BestDuration:
    """The motion at the best duration, its cost without w T.

    steps: of the optimiser, in all solves. ending: words of the message before the duration.
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
    free: FreeDuration, solve: SolveFor, first: Solution, stride: float = MAX_STRIDE
) -> BestDuration:
    """A motion whose duration is a local minimum of cost + w T between the bounds.

    first: a solution for some duration between them, which is followed to other durations.
    stride: ratio of the first two durations; it is squared in each step, up to MAX_STRIDE.
    A motion that is not a minimum is returned unchanged.
    """
    search = _Search(free, solve, first, stride)
    best = search.run()
    return BestDuration(free, best, search.steps, search.ending)


def solve_duration(free: FreeDuration, solve: SolveFor, first: Solution) -> Solution:
    """As best_duration, with w T included in the cost."""
    return best_duration(free, solve, first).with_time()


class _Search:
    """Brackets the root of J' + w by strides from the first duration, then uses Brent's method."""

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
            self.stride = min(self.stride**2, MAX_STRIDE)
            further = float(np.clip(further, self.free.lower, self.free.upper))
            try:
                next_slope = self.at(further)
                if np.sign(next_slope) != np.sign(slope):
                    self.between({T: slope, further: next_slope})
                    break
            except _FailedError as failed:
                return self.unfinished(failed.solution)
            except KeyboardInterrupt:  # between two solves, which handle their own
                record_interrupt()
                self.ending = "The search for the best one was interrupted; the last duration is"
                return dataclasses.replace(self.best, success=False, status=Status.INTERRUPTED)
            T, slope = further, next_slope
        return self.best

    def between(self, known: dict[float, float]) -> None:
        """Brent's method for the root of J' + w. known: slopes at both ends of a bracket."""
        from scipy.optimize import brentq  # takes a quarter of a second to import

        def slope_at(T: float) -> float:
            if T not in known:
                known[T] = self.at(T)
            return known[T]

        a, b = known
        xtol, rtol = DURATION_PRECISION * min(a, b), 4 * np.finfo(float).eps
        root = float(brentq(slope_at, a, b, xtol=xtol, rtol=rtol, disp=False))
        if self.best.trajectory.duration != root:
            self.at(root)

    def at(self, T: float) -> float:
        """Solve for a duration from the best motion so far; returns J' + w.

        Raises _FailedError if no minimum is found.
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
        """The last minimum, with the reason why the search ended."""
        T = failed.trajectory.duration
        self.ending = f"For {T:.6g} s no minimum was found ({failed.status}); the last duration is"
        return dataclasses.replace(self.best, success=False, status=failed.status)


class _FailedError(Exception):
    """A duration for which no minimum was found."""

    def __init__(self, duration: float, solution: Solution) -> None:
        super().__init__(duration)
        self.solution = solution


def free_to_tolerance(
    free: FreeDuration, on_grid: OnGrid, refine: Refine, first: Solution
) -> Solution:
    """A motion within a tolerance, whose duration is the best one on its grid.

    first: a solution for some duration between the bounds, on a coarse grid.
    The accuracy is that of the motion for its fixed duration, relative to the cost without w T.
    Since J' + w vanishes, an error of the duration changes the cost to second order only.
    If a later round fails, the motion within the tolerance of the round before is returned; after
    an interrupt it counts as no success.
    """
    found = best_duration(free, on_grid(first.trajectory.grid), first)
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
        found = dataclasses.replace(found, solution=refined)
        if not refined.accuracy.reached:
            break
        kept = found
        if settled or number == MAX_GRIDS - 1:
            break
        found = best_duration(free, on_grid(refined.trajectory.grid), refined, FINER_GRID_STRIDE)
        steps += found.steps - refined.nit
    best = found if kept is None or kept is found else _with_failure(kept, found.solution)
    return _with_rounds(dataclasses.replace(best, steps=steps), rounds)


def _with_failure(kept: BestDuration, failed: Solution) -> BestDuration:
    """The last motion within the tolerance, with the reason why the next round failed."""
    reason = str(failed.status) if not failed.success else "the tolerance was not reached again"
    ending = f"The search on a finer grid failed ({reason}); the best duration on a coarser one is"
    solution = kept.solution
    if failed.status is Status.INTERRUPTED:  # so that the search ends
        solution = dataclasses.replace(solution, success=False, status=failed.status)
    return dataclasses.replace(kept, solution=solution, ending=ending)


def _with_rounds(found: BestDuration, rounds: tuple[Round, ...]) -> Solution:
    """The solution with all rounds, and with its accuracy in the message if it was estimated."""
    solution = found.with_time()
    if solution.accuracy is None:
        return solution
    accuracy = dataclasses.replace(solution.accuracy, rounds=rounds)
    message = f"{solution.message.removesuffix('.')}; {accuracy}"
    return dataclasses.replace(solution, message=message, accuracy=accuracy)
