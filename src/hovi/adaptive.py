"""Solve to a tolerance: start coarse, estimate the error, refine where it is, and stop in time."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import numpy.typing as npt

from hovi.error_estimate import estimate_against, finer_than
from hovi.errors import InputError
from hovi.finer_solution import FinerSolution, finer_grid
from hovi.grid import DiscretePath, Grid
from hovi.guess import stretched
from hovi.limits import TOLERANCE
from hovi.motion_error import relative_difference
from hovi.nodal_hamiltonian import nodal_hamiltonian
from hovi.problem import TrajectoryProblem
from hovi.refinement import Demand, decay, refined
from hovi.solver import Solution, solve
from hovi.tolerance import Accuracy, Quantity, Round, Tolerance
from hovi.trajectory import Trajectory

Array = npt.NDArray[np.float64]
Told = Callable[[Round], None]
"""What is told how far a search is."""

ROUNDS = 14
"""Grids that are tried."""
AIM = 0.3
"""Share of the tolerance that a refined grid aims at."""
ACCEPTED = 0.8
"""Share of the tolerance that an estimated error may have."""
CANCELLED = 20.0
"""How many times the tolerance the contributions of the intervals may sum up to where they
cancel in the cost."""
UNSTEADY = 0.1
"""Error of the cost that a spread of the nodal Hamiltonian speaks of, as a share of the spread."""
ROUNDING = 1e-14
"""Relative error of the cost that rounding may leave: no smaller one is claimed."""
CAUTION = 1.5
"""Factor on the difference from a finer solution under limits, which is not better by orders."""
BLUR = 10.0
"""Relative error of the cost that limits leave, in units of their tolerance: bounds are drawn in
by some tolerances, and may be exceeded by one."""
CONTRADICTED = 10.0
"""Ratio of the difference of costs on two grids and their errors beyond which it is no error: the
motion went on to another minimum."""
STALLED = 2
"""Rounds without a smaller error after which rounding, or the motion, sets the limit."""
MOST_POINTS = 400_000
"""Quadrature points of the finest grid."""


def solve_to_tolerance(
    problem: TrajectoryProblem,
    tolerance: Tolerance,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    told: Told | None = None,
) -> Solution:
    """A minimum whose estimated error is within a tolerance, on a grid that is just fine enough.

    problem: on the grid to begin with. guess, max_iterations: as for `solve`.
    time_limit: of everything, in [s]. told: called with every grid that was solved on.
    The solution's `accuracy` says what was reached, and why not more where it was not.
    """
    began = time.monotonic()
    first = solve(problem, guess, max_iterations=max_iterations, time_limit=time_limit)
    left = None if time_limit is None else max(time_limit - (time.monotonic() - began), 0.0)
    return refine_to_tolerance(
        first, tolerance, max_iterations=max_iterations, time_limit=left, told=told
    )


def refine_to_tolerance(
    solution: Solution,
    tolerance: Tolerance,
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    told: Told | None = None,
) -> Solution:
    """The same motion within a tolerance; arguments as for `solve_to_tolerance`."""
    deadline = None if time_limit is None else time.monotonic() + time_limit
    return _Search(tolerance, max_iterations, deadline, told).run(solution)


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A solution with what is known of its error."""

    solution: Solution
    finer: FinerSolution | None
    error: float
    whole: float
    """As the error, with contributions to the cost that do not cancel, and by the Hamiltonian."""
    contradicted: float = 0.0
    """Relative difference of the cost on the next grid, where it is far more than the error."""


@dataclass(eq=False)
class _Search:
    """The rounds of a search, which share budgets."""

    tolerance: Tolerance
    max_iterations: int
    deadline: float | None
    told: Told | None
    rounds: list[Round] = field(default_factory=list)
    best: _Candidate = field(init=False)

    def run(self, solution: Solution) -> Solution:
        """Refine until the error is small enough, or something ends it."""
        self.best = _Candidate(solution, None, np.nan, np.nan)
        try:
            reason = self._refine(solution)
        except KeyboardInterrupt:
            reason = "it was interrupted"
        return self._finished(self.best, reason)

    def _refine(self, solution: Solution) -> str:
        """The rounds; returns why they ended early, or ""."""
        candidate = self.best = self._estimated(solution)
        stalled = 0
        while not self._enough(candidate):
            reason = self._ended(candidate, stalled)
            if reason:
                return reason
            previous, candidate = candidate, self._next(candidate)
            if self.best is previous and _contradicts(candidate, previous):
                self.best = self._corrected(previous, candidate)
            smaller = candidate.error < 0.5 * self.best.error
            stalled = 0 if smaller or np.isnan(self.best.error) else stalled + 1
            if _better(candidate, self.best):
                self.best = candidate
        self.best = candidate
        return ""

    def _solved(self, problem: TrajectoryProblem, guess: Trajectory | DiscretePath) -> _Candidate:
        """Solve and estimate."""
        steps, left = self.max_iterations, self._left()
        return self._estimated(solve(problem, guess, max_iterations=steps, time_limit=left))

    def _estimated(self, solution: Solution) -> _Candidate:
        """A solution with what can be found out about its error."""
        began = time.perf_counter()
        finer = finer_than(solution) if solution.success else None
        error, whole = self._measure(solution, finer)
        grid = solution.trajectory.grid
        points = sum(len(scheme.points) * len(index) for scheme, index in grid.groups)
        seconds = solution.solve_seconds + time.perf_counter() - began
        done = Round(grid.intervals, points, solution.cost, error, solution.nit, seconds)
        self.rounds.append(done)
        if self.told is not None:
            self.told(done)
        return _Candidate(solution, finer, error, whole)

    def _measure(self, solution: Solution, finer: FinerSolution | None) -> tuple[float, float]:
        if finer is None:
            return np.nan, np.nan
        if self.tolerance.quantity is Quantity.COST:
            error = _error_of_cost(solution, finer)
            whole = max(error, float(_contributions(finer).sum()))
            if self._within(error, whole):  # else a finer grid is tried anyway
                whole = max(whole, _unsteady(solution))
            return error, whole
        estimate = estimate_against(solution, finer, self._frame)
        error = self.tolerance.measure(estimate)
        error *= CAUTION if finer.problem.limited else 1.0
        return error, error

    def _corrected(self, candidate: _Candidate, later: _Candidate) -> _Candidate:
        """A candidate whose minimum moved away on the next grid, with what that says of it."""
        moved = relative_difference(candidate.solution.cost, later.solution.cost)
        known = moved if self.tolerance.quantity is Quantity.COST else np.nan
        return dataclasses.replace(candidate, error=known, contradicted=moved)

    def _enough(self, candidate: _Candidate) -> bool:
        return self._within(candidate.error, candidate.whole)

    def _within(self, error: float, whole: float) -> bool:
        size = self.tolerance.size
        return error <= ACCEPTED * size and whole <= CANCELLED * size

    def _ended(self, candidate: _Candidate, stalled: int) -> str:
        """Why no finer grid is tried, or ""."""
        solution = candidate.solution
        if not solution.success:
            return f"the last solve ended in {solution.status}"
        if self.deadline is not None and time.monotonic() > self.deadline:
            return "the time limit was reached"
        cost = self.tolerance.quantity is Quantity.COST
        assert solution.problem is not None
        if cost and candidate.error <= _least_error(solution.problem):
            limited = solution.problem.limited
            what = "the limits' tolerance leaves" if limited else "rounding leaves"
            return f"{what} no smaller error"
        if stalled >= STALLED:
            return f"the last {STALLED} grids brought no smaller error"
        if len(self.rounds) >= ROUNDS:
            return f"{ROUNDS} grids were tried"
        if self.rounds[-1].points > MOST_POINTS:
            return f"a grid has {self.rounds[-1].points:,} points"
        return ""

    def _next(self, candidate: _Candidate) -> _Candidate:
        """The next grid, from the finer solution."""
        problem = candidate.solution.problem
        assert problem is not None
        finer = candidate.finer
        if finer is None:
            grid = problem.grid.halved(np.ones(problem.grid.intervals, dtype=bool))
            return self._solved(problem.on(grid), candidate.solution.trajectory)
        rho = _decay(candidate.solution, finer)
        grid = refined(problem.grid, rho, self._demands(candidate, finer), problem.robot.nv)
        if _same(grid, problem.grid):
            grid = finer_grid(grid)
        fine = problem.on(grid)
        return self._solved(fine, moved_to(finer, fine))

    def _demands(self, candidate: _Candidate, finer: FinerSolution) -> list[Demand]:
        """What each interval has to contribute."""
        contributions = _contributions(finer)
        N, aim = len(contributions), AIM * self.tolerance.size
        if self.tolerance.quantity is Quantity.COST:
            short = max(1.0, candidate.error / max(contributions.sum(), 1e-300))
            return [Demand(aim / (N * np.maximum(short * contributions, 1e-300)), 2)]
        return self._demands_on_curve(candidate, finer, contributions)

    def _demands_on_curve(
        self, candidate: _Candidate, finer: FinerSolution, contributions: Array
    ) -> list[Demand]:
        """Of the curve where it is off between good nodes, of everything where the nodes are."""
        estimate = estimate_against(candidate.solution, finer, self._frame)
        if self.tolerance.quantity is Quantity.FRAME:
            along, ends = estimate.tip, estimate.tip_at_nodes
        else:
            along, ends = estimate.q.max(axis=1), estimate.q_at_nodes.max(axis=1)
        aim = AIM * self.tolerance.size
        nearby = np.maximum(ends[:-1], ends[1:])
        own = np.where(along > 3 * nearby, along, 0.0)
        nodes = aim / max(float(ends.max()), 1e-300)
        share = contributions * len(contributions) / max(contributions.sum(), 1e-300)
        return [
            Demand(aim / np.maximum(own, 1e-300), 1),
            Demand(nodes / np.maximum(share, 1e-300), 2),
        ]

    def _finished(self, chosen: _Candidate, reason: str) -> Solution:
        """The solution with what is known of its accuracy."""
        solution, finer = chosen.solution, chosen.finer
        if finer is None and not reason:
            reason = "no finer solution was found nearby"
        known = None if finer is None else _error_of_cost(solution, finer)
        if known is not None and chosen.contradicted > 0:
            known, finer = max(known, chosen.contradicted), None
            reason = f"{reason}, and the minimum moves when the grid becomes finer"
        reached = chosen.error <= self.tolerance.size
        accuracy = Accuracy(
            self.tolerance,
            chosen.error,
            reached,
            "" if reached else reason,
            tuple(self.rounds),
            None if finer is None else partial(estimate_against, solution, finer, self._frame),
        )
        steps = sum(done.nit for done in self.rounds) or solution.nit
        message = solution.message
        if solution.success:
            message = f"a minimum of cost {solution.cost:.10g} after {steps} steps"
            message += f" on {len(self.rounds)} grids" if len(self.rounds) > 1 else ""
        told = {**solution.trajectory.metadata, "error_estimate": known}
        return dataclasses.replace(
            solution,
            trajectory=dataclasses.replace(solution.trajectory, metadata=told),
            message=f"{message.removesuffix('.')}; {accuracy}",
            nit=steps,
            error_estimate=known,
            accuracy=accuracy,
        )

    @property
    def _frame(self) -> str | None:
        return self.tolerance.frame

    def _left(self) -> float | None:
        return None if self.deadline is None else max(self.deadline - time.monotonic(), 0.0)


def moved_to(finer: FinerSolution, problem: TrajectoryProblem) -> DiscretePath:
    """The finer solution's curve on another grid of the same problem."""
    grid, path = problem.grid, finer.path
    if np.array_equal(grid.steps, finer.problem.grid.steps):
        inner = np.zeros((grid.intervals, grid.inner_modes, path.v.shape[1]))
        for scheme, index in grid.groups:
            r = min(scheme.inner_modes, path.inner.shape[1])
            inner[index, :r] = path.inner[index, :r]
        return DiscretePath(path.q, path.v, path.z, inner)
    curve = stretched(finer.trajectory, grid.duration)
    return problem.path(curve)


def _decay(solution: Solution, finer: FinerSolution) -> Array:
    """Of the finer solution, where it has the same intervals; else of the solution itself."""
    grid = solution.trajectory.grid
    if np.array_equal(grid.steps, finer.problem.grid.steps):
        return decay(finer.problem.grid, finer.path)
    return decay(grid, solution.trajectory.path)


def _unsteady(solution: Solution) -> float:
    """What the nodal Hamiltonian says of the error, relative; 0 where it is not constant."""
    assert solution.problem is not None
    try:
        spread = nodal_hamiltonian(solution.problem, solution.trajectory).spread
    except InputError:
        return 0.0
    return UNSTEADY * spread


def _same(one: Grid, other: Grid) -> bool:
    same_steps = np.array_equal(one.steps, other.steps)
    return same_steps and all(
        a.name == b.name for a, b in zip(one.schemes, other.schemes, strict=True)
    )


def _error_of_cost(solution: Solution, finer: FinerSolution) -> float:
    """Relative; 0 where there is no cost, and else not below what rounding or limits leave."""
    error = relative_difference(finer.known, finer.cost)
    if finer.known == 0:
        return error
    problem = solution.problem
    assert problem is not None
    error *= CAUTION if problem.limited else 1.0
    return max(error, _least_error(problem))


def _least_error(problem: TrajectoryProblem) -> float:
    """The smallest error of the cost that is claimed, relative."""
    if not problem.limited:
        return ROUNDING
    return BLUR * (TOLERANCE if problem.limits is None else problem.limits.tolerance)


def _contributions(finer: FinerSolution) -> Array:
    """What each interval adds to the error of the cost, relative, without its sign."""
    return np.asarray(np.abs(finer.gains) / max(abs(finer.cost), np.finfo(float).tiny))


def _contradicts(later: _Candidate, known: _Candidate) -> bool:
    """Whether a finer grid's cost is another by far more than both errors."""
    if known.finer is None:
        return False
    errors = _error_of_cost(known.solution, known.finer)
    if later.finer is not None:
        errors += _error_of_cost(later.solution, later.finer)
    return relative_difference(known.finer.cost, later.solution.cost) > CONTRADICTED * errors


def _better(one: _Candidate, other: _Candidate) -> bool:
    """Whether a solution is to be preferred: a minimum to none, then the smaller error."""
    if one.solution.success != other.solution.success:
        return one.solution.success
    if np.isnan(other.error):
        return True
    return one.error < other.error
