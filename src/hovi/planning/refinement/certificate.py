"""certify: checks of a plan, each with its number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.conditions.excess import excess_of
from hovi.discrete.curve_integral import CurveIntegral, integral_along
from hovi.discrete.measures.motion_error import MotionError, relative_difference
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.flows.execution.dynamics_replay import DynamicsReplay, replay_dynamics
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.error_estimate import estimate_error
from hovi.planning.refinement.nodal_hamiltonian import NodalHamiltonian, nodal_hamiltonian
from hovi.planning.solver.outcome.cost_with_time import price_of_time
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError, raise_if_late
from hovi.system.interruption import interruptible

Array = npt.NDArray[np.float64]
T = TypeVar("T")

PEAK_SAMPLES = 33
"""Samples per interval for peak torques and velocities, both ends included."""


@dataclass(frozen=True)
class Peak:
    """The largest absolute value along a motion, also between the nodes.

    value: in [N m] or [rad/s], or [N] and [m/s] for sliding joints. joint: name of the coordinate.
    t: time, in [s].
    """

    value: float
    joint: str
    t: float


@dataclass(frozen=True, eq=False)
class Certificate:
    """Checks of a plan; one that is not available is None, with the reason in `missing`.

    status: of the solve. n_neg: negative eigenvalues of the action's Hessian.
    action: the discrete action of L~, which is the plan's cost without the price of time. price:
        that of time. integral: of L~ along the interpolant, by a quadrature that the scheme does
        not use. integral_error: of the quadrature.
    bound: upper bound of the cost of this local minimum, the integral plus its error: for a curve
        that satisfies all constraints, since no such curve nearby costs less than the minimum.
    errors: estimates of the distance from the motion that the plan approximates.
    hamiltonian: Pontryagin's, at the nodes.
    residual: largest jump of the momenta at an inner node, relative to the largest momentum.
    torque, velocity: peaks along the motion.
    replay: forward simulation of the planned torques.
    missing: reasons for missing checks, by field name.
    """

    status: Status
    n_neg: int
    action: float
    integral: float
    integral_error: float
    bound: float | None
    errors: MotionError | None
    hamiltonian: NodalHamiltonian | None
    residual: float | None
    torque: Peak | None
    velocity: Peak
    replay: DynamicsReplay | None
    missing: dict[str, str] = field(default_factory=dict)
    price: float = 0.0

    @property
    def quadrature(self) -> float:
        """Difference of the action and the integral, relative to the cost."""
        return relative_difference(self.action + self.price, self.integral + self.price)


@check_arguments_except("solution")
@interruptible
def certify(
    solution: Solution,
    frame: str | None = None,
    *,
    estimate: bool = True,
    time_limit: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Certificate:
    """The certificate of a solution.

    frame: whose errors are reported, by default that of the tolerance, or else the one of the
        robot's tip_frames with the largest error. estimate: whether errors are estimated if the
        solution has no estimate, which takes another solve.
    time_limit: in [s]. Checks that it ends, or that it leaves no time for, are missing.
    progress: called with the name of each check that may take long, before it begins.
    Raises InputError if the solution has no problem, or for a frame that is unknown or does not
    move.
    """
    expect(solution, Solution, "what `plan` returned")
    problem, trajectory = solution.problem, solution.trajectory
    if problem is None:
        raise InputError("this solution has no problem; call plan again instead.")
    if problem.about_robot or frame is not None:
        problem.robot.measured_frames(frame)  # raises for a frame that is unknown or fixed
    missing: dict[str, str] = {}
    deadline, report = Deadline(time_limit), progress or (lambda name: None)

    def checked(name: str, statement: Callable[[], T]) -> T | None:
        report(name)
        try:
            with deadline.in_force():
                raise_if_late()
                return statement()
        except (InputError, OutOfTimeError) as reason:
            missing[name] = str(reason).removesuffix(".")
            return None

    torque, velocity = _peaks(trajectory)
    if torque is None:
        missing["torque"] = "the motion has no torques"
    integral = integral_along(problem.ld.lagrangian, trajectory)
    return Certificate(
        status=solution.status,
        n_neg=solution.n_neg,
        action=problem.ld.action(trajectory.path),
        integral=integral.value,
        integral_error=integral.error,
        bound=checked("bound", lambda: _upper_bound(solution, problem, integral)),
        errors=checked("errors", lambda: _errors(solution, frame, estimate)),
        hamiltonian=checked("hamiltonian", lambda: nodal_hamiltonian(problem, trajectory)),
        residual=checked("residual", lambda: momentum_jump(problem, trajectory)),
        torque=torque,
        velocity=velocity,
        replay=checked("replay", lambda: replay_dynamics(trajectory, frame)),
        missing=missing,
        price=price_of_time(problem),
    )


def _upper_bound(solution: Solution, problem: TrajectoryProblem, integral: CurveIntegral) -> float:
    """integral + error. Raises InputError where the curve does not satisfy what was asked."""
    if solution.status is not Status.MINIMUM:
        raise InputError(f"the motion is no minimum but ended in {solution.status}")
    if problem.constrained:
        raise InputError("equations hold at points, or in moments, only")
    if problem.distances is not None:
        raise InputError("the distances along the curve are known to a tolerance only")
    if problem.limits is not None and problem.limited:
        excess = -float(closeness(solution.trajectory, problem.limits).min())
        if excess > problem.limits.tolerance:
            raise InputError(f"the curve exceeds a limit by {excess:.1e} of its range")
    for each in problem.bounds:
        excess = float(excess_of(solution.trajectory, each).max())
        if excess > each.tolerance:
            raise InputError(
                f"the curve exceeds condition {each.name!r} by {excess:.1e} of its scale"
            )
    return integral.upper_bound


def momentum_jump(problem: TrajectoryProblem, trajectory: Trajectory) -> float:
    """Relative residual of the discrete Euler-Lagrange equations at the inner nodes.

    Of a periodic motion at all nodes; not where the goal of a segment fixes the motion.

    The largest |F+ L_d - F- L_d| of p and of p~, each relative to the largest of its kind; rounding
    contributes like eps/h^3. Raises InputError if multipliers contribute to the equations.
    """
    if problem.limited or problem.constrained:
        raise InputError("multipliers of limits or constraints contribute to it")
    D = problem.ld.derivatives(trajectory.path)
    k = problem.ld.k
    ends = np.roll(D, 1, axis=0)[:, k:] + D[:, :k]  # that of the first node is of a cycle
    for each in problem.holds:
        ends[each.node, :2][each.fixed] = 0.0
        if each.higher is not None:
            ends[each.node, 2:] = 0.0
    jump = np.abs(ends[0 if problem.periodic else 1 :]).max(axis=(0, 2), initial=0.0)
    sizes = np.abs(D).reshape(len(D), 2, k, -1).max(axis=(0, 1, 3))
    return float(np.max(jump / np.maximum(sizes, np.finfo(float).tiny)))


def _errors(solution: Solution, frame: str | None, estimate: bool) -> MotionError:
    known = None if solution.accuracy is None else solution.accuracy.estimate
    if known is not None and _is_measured_at(frame, solution):
        return known
    if not estimate:
        raise InputError("not estimated, as it takes another solve; plan with a tolerance")
    found = estimate_error(solution, frame)
    if found is None:
        raise_if_late()
        raise InputError("no nearby solution was found on a finer grid")
    return found


def _is_measured_at(frame: str | None, solution: Solution) -> bool:
    """Whether a solution's own estimate is of a frame; None stands for whatever it is of."""
    problem, accuracy = solution.problem, solution.accuracy
    if frame is None or problem is None or accuracy is None:
        return frame is None
    of = problem.robot.measured_frames
    return of(frame) == of(accuracy.tolerance.frame)


def _peaks(trajectory: Trajectory) -> tuple[Peak | None, Peak]:
    """The largest torque, if there are any, and velocity, from samples of every interval."""
    N = trajectory.grid.intervals
    k = np.repeat(np.arange(N), PEAK_SAMPLES)
    s = np.tile(np.linspace(0.0, 1.0, PEAK_SAMPLES), N)
    motion = trajectory.sample_intervals(k, s)
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    torque = _peak(motion.tau, trajectory, t) if motion.tau.size else None
    return torque, _peak(motion.v, trajectory, t)


def _peak(values: Array, trajectory: Trajectory, t: Array) -> Peak:
    m, i = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    return Peak(float(abs(values[m, i])), trajectory.coordinate_names[i], float(t[m]))
