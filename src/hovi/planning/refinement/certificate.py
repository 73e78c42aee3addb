"""certify: what can be said for a plan, each statement with the number behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hovi.discrete.motion_error import MotionError, relative_difference
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, expect
from hovi.flows.dynamics_replay import DynamicsReplay, replay_dynamics
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.error_estimate import estimate_error
from hovi.planning.refinement.nodal_hamiltonian import NodalHamiltonian, nodal_hamiltonian
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.system.interruption import interruptible

Array = npt.NDArray[np.float64]
T = TypeVar("T")

MORE_POINTS = 6
"""Gauss points that the integral along the interpolant takes besides those of the scheme."""
PEAK_PLACES = 33
"""Places of an interval at which torques and velocities are looked at, both ends included."""


@dataclass(frozen=True)
class Peak:
    """The largest absolute value along a motion, between the nodes too.

    value: in [N m] or [rad/s]; newtons and metres per second for sliding joints. joint: the
    coordinate's name. t: when, in [s].
    """

    value: float
    joint: str
    t: float


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is known of a plan; a statement that could not be made is None, with the reason.

    status: what the solve ended in. n_neg: negative eigenvalues of the action's Hessian.
    action: the discrete action of L~, which is the plan's cost. integral: of L~ along the
        interpolant, by a finer quadrature.
    errors: estimates of what separates the plan from the motion that it approximates.
    hamiltonian: Pontryagin's, at the nodes.
    residual: largest jump of the momenta at an inner node, relative to the largest momentum.
    torque, velocity: the largest along the motion.
    replay: the robot driven by the planned torques.
    missing: why a statement is missing, by its name.
    """

    status: Status
    n_neg: int
    action: float
    integral: float
    errors: MotionError | None
    hamiltonian: NodalHamiltonian | None
    residual: float | None
    torque: Peak
    velocity: Peak
    replay: DynamicsReplay | None
    missing: dict[str, str] = field(default_factory=dict)

    @property
    def quadrature(self) -> float:
        """Relative difference of the action and the integral."""
        return relative_difference(self.action, self.integral)


@interruptible
def certify(solution: Solution, frame: str | None = None, *, estimate: bool = True) -> Certificate:
    """What can be said for a solution.

    frame: whose errors are told, by default the robot's tip_frame. estimate: whether errors are
        estimated where the solution does not bring them along, at the price of a solve.
    Raises InputError when the solution does not know its problem, or for an unknown frame.
    """
    expect(solution, Solution, "what `plan` returned")
    problem, trajectory = solution.problem, solution.trajectory
    if problem is None:
        raise InputError("this solution does not know its problem; plan again instead.")
    name = problem.robot.tip_frame if frame is None else frame
    problem.robot.frame_position(name, trajectory.q[:1])  # an unknown frame speaks first
    missing: dict[str, str] = {}

    def stated(name: str, statement: Callable[[], T]) -> T | None:
        try:
            return statement()
        except InputError as reason:
            missing[name] = str(reason).removesuffix(".")
            return None

    torque, velocity = _peaks(trajectory)
    return Certificate(
        status=solution.status,
        n_neg=solution.n_neg,
        action=problem.ld.action(trajectory.path),
        integral=cost_integral(problem, trajectory),
        errors=stated("errors", lambda: _errors(solution, frame, estimate)),
        hamiltonian=stated("hamiltonian", lambda: nodal_hamiltonian(problem, trajectory)),
        residual=stated("residual", lambda: momentum_jump(problem, trajectory)),
        torque=torque,
        velocity=velocity,
        replay=stated("replay", lambda: replay_dynamics(trajectory, frame)),
        missing=missing,
    )


def cost_integral(problem: TrajectoryProblem, trajectory: Trajectory) -> float:
    """The integral of L~ along the interpolant, by Gauss quadrature on every interval."""
    grid = trajectory.grid
    x, w = np.polynomial.legendre.leggauss(grid.inner_modes + 2 + MORE_POINTS)
    k = np.repeat(np.arange(grid.intervals), len(x))
    s = np.tile((x + 1) / 2, grid.intervals)
    q, v, a = trajectory.jet_intervals(k, s)
    values = problem.ld.lagrangian.value(q, v, a, t=trajectory.t[k] + s * grid.steps[k])
    return float(grid.steps @ (values.reshape(grid.intervals, -1) @ (w / 2)))


def momentum_jump(problem: TrajectoryProblem, trajectory: Trajectory) -> float:
    """How far the discrete Euler-Lagrange equations are from zero at the inner nodes.

    The largest |F+ L_d - F- L_d| of p and of p~, each relative to the largest of its kind: it
    grows like eps/h^3 with rounding. Raises InputError where multipliers have a part in it.
    """
    if problem.limited or problem.constrained:
        raise InputError("the multipliers of limits or equations have a part in it")
    D = problem.ld.derivatives(trajectory.path)
    jump = np.abs(D[:-1, 2:] + D[1:, :2]).max(axis=(0, 2), initial=0.0)
    sizes = np.abs(D).reshape(len(D), 2, 2, -1).max(axis=(0, 1, 3))
    return float(np.max(jump / np.maximum(sizes, np.finfo(float).tiny)))


def _errors(solution: Solution, frame: str | None, estimate: bool) -> MotionError:
    known = None if solution.accuracy is None else solution.accuracy.estimate
    if known is not None and (frame is None or frame == known.frame):
        return known
    if not estimate:
        raise InputError("not estimated, since that takes another solve: plan with a tolerance")
    found = estimate_error(solution, frame)
    if found is None:
        raise InputError("no finer solution was found nearby to compare with")
    return found


def _peaks(trajectory: Trajectory) -> tuple[Peak, Peak]:
    """The largest torque and velocity from samples of every interval."""
    N = trajectory.grid.intervals
    k = np.repeat(np.arange(N), PEAK_PLACES)
    s = np.tile(np.linspace(0.0, 1.0, PEAK_PLACES), N)
    motion = trajectory.sample_intervals(k, s)
    t = trajectory.t[k] + s * trajectory.grid.steps[k]
    return _peak(motion.tau, trajectory, t), _peak(motion.v, trajectory, t)


def _peak(values: Array, trajectory: Trajectory, t: Array) -> Peak:
    m, i = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    return Peak(float(abs(values[m, i])), trajectory.coordinate_names[i], float(t[m]))
