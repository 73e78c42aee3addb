"""solve: from a trajectory problem to a Solution."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import check_path, moved, named_curve, stretched, with_turns
from hovi.discrete.interval_batch import Jet
from hovi.discrete.nodal_momenta import carried_momenta
from hovi.discrete.state import State, as_state
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.optimize.trust_region import Iteration, Options, Outcome, Stop, minimize
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.tolerance import Accuracy
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian import polished, satisfy, unmet_sentence
from hovi.planning.solver.limited_solver import solve_limited
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.status import Status, chart_sentence, limited_verdict, verdict
from hovi.planning.solver.warm_start import follow
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import PointTerms
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible, remember

Report = Callable[[int, float], None]
"""What is told the number of each step and the least cost so far."""

CORRECTIONS = 6
"""Quasi-Newton steps that may correct the guess of a motion between other states."""
DECREASE = 1e-9
"""Relative decrease of a Newton step from which on a motion is stationary but for rounding."""
POLISHES = 8
"""Newton steps after the last round of equations, until only rounding is left."""


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
) -> Solution:
    """A motion that makes the discrete action stationary, by a trust-region Newton method.

    problem: the boundary data and the discrete Lagrangian.
    guess: "cubic", "minimum-jerk", a Trajectory (on any grid), or a DiscretePath on this grid.
    max_iterations: steps; with limits or equations, of every round. time_limit: in [s]. Both
        return the best motion so far.
    escape_saddles: leave a saddle along negative curvature; False stops there, with its status.
    report: called with the number of each step and the least cost so far.
    With limits, `cost` is that of the motion that holds them everywhere, and intervals may have
    been split for it.
    Raises InputError for a guess that does not fit.
    """
    began = time.perf_counter()
    path = guess_path(problem, guess)
    options = Options(
        decrease=DECREASE,
        max_iterations=max_iterations,
        time_limit=time_limit,
        escape_saddles=escape_saddles,
        exact=not (problem.limited or problem.constrained),
    )
    started = time.perf_counter()
    method = _with_limits if problem.limited else _without_limits
    try:
        answer = method(problem, path, options, report)
    except KeyboardInterrupt:  # outside of the iterations, which keep what they have
        remember()
        answer = _interrupted(problem, path)
    return _dressed(answer, started - began, time.perf_counter() - started)


@dataclass(frozen=True, eq=False)
class _Answer:
    """What a method found, before it is dressed as a Solution."""

    problem: TrajectoryProblem
    path: DiscretePath
    value: float
    status: Status
    message: str
    nit: int
    n_neg: int
    history: list[Iteration]
    forces: list[PointTerms] | None
    jets: list[Jet] | None = None

    def trajectory(self) -> Trajectory:
        """The motion with its momenta and where it came from."""
        problem = self.problem
        metadata: dict[str, Any] = {
            "cost": self.value,
            "status": str(self.status),
            "n_neg": self.n_neg,
        }
        if problem.limits is not None and problem.limited:
            metadata["limits"] = problem.limits.to_dict()
        if problem.clearance is not None and problem.distances is not None:
            metadata["clearance"] = problem.clearance.to_dict()
        momenta = carried_momenta(problem.ld.derivatives(self.path, self.forces, self.jets))
        return Trajectory(problem.grid, self.path, momenta, problem.scene, metadata)


def _dressed(answer: _Answer, setup_seconds: float, solve_seconds: float) -> Solution:
    """The answer as a Solution."""
    return Solution(
        success=answer.status is Status.MINIMUM,
        status=answer.status,
        message=answer.message,
        trajectory=answer.trajectory(),
        cost=answer.value,
        nit=answer.nit,
        n_neg=answer.n_neg,
        problem=answer.problem,
        minima=(answer.value,) if answer.status is Status.MINIMUM else (),
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
    answer = _Answer(problem, path, value, Status.MINIMUM, message, steps, 0, [], None)
    return _dressed(answer, 0.0, seconds)


def _interrupted(problem: TrajectoryProblem, path: DiscretePath) -> _Answer:
    """The guess, where an interrupt left nothing else."""
    value, message = problem.ld.action(path), "the solve was interrupted; the motion is its guess."
    return _Answer(problem, path, value, Status.INTERRUPTED, message, 0, -1, [], None)


def _without_limits(
    problem: TrajectoryProblem, path: DiscretePath, options: Options, report: Report | None
) -> _Answer:
    """By a trust region."""
    if problem.constrained:
        return _with_equations(problem, path, options, report)
    objective = ActionObjective(problem, structure=problem.structure)
    outcome = minimize(objective, path, options, report)
    n_neg = 0 if outcome.convex else _inertia(objective, outcome)
    status, message = verdict(problem, outcome, n_neg)
    message += chart_sentence(problem, outcome.x)
    nit, history, jets = outcome.iterations, outcome.history, objective.jets(outcome.x)
    return _Answer(
        problem, outcome.x, outcome.value, status, message, nit, n_neg, history, None, jets
    )


def _with_equations(
    problem: TrajectoryProblem, path: DiscretePath, options: Options, report: Report | None
) -> _Answer:
    """By trust regions in rounds of an augmented Lagrangian."""
    if problem.unreachable:
        value = problem.ld.action(path)
        message = f"{problem.unreachable}."
        return _Answer(problem, path, value, Status.INFEASIBLE, message, 0, -1, [], None)
    history: list[Iteration] = []
    deadline = Deadline(options.time_limit)

    def round_(known: Multipliers, x: DiscretePath, decrease: float) -> Outcome[DiscretePath]:
        objective = ActionObjective(problem, multipliers=known)
        tolerance = max(decrease, options.decrease)
        chosen = dataclasses.replace(options, decrease=tolerance, time_limit=deadline.seconds_left)
        outcome = minimize(objective, x, chosen, _shifted(report, len(history)))
        history.extend(outcome.history)
        return outcome

    rounds = satisfy(problem, path, round_)
    outcome = rounds.result
    n_neg = _inertia(ActionObjective(problem, multipliers=rounds.multipliers), outcome)
    nit = len(history)
    outcome.value, outcome.iterations = problem.ld.action(outcome.x), nit
    status, message = verdict(problem, outcome, n_neg)
    if rounds.reason:
        status, message = Status.INFEASIBLE, f"{rounds.reason}."
    elif status is not Status.MINIMUM and not rounds.met:
        unmet = unmet_sentence(problem, outcome.x, rounds.residuals).partition(";")[0]
        message = f"{message} Until then, {unmet}."
    polish = POLISHES if status is Status.MINIMUM else 0
    outcome.x, known = polished(problem, outcome.x, rounds.multipliers, polish)
    forces, value = known.forces, problem.ld.action(outcome.x)
    return _Answer(problem, outcome.x, value, status, message, nit, n_neg, history, forces)


def _shifted(report: Report | None, done: int) -> Report | None:
    """A report that counts on from the steps of earlier rounds."""
    if report is None:
        return None
    return lambda step, cost: report(done + step, cost)


def _with_limits(
    problem: TrajectoryProblem, path: DiscretePath, options: Options, report: Report | None
) -> _Answer:
    """By an interior point."""
    limits = problem.limits or no_limits(problem.robot)
    outcome = solve_limited(problem, limits, path, options, report)
    status, message = limited_verdict(outcome)
    return _Answer(
        outcome.problem,
        outcome.x,
        outcome.value,
        status,
        message,
        outcome.iterations,
        outcome.n_neg,
        outcome.history,
        outcome.forces,
    )


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


def _inertia(objective: ActionObjective, outcome: Outcome[DiscretePath]) -> int:
    """n_neg from the exact Hessian, -1 where there is none."""
    if outcome.stop is Stop.DIVERGED or not np.isfinite(outcome.value):
        return -1
    definite = objective.model(outcome.x, None, None).factor(0.0) is not None
    return 0 if definite else objective.negative_eigenvalues(outcome.x)
