"""The duration of least cost plus weight times duration, by solves for given durations.

For problems whose duration cannot be an unknown of the motion: see joint_duration.

With J(T) the minimal cost for the duration T, J(T) + w T has a minimum where J'(T) = -w, that is,
where Pontryagin's Hamiltonian equals w. The derivative of the discrete action is exact (see
DiscreteLagrangian.duration_derivative). Each motion is the guess for the next, and the root is
bracketed; limits and constraints need no special treatment.

J + w T may decrease up to a bound of the duration, or up to durations that are infeasible. If a
duration fails, the search approaches it by bisection, which brackets the edge of feasibility.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.time_price import TimePrice
from hovi.planning.search.continuation import how_ended
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import STOPPED, Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import OutOfTimeError
from hovi.system.interruption import record_interrupt

SolveFor = Callable[[float, Trajectory], Solution]
"""Solves for a duration in [s], from a guess."""

PROBES = 4, 2
"""Numbers of other first durations, on the more and on the less promising side."""
OTHER_FRACTIONS = 0.25, 0.75, 0.0, 1.0
"""Fractions of the way from log lower to log upper at which further starts begin; the first one
begins in the middle."""
MAX_STRIDE = 1.3
"""Maximum ratio of successive durations while a bracket is searched for."""
DURATION_PRECISION = 1e-12
"""Relative tolerance of the duration."""
LEAST_PRECISION = 4 * np.finfo(float).eps
"""Least relative tolerance that scipy.optimize.brentq accepts."""
SLOPE_PRECISION = 1e-10
"""Tolerance of J' + w, relative to (J + w T) / T."""
MIN_KINK = 1e-6
"""Slope J' + w at a change of sign that indicates a kink or a jump, relative to (J + w T) / T."""
JUMP_BRACKET = 1e-4
"""Relative width of a bracket below which jumps of J + w T are detected."""
MIN_JUMP, MAX_GRID_JUMP = 1e-7, 1e-2
"""Relative jumps of J + w T: the least to be detected, the largest ascribed to split intervals."""
EDGE_PRECISION = 1e-3
"""Relative tolerance of the duration at the edge of feasibility."""
MAX_DURATIONS = 100
"""Maximum number of durations that are solved for."""


@dataclass(frozen=True)
class FreeDuration:
    """Bounds and weight of a free duration.

    lower, upper: of the length of the part that is free, in [s]. weight: w, in cost per [s]; 0
        minimises the cost alone. clock: which part of the motion that is.
    Raises InputError unless 0 < lower < upper and the weight is finite and not negative.
    """

    lower: float
    upper: float
    weight: float = 0.0
    clock: Clock = Clock()

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
        """The first length of the search: the geometric mean of the bounds, in [s]."""
        return float(np.sqrt(self.lower * self.upper))

    @property
    def price(self) -> TimePrice:
        """The price of time and the bounds, of a single part."""
        return TimePrice(self.weight, np.array([self.lower]), np.array([self.upper]), self.clock)

    def length(self, solution: Solution) -> float:
        """The length of the free part of a motion, in [s]."""
        return self.clock.length(solution.trajectory.grid)

    def slope(self, solution: Solution) -> float:
        """J' + w of a minimum, in cost per [s]."""
        return solution.derivative_in_time(self.clock.rates) + self.weight

    @property
    def others(self) -> list[float]:
        """First lengths of further starts, in [s]."""
        ratio = self.upper / self.lower
        return [self.lower * ratio**fraction for fraction in OTHER_FRACTIONS]

    def probes(self, limited: bool) -> list[float]:
        """Other first durations, in [s], from the geometric mean to each bound.

        limited: longer ones come first, as limits bind at short durations; else shorter ones.
        """
        bounds = (self.upper, self.lower) if limited else (self.lower, self.upper)
        return [
            float(T)
            for bound, count in zip(bounds, PROBES, strict=True)
            for T in np.geomspace(self.first, bound, count + 1)[1:]
        ]


@dataclass(frozen=True, eq=False)
class BestDuration:
    """The motion at the best duration.

    steps: of the optimiser, in all solves. ending: words of the message before the duration.
    reason: why the search ended early; "" if it did not, or if the motion is not a minimum.
    at_edge: whether durations next to it, at which less cost is expected, are infeasible.
    steepest: slope |J' + w| that a jump of the cost next to it on this grid explains, in cost per
        [s]; 0 for none.
    """

    free: FreeDuration
    solution: Solution
    steps: int
    ending: str
    reason: str = ""
    at_edge: bool = False
    steepest: float = 0.0

    def with_time(self) -> Solution:
        """The motion as a solution whose cost includes w T, and whose message says so."""
        best, weight = self.solution, self.free.weight
        T = best.trajectory.duration
        cost = action_of(best) + weight * T
        parts = cost_in_parts(cost, weight * T, self.steps)
        message = f"{best.message} {self.ending} {T:.10g} s."
        if best.success:
            message = f"a minimum of cost {parts}. {self.ending} {T:.10g} s."
        elif self.reason:
            message = f"{best_so_far(self.reason, parts)}. {self.ending} {T:.10g} s."
        elif weight > 0:
            message = f"{message} Time adds {weight * T:.6g} to the cost."
        return dataclasses.replace(
            best,
            cost=cost,
            message=message,
            nit=self.steps,
            minima=(cost,) if best.success else (),
            history=(),
        )

    def unfinished(self, status: Status, reason: str) -> BestDuration:
        """The motion without success, since its duration is not known to be the best."""
        solution = dataclasses.replace(self.solution, success=False, status=status)
        return dataclasses.replace(self, solution=solution, ending="The duration is", reason=reason)


def best_duration(
    free: FreeDuration, solve: SolveFor, first: Solution, stride: float = MAX_STRIDE
) -> BestDuration:
    """A motion whose duration is a local minimum of cost + w T between the bounds.

    first: a solution for some duration between them, which is followed to other durations.
    stride: ratio of the first two durations; it is squared in each step, up to MAX_STRIDE.
    A success is a minimum for its duration, and J' + w vanishes there, or the duration is a bound,
    or, to EDGE_PRECISION, durations beyond it are infeasible or cost more, or the cost jumps there
    as intervals are split; the message says which.
    A first solution that is not a minimum is returned unchanged.
    """
    return _Search(free, solve, first, stride).run()


@dataclass(frozen=True, eq=False)
class _Trial:
    """A solution for a duration. duration: of its free part as requested, in [s]."""

    duration: float
    solution: Solution
    free: FreeDuration

    @property
    def success(self) -> bool:
        """Whether it is a minimum for its duration."""
        return self.solution.success

    @property
    def total(self) -> float:
        """J + w T."""
        return action_of(self.solution) + self.free.weight * self.duration

    @property
    def slope(self) -> float:
        """J' + w, in cost per [s]."""
        return self.free.slope(self.solution)

    def downhill_to(self, other: _Trial) -> bool:
        """Whether J + w T decreases from here towards the duration of another trial."""
        return self.slope * (other.duration - self.duration) < 0

    def steeper_than(self, fraction: float) -> bool:
        """Whether |J' + w| exceeds a fraction of (J + w T) / T."""
        return abs(self.slope) > fraction * abs(self.total) / self.duration

    def gap_to(self, other: _Trial) -> float:
        """Relative difference of the durations."""
        return abs(self.duration / other.duration - 1)


class _StoppedError(Exception):
    """The search was stopped, by the time limit, an interrupt or the number of durations."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status = status
        self.reason = reason


class _FailedError(Exception):
    """A duration within a bracket for which no minimum was found."""

    def __init__(self, trial: _Trial) -> None:
        super().__init__(trial.duration)
        self.trial = trial


class _Search:
    """Strides in the direction of decreasing J + w T, then Brent's method or bisection.

    here: the current minimum. beyond: the nearest trial in the direction of decrease that failed
    or costs more, if any; the search continues between the two.
    ending: words of the message before the duration; "" until the search has converged.
    """

    def __init__(self, free: FreeDuration, solve: SolveFor, first: Solution, stride: float) -> None:
        self.free = free
        self.solve = solve
        self.stride = stride
        self.steps = first.nit
        self.durations = 0
        T = float(np.clip(free.length(first), free.lower, free.upper))
        self.beyond: _Trial | None = None
        self.ending, self.steepest = "", 0.0
        self._move_to(_Trial(T, first, free))

    def run(self) -> BestDuration:
        """The motion at the best duration, or the best so far if the search ended early."""
        try:
            while not self.ending:
                T = self._next_duration()
                if T is None:
                    return self._at_an_edge()
                self._take(self._at(T, self.here))
        except _StoppedError as stopped:
            return self._best().unfinished(stopped.status, stopped.reason)
        except OutOfTimeError:
            return self._best().unfinished(Status.TIME_LIMIT, ended_search(Status.TIME_LIMIT))
        except KeyboardInterrupt:  # between two solves, which handle their own
            record_interrupt()
            return self._best().unfinished(Status.INTERRUPTED, ended_search(Status.INTERRUPTED))
        return self._best()

    def _best(self) -> BestDuration:
        known = self.free, self.here.solution, self.steps, self.ending
        return BestDuration(*known, steepest=self.steepest)

    def _next_duration(self) -> float | None:
        """The next duration in [s]; None at a bound or at the edge of feasibility."""
        here, beyond = self.here, self.beyond
        if beyond is None:
            return self._stride()
        if here.gap_to(beyond) > EDGE_PRECISION:
            return float(np.sqrt(here.duration * beyond.duration))
        return None

    def _stride(self) -> float | None:
        """A duration in the direction of decrease, in [s]; None at a bound."""
        here, shorter = self.here.duration, self.here.slope > 0
        bound = self.free.lower if shorter else self.free.upper
        if abs(here / bound - 1) <= DURATION_PRECISION:
            return None
        further = here / self.stride if shorter else here * self.stride
        self.stride = min(self.stride**2, MAX_STRIDE)
        return max(further, bound) if shorter else min(further, bound)

    def _take(self, trial: _Trial) -> None:
        """Move to a trial, bracket a root with it, or keep it as the one beyond."""
        here = self.here
        if not trial.success:
            self.beyond = trial
        elif trial.downhill_to(here):
            self._between(here, trial)
        elif trial.total > here.total:
            self.beyond = trial
        else:
            self._move_to(trial)

    def _move_to(self, trial: _Trial) -> None:
        """Continue from a trial; the search ends if it is not a minimum or is stationary."""
        self.here = trial
        if not trial.success:
            self.ending = "The duration is"
        elif not trial.steeper_than(SLOPE_PRECISION):
            self.ending = "The best duration is"

    def _between(self, a: _Trial, b: _Trial) -> None:
        """Brent's method for the root of J' + w between two minima.

        If a solve fails or J + w T jumps in between, the search continues from the cheaper side.
        """
        from scipy.optimize import brentq  # takes a quarter of a second to import

        known = {a.duration: a, b.duration: b}

        def slope_at(T: float) -> float:
            if T not in known:
                trial = self._at(T, min(known.values(), key=lambda near: abs(near.duration - T)))
                if not trial.success:
                    raise _FailedError(trial)
                known[T] = trial
                self.here = min(self.here, trial, key=lambda each: each.total)
            settled = not known[T].steeper_than(SLOPE_PRECISION) or _jumps(*_sides(known, T))
            return 0.0 if settled else known[T].slope

        self.here = min(a, b, key=lambda each: each.total)  # in case the search is stopped
        ends = a.duration, b.duration
        xtol, rtol = DURATION_PRECISION * min(ends), LEAST_PRECISION
        try:
            root = float(brentq(slope_at, *ends, xtol=xtol, rtol=rtol, disp=False))
            slope_at(root)
        except _FailedError as failed:
            self.here, _ = _sides(known, failed.trial.duration)
            self.beyond = failed.trial
        else:
            self._close(known, root)

    def _close(self, known: dict[float, _Trial], root: float) -> None:
        """Take the result of Brent's method: a root, or a kink or a jump of J + w T."""
        if not known[root].steeper_than(MIN_KINK):
            self.here, self.ending = known[root], "The best duration is"
            return
        self.here, costlier = _sides(known, root)
        jump = (costlier.total - self.here.total) / abs(self.here.total)
        if jump <= MAX_GRID_JUMP:
            T, gap = self.here.duration, self.here.gap_to(costlier)
            explained = max(jump, MIN_KINK) * abs(self.here.total) / T
            self.steepest = explained / max(gap, JUMP_BRACKET)
            self.here = min(known.values(), key=lambda each: each.total)
            self.ending = f"The best duration, next to a jump of the cost by {jump:.0e} of it, is"
        else:
            self.beyond = costlier

    def _at(self, T: float, guess: _Trial) -> _Trial:
        """Solve for a duration from another motion.

        Raises _StoppedError if no other solve may follow.
        """
        if self.durations == MAX_DURATIONS:
            raise _StoppedError(
                Status.ITERATION_LIMIT,
                f"the best duration was not found among {MAX_DURATIONS} durations",
            )
        self.durations += 1
        solution = self.solve(T, guess.solution.trajectory)
        self.steps += solution.nit
        if solution.status in STOPPED:
            raise _StoppedError(solution.status, ended_search(solution.status))
        return _Trial(T, solution, self.free)

    def _at_an_edge(self) -> BestDuration:
        """The motion at a bound, or next to durations that failed or cost more."""
        best, beyond = self._best(), self.beyond
        if beyond is None:
            return dataclasses.replace(best, ending="The duration is kept at its bound,")
        extreme = "shortest" if beyond.duration < self.here.duration else "longest"
        edge = f"The best duration, to {100 * EDGE_PRECISION:g} % the {extreme} one"
        if beyond.success:
            return dataclasses.replace(best, ending=f"{edge} before motions cost more, is")
        status = beyond.solution.status
        if status is Status.INFEASIBLE:
            return dataclasses.replace(best, ending=f"{edge} found feasible, is", at_edge=True)
        at = f"{beyond.solution.trajectory.duration:.6g} s, where less cost is expected"
        return best.unfinished(status, f"for {at}, the solve ended in {status}")


def _sides(known: dict[float, _Trial], T: float) -> tuple[_Trial, _Trial]:
    """The minima next to a duration on both sides, the cheaper first.

    On each side J + w T decreases towards the other, which decides for a minimum at T itself.
    """
    shorter = [t for t in known.values() if t.slope < 0 and t.duration <= T]
    longer = [t for t in known.values() if t.slope >= 0 and t.duration >= T]
    ends = max(shorter, key=lambda t: t.duration), min(longer, key=lambda t: t.duration)
    return (ends[0], ends[1]) if ends[0].total <= ends[1].total else (ends[1], ends[0])


def _jumps(a: _Trial, b: _Trial) -> bool:
    """Whether two neighbours differ by more than their slopes explain."""
    step = abs(a.duration - b.duration)
    explained = max(2 * max(abs(a.slope), abs(b.slope)) * step, MIN_JUMP * abs(a.total))
    return a.gap_to(b) <= JUMP_BRACKET and abs(a.total - b.total) > explained


def cost_in_parts(cost: float, time: float, steps: int) -> str:
    """A cost with the price of time in it, and after how many steps it was reached."""
    return f"{cost:.10g}, {time:.6g} of it for time, after {steps} steps"


def best_so_far(reason: str, parts: str) -> str:
    """Why a search ended, a clause, and what its motion costs: see `cost_in_parts`."""
    return f"{reason}; the motion is the best so far, of cost {parts}"


def action_of(solution: Solution) -> float:
    """J of a motion, its cost without the price of time."""
    problem = solution.problem
    return solution.cost - (0.0 if problem is None else price_of_time(problem))


def ended_search(status: Status) -> str:
    """Why a search ended, as a clause."""
    return f"the search for the best duration {how_ended(status)}"
