"""solve_on_grid: from a trajectory problem to a Solution, not checked between the points."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import check_path, stretched
from hovi.discrete.measures.motion_effort import effort_of
from hovi.discrete.node_continuity import require_continuous
from hovi.discrete.state import Periodic, State, as_state
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.trust_region import Iteration, Options, Stop
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy
from hovi.planning.solver.methods.choice import method_for
from hovi.planning.solver.methods.method import Method, MethodResult, Report
from hovi.planning.solver.methods.stationary import Stationary
from hovi.planning.solver.nodal_momenta import accumulated_momenta
from hovi.planning.solver.status import Status, unfinished
from hovi.planning.solver.warm_start import follow
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.lagrangian import PointTerms
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import interruptible, record_interrupt

MAX_CORRECTIONS = 6
"""Maximum number of quasi-Newton steps on the initial guess of `replan`."""
STATIONARY_DECREASE = 1e-9
"""Predicted relative decrease of a Newton step below which a motion counts as stationary."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The solution of a trajectory problem, or the best motion found.

    success: whether a minimum, or the stationary point that was sought, was found; after `plan`,
        `solve` and `replan`, a resolved one.
    status, message: the outcome, as a word and in a sentence.
    trajectory: the motion; the best one found if there is no minimum.
    cost: the discrete action of L~, by default 1/2 integral |tau|^2.
    error_estimate: of the cost, relative; None if there is none.
    accuracy: the accuracy that was reached; None if no tolerance was given.
    nit: steps of the optimiser. n_neg: negative eigenvalues of the action's Hessian; -1 if they
        were not counted.
    minima: costs of all minima that a multi-start found, ascending.
    history: one record per step.
    setup_seconds, solve_seconds: wall time before and during the solve.
    problem: the trajectory problem; `replan` starts from it.
    forces: multipliers of limits and of passive joints' torques at the quadrature points.
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
    check: Callable[[Solution], Solution] | None = field(default=None, repr=False)

    @cached_property
    def effort(self) -> float | None:
        """1/2 integral |tau|^2 dt of the plain torques of the actuated joints, computed when asked.

        By the quadrature rule of the cost, which it equals where the cost is nothing else; weights,
        other costs and the price of time are left out. None for a Lagrangian without torques.
        """
        return effort_of(self.trajectory)

    @cached_property
    def duration_derivative(self) -> float:
        """d cost / d T with all else fixed, per [s]: minus Pontryagin's Hamiltonian.

        For an effort that does not depend on time. Raises InputError without a problem.
        """
        if self.problem is None:
            raise InputError("this solution has no problem; call plan again instead.")
        return self.problem.ld.duration_derivative(self.trajectory.path, self.forces)

    @check_arguments
    def replan(
        self,
        start: State | npt.ArrayLike | str | None = None,
        goal: State | FrameGoal | Periodic | npt.ArrayLike | str | None = None,
        guess: Solution | None = None,
        **options: Any,
    ) -> Solution:
        """The motion between other states, with this motion or another as the initial guess.

        Precomputed functions are reused, for planning in a loop. The guess is the first-order
        prediction of the motion, which counts as one step, corrected by a few gradient
        evaluations, which do not: see hovi.planning.solver.warm_start.
        start, goal: a State, a configuration at rest or the name of a pose; the goal may be a
            FrameGoal or Periodic; unchanged if None.
        guess: an earlier solution on the same grid; this one if None.
        options: as for `solve`.
        Raises InputError if this solution has no problem.
        """
        if self.problem is None:
            raise InputError("this solution has no problem; call plan again instead.")
        old = self.problem
        problem = old.between(
            old.start if start is None else as_state(start, old.coordinates),
            old.goal if goal is None else _as_goal(goal, old.coordinates),
        )
        if self.status is Status.STATIONARY:
            options = {"method": Stationary()} | options
        origin = self if guess is None else guess
        path = origin.trajectory.path
        if isinstance(goal, FrameGoal):  # its equations also hold at half a turn: start at its root
            path = problem.moved_to_guesses(path)
        if problem.limited or not problem.plain:
            found = solve_on_grid(problem, path, near=True, **options)
        else:
            found = solve_on_grid(problem, follow(path, problem, MAX_CORRECTIONS), **options)
            found = dataclasses.replace(found, nit=found.nit + 1)
        return found if self.check is None else self.check(found)


def _as_goal(
    goal: State | FrameGoal | Periodic | npt.ArrayLike | str, coordinates: Coordinates
) -> State | FrameGoal | Periodic:
    return goal if isinstance(goal, FrameGoal | Periodic) else as_state(goal, coordinates)


@check_arguments
@one_blas_thread
@interruptible
def solve_on_grid(
    problem: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    report: Report | None = None,
    method: Method | None = None,
    near: bool | None = None,
) -> Solution:
    """A motion that makes the discrete action stationary, without a check between the points.

    near: whether the guess is the motion of a similar problem, near which a minimum within limits
        is looked for; that is so for a Trajectory when None.
    Other arguments, cost and errors as of `hovi.solve`, which checks the motion.
    """
    began = time.perf_counter()
    method = method or method_for(problem)
    if not method.supports(problem):
        raise InputError(
            f"method {type(method).__name__} does not support this problem; leave `method` out."
        )
    path = guess_path(problem, guess)
    options = Options(
        decrease=STATIONARY_DECREASE,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
        near=isinstance(guess, Trajectory) if near is None else near,
    )
    started = time.perf_counter()
    try:
        with Deadline(time_limit).in_force():
            result = method.minimize(problem, path, options, report)
    except KeyboardInterrupt:  # outside the iterations, which return their current point
        record_interrupt()
        result = _the_guess(problem, path, Stop.INTERRUPTED)
    except OutOfTimeError:
        result = _the_guess(problem, path, Stop.TIME_LIMIT)
    return _solution(result, started - began, time.perf_counter() - started)


def _trajectory(result: MethodResult) -> Trajectory:
    """The motion with its momenta and metadata."""
    problem = result.problem
    metadata: dict[str, Any] = {
        "cost": result.cost,
        "status": str(result.status),
        "n_neg": result.n_neg,
    }
    if problem.limits is not None and problem.limited:
        parts = problem.limits.parts
        if parts:  # under another name: who draws limits draws one for the whole motion
            metadata["segment_limits"] = [each.to_dict() for each in parts]
        else:
            metadata["limits"] = problem.limits.to_dict()
    if problem.clearance is not None and problem.distances is not None:
        metadata["clearance"] = problem.clearance.to_dict()
    derivatives = problem.ld.derivatives(result.path, result.forces, result.jets)
    momenta = accumulated_momenta(derivatives)
    return problem.motion(result.path, momenta, metadata)


def _solution(result: MethodResult, setup_seconds: float, solve_seconds: float) -> Solution:
    """The result as a Solution."""
    return Solution(
        success=result.status in (Status.MINIMUM, Status.STATIONARY),
        status=result.status,
        message=result.message,
        trajectory=_trajectory(result),
        cost=result.cost,
        nit=result.nit,
        n_neg=result.n_neg,
        problem=result.problem,
        minima=(result.cost,) if result.status is Status.MINIMUM else (),
        history=tuple(result.history),
        setup_seconds=setup_seconds,
        solve_seconds=solve_seconds,
        forces=result.forces,
    )


def minimum_at(
    problem: TrajectoryProblem, path: DiscretePath, steps: int, seconds: float
) -> Solution:
    """A Solution from a path that is known to be a minimum, without limits or constraints.

    steps: of the optimiser. seconds: wall time.
    """
    value = problem.ld.action(path)
    message = f"a minimum of cost {value:.10g} after {steps} steps."
    result = MethodResult(problem, path, value, Status.MINIMUM, message, steps, n_neg=0)
    return _solution(result, 0.0, seconds)


def _the_guess(problem: TrajectoryProblem, path: DiscretePath, stop: Stop) -> MethodResult:
    """The guess, if a solve was stopped before any step."""
    status, reason = unfinished(stop)
    message = f"{reason}; the motion is the guess."
    return MethodResult(problem, path, problem.ld.action(path), status, message)


def guess_path(problem: TrajectoryProblem, guess: str | Trajectory | DiscretePath) -> DiscretePath:
    """A guess as a path on the problem's grid, with the problem's boundary data."""
    coordinates, grid = problem.coordinates, problem.grid
    if isinstance(guess, DiscretePath):
        if problem.ld.k == 2:
            check_path(guess, grid, coordinates)
        else:
            grid.require_path(guess, coordinates.nq, coordinates.nv)
            require_continuous(guess, grid, coordinates.curved_space)
        return problem.moved(guess)
    if isinstance(guess, str):
        return problem.guess(guess)
    if guess.v.shape[1] != coordinates.nv:
        raise InputError(
            f"the guess has {guess.v.shape[1]} velocities, but {coordinates.owner} has "
            f"{coordinates.nv}; use a motion of the same one."
        )
    return problem.path(stretched(guess, grid.duration, problem.ld.k))
