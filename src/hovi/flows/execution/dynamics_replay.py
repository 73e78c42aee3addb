"""Forward-simulates the planned torques with Pinocchio's ABA and Boost's odeint, and compares.

The forward dynamics are integrated from every node to the next by an independent method. This
verifies dynamics and torques, not optimality: the inverse dynamics of any curve reproduce it.

ABA does not support mimic joints. For these, accelerations follow from the mass matrix of the
uncoupled robot, reduced by the same G as the planned torques: an error in G is not detected.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi._native.integration import integrate
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.robot.frame_distance import FrameDistance
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene, without_inertia
from hovi.system.dataclass import dataclass
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-11, 1e-13
"""Tolerances of the integration."""
TORQUE_TOLERANCE = 1e-9
"""Relative difference below which torques are considered equal."""


@dataclass(frozen=True, eq=False)
class DynamicsReplay:
    """Deviations at each node of a simulation that starts at the previous node.

    q, v: of every joint coordinate, shape (N, nv), in [rad] and [rad/s]; metres for prismatic
        joints.
    tip: of the origin of a frame, or the largest of several, shape (N,), in [m]. frame: its name,
        or that of the frame with the largest deviation.
    sliding: which joint coordinates are lengths, shape (nv,).
    """

    q: Array = field(repr=False)
    v: Array = field(repr=False)
    tip: Array = field(repr=False)
    frame: str
    sliding: npt.NDArray[np.bool_] = field(repr=False)

    @property
    def angle(self) -> float:
        """The largest deviation of an angle, in [rad]."""
        return float(np.max(self.q[:, ~self.sliding], initial=0.0))

    @property
    def slide(self) -> float:
        """The largest deviation of a length, in [m]."""
        return float(np.max(self.q[:, self.sliding], initial=0.0))

    @property
    def largest_tip(self) -> float:
        """The largest deviation, that of `frame`, in [m]."""
        return float(np.max(self.tip))


def replay_dynamics(trajectory: Trajectory, frame: str | None = None) -> DynamicsReplay:
    """Simulate all intervals under the planned torques at once, by Boost's odeint.

    Its Runge-Kutta-Fehlberg method of order 8 (7) chooses the steps.

    a = ABA(q, v, tau - torques of effects), with tau of the interpolant at the same times and zero
    at passive joints; each interval starts at its node, in the chart of that node.
    frame: whose deviation is reported, by default the largest of the robot's tip_frames.
    The intervals of a segment are simulated in its own scene.
    Raises InputError with the reason if this is not possible.
    """
    robot, parts = _parts_of(trajectory)
    if bare := without_inertia(parts[0][0]):
        raise InputError(f"there is no inertia at joint {bare}")
    robot.measured_frames(
        frame
    )  # raises for a frame that is unknown or fixed, before the integration
    N, n = trajectory.v[:-1].shape
    h, start = trajectory.grid.steps[:, None], trajectory.q[:-1]
    forward = [_ForwardDynamics(scene, trajectory, index) for scene, index in parts]
    k = np.arange(N)

    def rates(s: float, y: Array) -> Array:
        x, hv = y.reshape(2, N, n)
        raise_if_late()
        tau = trajectory.sample_intervals(k, np.full(N, s)).tau
        t = trajectory.t[:-1] + s * trajectory.grid.steps
        given = robot.integrate(start, x), hv / h, tau, t
        a = np.concatenate([each(*(row[each.index] for row in given)) for each in forward])
        return np.concatenate([chart_rates(robot, start, x, hv), h * h * a]).ravel()

    y = np.concatenate([np.zeros((N, n)), h * trajectory.v[:-1]]).ravel()
    try:
        integrate(rates, y, 0.0, 1.0, RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE)
    except RuntimeError as stuck:
        raise InputError(f"odeint did not reach the end of an interval: {stuck}") from None
    x, hv = y.reshape(2, N, n)
    arrived = robot.integrate(start, x)
    tip = FrameDistance.between(robot, arrived, trajectory.q[1:], frame)
    return DynamicsReplay(
        np.abs(robot.difference(trajectory.q[1:], arrived)),
        np.abs(hv / h - trajectory.v[1:]),
        tip.largest,
        tip.frame,
        robot.sliding,
    )


def chart_rates(robot: Robot, origin: Array, x: Array, v: Array) -> Array:
    """x' of q = origin (+) x with velocity v, (M, nv): v itself on commutative groups.

    Otherwise v = D x' with the derivative D of (+) with respect to x, in the tangent space at q.
    """
    if all(joint.nq == joint.nv or joint.nv == 1 for joint in list(robot.model.joints)[1:]):
        return v
    rates = np.empty_like(v)
    for i, (q, dq) in enumerate(zip(origin, x, strict=True)):
        D = pin.dIntegrate(robot.model, q, dq, pin.ArgumentPosition.ARG1)
        rates[i] = np.linalg.solve(D, v[i])
    return rates


class _ForwardDynamics:
    """a(q, v, tau, t) of a scene by Pinocchio's ABA, in some intervals of a motion.

    Torques of effects are subtracted first; they must not depend on a.
    """

    def __init__(self, scene: Scene, trajectory: Trajectory, index: Index) -> None:
        self.scene = scene
        self.index = index
        self.data = scene.model.createData()
        self.passive = scene.passive_coordinates
        self._mass = MassMatrix(scene.model) if scene.robot.couplings else None
        motion = trajectory.sample_intervals(index, np.full(len(index), 0.5))
        t = trajectory.t[index] + 0.5 * trajectory.grid.steps[index]
        moving = self._added(motion.q, motion.v, motion.a, t)
        still = self._added(motion.q, motion.v, np.zeros_like(motion.a), t)
        # along a motion of mechanics tau is rounding, of which the inertial torque is the scale
        holding = scene.inverse_dynamics(motion.q, motion.v, np.zeros_like(motion.a), t)
        size = max(float(np.max(np.abs([motion.tau, holding]))), 1e-12)
        if np.max(np.abs(moving - still)) > TORQUE_TOLERANCE * size:
            raise InputError(
                "an effect adds torques that depend on the acceleration, which ABA does not support"
            )
        self.plain = bool(np.max(np.abs(still)) <= TORQUE_TOLERANCE * size)

    def __call__(self, q: Array, v: Array, tau: Array, t: Array) -> Array:
        """Accelerations, shape (M, nv)."""
        tau = tau.copy()
        tau[:, self.passive] = 0.0
        if not self.plain:
            tau = tau - self._added(q, v, np.zeros_like(v), t)
        model, data = self.scene.model, self.data
        if self._mass is None:
            rows = zip(q, v, tau, strict=True)
            return np.array([pin.aba(model, data, *row) for row in rows])
        bias = [pin.nonLinearEffects(model, data, *row).copy() for row in zip(q, v, strict=True)]
        force = (tau - np.array(bias))[..., None]
        return np.asarray(np.linalg.solve(self._mass(q), force)[..., 0])

    def _added(self, q: Array, v: Array, a: Array, t: Array) -> Array:
        model, data = self.scene.model, self.data
        rigid = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
        return np.asarray(self.scene.inverse_dynamics(q, v, a, t) - rigid)


def _parts_of(trajectory: Trajectory) -> tuple[Robot, list[tuple[Scene, Index]]]:
    """The robot, and the scene of each segment with its intervals, in order of time."""
    k = np.arange(trajectory.grid.intervals)
    if trajectory.segments is not None:
        known = trajectory.segments
        pieces = np.split(k, np.cumsum(known.intervals)[:-1])
        return known.robot, list(zip(known.scenes, pieces, strict=True))
    if trajectory.scene is None:
        raise InputError("the motion was saved without its scene")
    return trajectory.scene.robot, [(trajectory.scene, k)]
