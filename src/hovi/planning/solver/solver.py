"""solve_on_grid: from a trajectory problem to a Solution, not checked between the points."""

from __future__ import annotations

import dataclasses
import io
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, without_checks
from hovi.checks.units import as_time_limit, seconds
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.instants import Instants
from hovi.discrete.measures.motion_effort import effort_of
from hovi.discrete.measures.motion_segments import with_segment_names
from hovi.discrete.state import Periodic
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.methods.method import Method
from hovi.optimize.criteria import MAX_ITERATIONS, Criteria
from hovi.optimize.ended import STOPS, Iteration, Reason, why_stopped
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.optimize.start import Start
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.ends import End
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import LAST_BARRIER, REMAINING_FRACTION, Accuracy
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.initial_path import guess_path, turned_on
from hovi.planning.solver.limits.row_forces import at_instants
from hovi.planning.solver.methods.choice import method_for
from hovi.planning.solver.methods.method import ProblemMethod, Report
from hovi.planning.solver.methods.stationary import Stationary
from hovi.planning.solver.outcome.ends import starts_there
from hovi.planning.solver.outcome.judge import judged
from hovi.planning.solver.outcome.solution_summary import SolutionSummary
from hovi.planning.solver.receding.braking import BRAKES, braking
from hovi.planning.solver.receding.ends import (
    as_goal,
    as_start,
    inside_limits,
    is_near,
    measured,
    require_known,
    with_strictness,
)
from hovi.planning.solver.receding.last_motion import (
    last_motion,
    out_of_time,
    satisfies,
)
from hovi.planning.solver.status import Status, unfinished
from hovi.planning.solver.warm_start import follow
from hovi.scene.lagrangian import PointTerms
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError, raise_if_late
from hovi.system.interruption import interruptible

if TYPE_CHECKING:
    from hovi.planning.solver.central_path import CentralPath
    from hovi.planning.solver.outcome.solution_factor import SolutionFactor, SolvedBounds
    from hovi.planning.solver.receding.shift import Shift

Array = npt.NDArray[np.float64]

SOLVE_FRACTION = 0.6
"""Fraction of a time limit of `replan` and `advance` for the solve, before the checks."""
COARSE_LEVEL = 10 * LAST_BARRIER
"""Last barrier parameter of a motion, relative to the mean density of the cost, above which its
replans end at the same one: Newton steps from there to a far smaller one diverge."""
STATIONARY_DECREASE = 1e-9
"""Predicted relative decrease of a Newton step below which a motion counts as stationary."""


@dataclass(frozen=True, eq=False, repr=False)
class Solution(SolutionSummary):
    """The solution of a trajectory problem, or the best motion found.

    success: whether a minimum, or the stationary point that was sought, was found; after `plan`,
        `solve` and `replan`, a resolved one that is `usable`.
    status, message: the outcome, as a word and in a sentence; `usable` says whether ends and limits
        hold, and `violation` what does not.
    trajectory: the motion; the best one found if there is no minimum.
    cost: the discrete action of L~, by default 1/2 integral |tau|^2, plus the price of time w T.
    error_estimate: of the cost, relative; None if there is none.
    accuracy: the accuracy that was reached; None if no tolerance was given. nit: steps of the
        optimiser. n_neg: negative eigenvalues of the action's Hessian; -1 if they were not counted.
    minima: costs of all minima that a multi-start found, ascending. history: one record per step.
    setup_seconds, solve_seconds: wall time before and during the solve. problem: what was solved.
    forces: multipliers of limits and of passive joints' torques at the quadrature points, and of
        limits at instants between them. instants: these; None for none.
    prices: how far every bound moves the cost, per range, (2, kinds); None without bounds.
    central, model: what `replan` starts from, the path of a barrier method or the last model.
    solved_bounds: where a solve within limits ended, from which `factor` follows; None for others.
    check: returns a replanned motion with its error estimate or as UNRESOLVED; None for no check.
    """

    success: bool
    status: Status
    message: str
    trajectory: Trajectory = field(repr=False)
    cost: float
    nit: int
    n_neg: int
    problem: TrajectoryProblem | None = field(default=None, repr=False)
    error_estimate: float | None = None
    accuracy: Accuracy | None = field(default=None, repr=False)
    minima: tuple[float, ...] = ()
    history: tuple[Iteration, ...] = field(default=(), repr=False)
    setup_seconds: float = 0.0
    solve_seconds: float = 0.0
    forces: list[PointTerms] | None = field(default=None, repr=False)
    instants: Instants | None = field(default=None, repr=False)
    prices: Array | None = field(default=None, repr=False)
    central: CentralPath | None = field(default=None, repr=False)
    model: QuadraticModel | None = field(default=None, repr=False)
    solved_bounds: SolvedBounds | None = field(default=None, repr=False)
    check: Check | None = field(default=None, repr=False)

    @cached_property
    def effort(self) -> float | None:
        """1/2 integral |tau|^2 dt of the plain torques of the actuated joints, computed when asked.

        By the quadrature rule of the cost, which it equals where the cost is nothing else; weights,
        other costs and the price of time are left out. None without torques or inertia.
        """
        return effort_of(self.trajectory)

    @check_arguments
    def save(self, path: str | os.PathLike[str] | io.BytesIO, *, meshes: bool = True) -> None:
        """Write the motion to one npz file, which hovi.Trajectory.load reads: see its `save`."""
        self.trajectory.save(path, meshes=meshes)

    @cached_property
    def factor(self) -> SolutionFactor:
        """The KKT system at the motion, factored: how it follows its ends, and n_neg.

        Of a minimum, or of a stationary point without limits; active limits count as equations.
        Where it is not known how the solve ended, as of a minimum that another process found, it is
        solved for once more, from itself. Raises InputError without a problem, within limits for a
        motion that is no minimum, for a periodic one, and for more than 1,000 intervals.
        """
        # Here, since most solutions are used without it.
        from hovi.planning.solver.outcome.solution_factor import SolutionFactor

        known, problem = self, self._solved_problem
        if self.solved_bounds is None and problem.limited:
            free = problem.with_clearance(None)
            if not free.limited and self.instants is None:  # distances that have no force
                problem = free
            elif self.status is Status.MINIMUM:
                known = self.replan()
                problem = known._solved_problem
        return SolutionFactor.of(problem, known.trajectory.path, known.solved_bounds)

    @property
    def region_prices(self) -> dict[str, float]:
        """By how much the cost changes with each bound of a goal's region, such as `within`.

        dJ/dd of its room d, in [m] or [rad], by the frame and what is bounded; 0 for a bound inside
        which the motion ends.
        """
        from hovi.planning.solver.regions import region_prices  # most goals have none

        return region_prices(self)

    @cached_property
    def duration_derivative(self) -> float:
        """d cost / d T with all else fixed, per [s]: minus Pontryagin's Hamiltonian.

        All intervals keep their proportions. Raises InputError without a problem.
        """
        return self.derivative_in_time(lambda grid: grid.t / grid.duration)

    def derivative_in_time(self, rates: Callable[[Grid], Array]) -> float:
        """d cost / d L where the times of the nodes depend on L, per [s].

        rates: dt/dL of the nodes of a grid, shape (N + 1,). Raises InputError without a problem.
        """
        ld = at_instants(self._solved_problem, self.instants).ld
        return ld.duration_derivative(self.trajectory.path, self.forces, rates(ld.grid))

    @check_arguments
    def replan(
        self,
        start: End | None = None,
        goal: End | Periodic | None = None,
        guess: Solution | None = None,
        time_limit: float | str | None = None,
        strict: bool | None = None,
        **options: Any,
    ) -> Solution:
        """The motion between other states, with this motion or another as the initial guess.

        Functions are reused, for planning in a loop. The guess is a first-order prediction, which
        counts as one step: see hovi.planning.solver.warm_start. Turns are as angles say.
        start, goal: as for `plan`, tables included; the goal may be Periodic, too; unchanged if
            None. A start at a frame is the configuration nearest to the old start.
        guess: an earlier solution on the same grid; this one if None. The duration is kept.
        time_limit: for the whole call, in [s] or as "100 ms". When it is reached, the step of the
            solver that has begun and the end of the call are left to do. The status is then
            TIME_LIMIT, and the motion the best one that satisfies the ends, the limits and the
            equations to 1e-6; if there is none, this motion as it is, and the message says what it
            misses. From a start that it misses, a braking motion to rest within the limits instead,
            where one is found: its goal is where it stops.
        strict: whether a start outside its limits is refused; as planned if None.
        options: as for `solve`. Self-collision that was left out is not looked for, as `plan` does.
        Raises InputError without a problem, UnreachableError for a start that nothing reaches.
        """
        deadline = Deadline(as_time_limit(time_limit))
        require_known(options, Solution.replan, solve_on_grid)
        old = with_strictness(self._solved_problem, strict)
        problem = old.between(
            old.start if start is None else as_start(start, old),
            old.goal if goal is None else as_goal(goal, old),
        )
        central, origin = (self.central, self) if guess is None else (None, guess)
        path = turned_on(problem, origin.trajectory.path)
        known = (central, origin.model) if path is origin.trajectory.path else (None, None)
        again = _Again(problem, path, known[0], self.check, known[1])
        if self.status is Status.STATIONARY:
            options = {"method": Stationary()} | options
        return self._named(again.within(deadline, "this is the last motion", **options))

    @check_arguments
    def advance(
        self,
        elapsed: float | str,
        start: End | None = None,
        goal: End | None = None,
        *,
        duration: float | str | None = None,
        time_limit: float | str | None = None,
        strict: bool | None = None,
        **options: Any,
    ) -> Solution:
        """The motion from a time on, from the state that was measured then: a receding horizon.

        Intervals that have passed are dropped, and the one that has begun is shortened, or becomes
        one with the next if less than a twentieth of it is left: the rest of the motion keeps its
        nodes, and is as accurate as it was. Limits between the points, the barrier and multipliers
        follow, so that a small disturbance takes a few steps.
        elapsed: time since the start of this motion, in [s], or a text such as "20 ms".
        start: the state at that time, as for `replan`; the motion's own one if None. One that is
            measured outside its limits is led back: see `excused`. The acceleration of a smooth
            motion is the motion's own one if none is given.
        goal: as for `replan`.
        duration: of the new motion, in [s] or as a text; what is left of this one if None. With
            another one, as for a horizon that moves, the rest is stretched and sampled again on as
            many intervals.
        time_limit: as for `replan`; what comes back is this motion from that time on.
        strict: as for `replan`.
        options: as for `solve`.
        Via points and segments that have passed are left out, and the segment that has begun is
        shortened; with another duration, the times of the others are stretched with the motion.
        Effects, moving obstacles and conditions that depend on time see the time since the start
        of the first motion, however often it is advanced.
        Raises InputError if this solution has no problem, if it ends before the time, or if it is
        periodic.
        """
        from hovi.planning.solver.receding.shift import Shift

        deadline = Deadline(as_time_limit(time_limit))
        require_known(options, Solution.advance, solve_on_grid)
        old = with_strictness(self._solved_problem, strict)
        length = None if duration is None else seconds(duration, "the duration")
        shift = Shift.of(old, seconds(elapsed, "the time elapsed"), length)
        path = shift.path(self.trajectory.path)
        state = shift.first_state(path, self.trajectory)
        if start is not None:
            state = measured(start, old, state)
        to = old.goal if goal is None else as_goal(goal, old)
        assert not isinstance(to, Periodic)
        problem = shift.between(inside_limits(state, old), to)
        central = None if self.central is None else shift.central(self.central)
        check = self.check
        if isinstance(check, MotionCheck):
            check = check.shifted(shift, problem)
        if self.status is Status.STATIONARY:
            options = {"method": Stationary()} | options
        last = f"this is the last motion from {shift.elapsed:g} s on"
        return self._named(_Again(problem, path, central, check).within(deadline, last, **options))

    def _named(self, again: Solution) -> Solution:
        """A solution of what is left of this one's problem, whose segments keep their names."""
        motion = with_segment_names(again.trajectory, self.trajectory)
        same = motion is again.trajectory
        return again if same else dataclasses.replace(again, trajectory=motion)


Check = Callable[[Solution], Solution]
"""Returns a motion with its error estimate, or as UNRESOLVED."""


class MotionCheck(ABC):
    """A check that knows an earlier motion."""

    @abstractmethod
    def __call__(self, solution: Solution) -> Solution:
        """The motion with its error estimate, or as UNRESOLVED."""

    @abstractmethod
    def shifted(self, shift: Shift, problem: TrajectoryProblem) -> Check:
        """The check of motions near the rest of the earlier one; problem: of what is left."""


@dataclass(frozen=True, eq=False)
class _Again:
    """A solve that starts from the motion of a similar problem.

    problem: to solve. path: the other motion, on its grid. central, check, model: see Solution.
    """

    problem: TrajectoryProblem
    path: DiscretePath
    central: CentralPath | None
    check: Check | None
    model: QuadraticModel | None = None

    def within(self, deadline: Deadline, last: str, **options: Any) -> Solution:
        """The solution, or what there is at the deadline. last: names the other motion."""
        found, begun = None, False
        with deadline.in_force():
            try:
                raise_if_late()
                begun = True
                found = self._solved(deadline.part(SOLVE_FRACTION).seconds_left, options)
                if found.status is not Status.TIME_LIMIT:
                    done = self._checked(found)
                    if done.success or done.usable:
                        return done
                    return self._at_rest(done.status, done.message, done.nit) or done
                solved = found.problem or self.problem
                if np.isfinite(found.cost) and satisfies(solved, found.trajectory.path):
                    return self._kept(found)
            except OutOfTimeError:
                pass
        steps = 0 if found is None else found.nit
        said = f"{out_of_time(steps)}."
        if begun and (stopped := self._at_rest(Status.TIME_LIMIT, said, steps)):
            return stopped
        result = last_motion(self.problem, self.path, self.central, steps, last)
        return dataclasses.replace(solution_of(result), check=self.check)

    def _checked(self, found: Solution) -> Solution:
        """The solution as its check returns it, with a check for the next replan."""
        if self.check is None:
            return judged(found)
        done = self.check(found)
        return dataclasses.replace(done, check=done.check or self.check)

    def _at_rest(self, status: Status, message: str, steps: int) -> Solution | None:
        """A braking motion, unless the last motion is one from the start; None if none is found."""
        problem = self.problem
        unlimited = not problem.limited or starts_there(problem, self.path)
        stopped = None if unlimited else braking(problem)
        if stopped is None:
            return None
        said = f"{message} {BRAKES}"
        result = Answer.at(*stopped, status, said, steps, self.central)
        return dataclasses.replace(solution_of(result), check=self.check)

    def _solved(self, time_limit: float | None, options: dict[str, Any]) -> Solution:
        problem, path, goal = self.problem, self.path, self.problem.goal
        if isinstance(goal, FrameGoal) and not is_near(goal, problem, path):
            path = problem.moved_to_guesses(path)
        options = {"time_limit": time_limit} | options
        if problem.limited or not problem.plain:
            central = self.central if problem.limited else None
            if central is not None and central.level > COARSE_LEVEL:
                options = {"barrier": central.level} | options
            return solve_on_grid(problem, Start(path, central, near=True), **options)
        found = solve_on_grid(problem, follow(path, problem, self.model), **options)
        return dataclasses.replace(found, nit=found.nit + 1)

    def _kept(self, found: Solution) -> Solution:
        """The best motion at the deadline, with what the next one starts from."""
        message = (
            f"the time limit was reached after {found.nit} steps; the motion meets the ends and "
            f"the limits to 1e-6, and has the cost {found.cost:.10g}."
        )
        central = self.central
        if central is not None and found.trajectory.grid is self.problem.grid:
            central = central.ending_at(found.trajectory.path)
        return dataclasses.replace(found, message=message, central=central, check=self.check)


@check_arguments
@one_blas_thread
@interruptible
def solve_on_grid(
    problem: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath | Start[Any, Any] = "cubic",
    *,
    max_iterations: int = MAX_ITERATIONS,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    report: Report | None = None,
    method: Method | ProblemMethod | None = None,
    barrier: float = LAST_BARRIER,
) -> Solution:
    """A motion that makes the discrete action stationary, without a check between the points.

    guess: as for `hovi.solve`; near a Trajectory, as the motion of a similar problem, a minimum
        within limits is looked for. Or a Start from one of these, with what else is known.
    barrier: last barrier parameter within limits, relative to the mean density of the cost, which
        exceeds its minimum by some ten times as much.
    Other arguments, cost and errors as of `hovi.solve`, which checks the motion.
    """
    began = time.perf_counter()
    by = _for_problems(method) if method else method_for(problem)
    if not by.supports(problem):
        raise InputError(
            f"method {type(method).__name__} does not support this problem; leave `method` out."
        )
    begun = guess if isinstance(guess, Start) else Start(guess, near=isinstance(guess, Trajectory))
    path = guess_path(problem, begun.x)
    criteria = Criteria(
        decrease=STATIONARY_DECREASE,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
        barrier=barrier,
        enough=REMAINING_FRACTION * barrier,
    )
    started, start = time.perf_counter(), dataclasses.replace(begun, x=path)
    try:
        with Deadline(time_limit).in_force():
            result = by.minimize(problem, start, criteria, report)
    except STOPS as stopped:
        result = _the_guess(problem, path, why_stopped(stopped))
    return solution_of(result, started - began, time.perf_counter() - started)


solved_on_grid = without_checks(solve_on_grid)
"""`solve_on_grid` within a public call, which has checked its arguments and takes interrupts."""


def solution_of(result: Answer, setup_seconds: float = 0.0, solve_seconds: float = 0.0) -> Solution:
    """The answer as a Solution."""
    return Solution(
        success=result.status in (Status.MINIMUM, Status.STATIONARY),
        status=result.status,
        message=result.message,
        trajectory=result.motion,
        cost=result.cost,
        nit=result.nit,
        n_neg=result.n_neg,
        problem=result.problem,
        minima=(result.cost,) if result.status is Status.MINIMUM else (),
        history=tuple(result.history),
        setup_seconds=setup_seconds,
        solve_seconds=solve_seconds,
        forces=result.forces,
        instants=result.instants,
        prices=result.prices,
        central=result.central,
        model=result.model,
        solved_bounds=result.solved_bounds,
    )


def _for_problems(method: Method | ProblemMethod) -> ProblemMethod:
    """A method that solves problems, by the programs of a problem if it is one for these."""
    if isinstance(method, ProblemMethod):
        return method
    from hovi.planning.solver.methods.interior_point import InteriorPoint  # as in choice.py

    return InteriorPoint(method=method)


def _the_guess(problem: TrajectoryProblem, path: DiscretePath, why: Reason) -> Answer:
    """The guess, if a solve was stopped before any step."""
    status, reason = unfinished(why)
    message = f"{reason}; the motion is the guess."
    return Answer.at(problem, path, status, message)
