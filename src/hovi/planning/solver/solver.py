"""solve: from a trajectory problem to a Solution."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import check_path, moved, named_curve, stretched, with_turns
from hovi.discrete.nodal_momenta import carried_momenta
from hovi.discrete.state import State, as_state
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.trust_region import Iteration, Options
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy
from hovi.planning.solver.methods.choice import method_for
from hovi.planning.solver.methods.method import Answer, Method, Report
from hovi.planning.solver.status import Status
from hovi.planning.solver.warm_start import follow
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import PointTerms
from hovi.system.blas_threads import one_blas_thread
from hovi.system.interruption import interruptible, record_interrupt

CORRECTIONS = 6
"""Quasi-Newton steps that may correct the guess of a motion between other states."""
DECREASE = 1e-9
"""Relative decrease of a Newton step from which on a motion is stationary but for rounding."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The answer to a trajectory problem.

    success: whether a minimum was found. status, message: what happened, in a word and in a
        sentence.
    trajectory: the motion, the best so far where no minimum was found.
    cost: the discrete action of L~, 1/2 integral |tau|^2 where nothing else was asked.
    error_estimate: relative, in the cost; None where there is none.
    accuracy: what was reached of a tolerance; None where none was asked for.
    nit: steps of the optimiser. n_neg: negative eigenvalues of the action's Hessian; -1 where it
        was not counted.
    minima: costs of all minima that a multi-start found, ascending.
    history: what each step did.
    setup_seconds, solve_seconds: wall time before and during the solve.
    problem: what was solved; `replan` starts from it.
    forces: multipliers of limits and of passive joints' torques at the quadrature points.
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

    @cached_property
    def duration_derivative(self) -> float:
        """d cost / d T with all else as it was asked, per [s]: minus Pontryagin's Hamiltonian.

        For an effort that does not depend on time. Raises InputError without a problem.
        """
        if self.problem is None:
            raise InputError("this solution does not know its problem; plan again instead.")
        return self.problem.ld.duration_derivative(self.trajectory.path, self.forces)

    def replan(
        self,
        start: State | npt.ArrayLike | str | None = None,
        goal: State | FrameGoal | npt.ArrayLike | str | None = None,
        guess: Solution | None = None,
        **options: Any,
    ) -> Solution:
        """The motion between other states, from this one or another as the guess.

        Everything that was built is used again, so that this can run in a loop. The guess is
        where the earlier motion goes to first order, which counts as one of the steps, corrected
        by a few gradients, which do not: see hovi.planning.solver.warm_start.
        start, goal: a State, a configuration at rest or the name of a pose; the goal may be a
            FrameGoal; as before when None.
        guess: an earlier answer on the same grid; this one when None.
        options: as for `solve`.
        Raises InputError when this solution does not know its problem.
        """
        if self.problem is None:
            raise InputError("this solution does not know its problem; plan again instead.")
        old = self.problem
        problem = old.between(
            old.start if start is None else as_state(start, old.robot),
            old.goal if goal is None else _as_goal(goal, old.robot),
        )
        origin = self if guess is None else guess
        path = origin.trajectory.path
        if isinstance(goal, FrameGoal):  # from where it is met: half a turn away it seems to be
            path = moved(path, problem.grid, problem.boundary, problem.robot)
        if problem.limited or not problem.plain:
            return solve(problem, path, **options)
        solution = solve(problem, follow(path, problem, CORRECTIONS), **options)
        return dataclasses.replace(solution, nit=solution.nit + 1)


def _as_goal(goal: State | FrameGoal | npt.ArrayLike | str, robot: Robot) -> State | FrameGoal:
    return goal if isinstance(goal, FrameGoal) else as_state(goal, robot)


@one_blas_thread
@interruptible
def solve(
    problem: TrajectoryProblem,
    guess: str | Trajectory | DiscretePath = "cubic",
    *,
    max_iterations: int = 500,
    time_limit: float | None = None,
    escape_saddles: bool = True,
    report: Report | None = None,
    method: Method | None = None,
) -> Solution:
    """A motion that makes the discrete action stationary, by a trust-region Newton method.

    problem: the boundary data and the discrete Lagrangian.
    guess: "cubic", "minimum-jerk", a Trajectory (on any grid), or a DiscretePath on this grid.
    max_iterations: steps; with limits or equations, of every round. time_limit: in [s]. Both
        return the best motion so far.
    escape_saddles: leave a saddle along negative curvature; False stops there, with its status.
    report: called with the number of each step and the least cost so far.
    method: how to minimise; the first of hovi.planning.solver.methods.choice that suits when None.
    With limits, `cost` is that of the motion that holds them everywhere, and intervals may have
    been split for it.
    Raises InputError for a guess or a method that does not fit.
    """
    began = time.perf_counter()
    method = method or method_for(problem)
    if not method.suits(problem):
        raise InputError(f"{type(method).__name__} cannot meet all that this problem asks for.")
    path = guess_path(problem, guess)
    options = Options(
        decrease=DECREASE,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
    )
    started = time.perf_counter()
    try:
        answer = method.minimize(problem, path, options, report)
    except KeyboardInterrupt:  # outside of the iterations, which keep what they have
        record_interrupt()
        answer = _interrupted(problem, path)
    return _solution(answer, started - began, time.perf_counter() - started)


def _trajectory(answer: Answer) -> Trajectory:
    """The motion with its momenta and where it came from."""
    problem = answer.problem
    metadata: dict[str, Any] = {
        "cost": answer.cost,
        "status": str(answer.status),
        "n_neg": answer.n_neg,
    }
    if problem.limits is not None and problem.limited:
        metadata["limits"] = problem.limits.to_dict()
    if problem.clearance is not None and problem.distances is not None:
        metadata["clearance"] = problem.clearance.to_dict()
    derivatives = problem.ld.derivatives(answer.path, answer.forces, answer.jets)
    momenta = carried_momenta(derivatives)
    return Trajectory(problem.grid, answer.path, momenta, problem.scene, metadata)


def _solution(answer: Answer, setup_seconds: float, solve_seconds: float) -> Solution:
    """The answer as a Solution."""
    return Solution(
        success=answer.status is Status.MINIMUM,
        status=answer.status,
        message=answer.message,
        trajectory=_trajectory(answer),
        cost=answer.cost,
        nit=answer.nit,
        n_neg=answer.n_neg,
        problem=answer.problem,
        minima=(answer.cost,) if answer.status is Status.MINIMUM else (),
        history=tuple(answer.history),
        setup_seconds=setup_seconds,
        solve_seconds=solve_seconds,
        forces=answer.forces,
    )


def minimum_at(
    problem: TrajectoryProblem, path: DiscretePath, steps: int, seconds: float
) -> Solution:
    """A path that is known to be a minimum as a Solution; without limits and equations.

    steps: that led to it. seconds: that they took.
    """
    value = problem.ld.action(path)
    message = f"a minimum of cost {value:.10g} after {steps} steps."
    answer = Answer(problem, path, value, Status.MINIMUM, message, steps, n_neg=0)
    return _solution(answer, 0.0, seconds)


def _interrupted(problem: TrajectoryProblem, path: DiscretePath) -> Answer:
    """The guess, where an interrupt left nothing else."""
    value, message = problem.ld.action(path), "the solve was interrupted; the motion is its guess."
    return Answer(problem, path, value, Status.INTERRUPTED, message)


def guess_path(problem: TrajectoryProblem, guess: str | Trajectory | DiscretePath) -> DiscretePath:
    """A guess as a path on the problem's grid, with the problem's boundary data."""
    robot, grid, boundary = problem.robot, problem.grid, problem.boundary
    if isinstance(guess, DiscretePath):
        check_path(guess, grid, robot)
        return moved(guess, grid, problem.ends(guess.q, guess.v), robot)
    if isinstance(guess, str):
        curve = named_curve(guess, robot, boundary, grid.duration)
        if problem.turns.any():
            curve = with_turns(curve, robot, grid.duration, problem.turns)
        return problem.path(curve)
    if guess.v.shape[1] != robot.nv:
        raise InputError(
            f"the guess moves {guess.v.shape[1]} joints, robot {robot.name!r} has {robot.nv}."
        )
    return problem.path(stretched(guess, grid.duration))
