"""Controllers that execute a plan: open loop, or with feedback."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError, nearest
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.robot.space.chart import Chart
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

MAX_BANDWIDTH = 1e6
"""Largest bandwidth of the feedback, in [rad/s]."""


@dataclass(frozen=True, eq=False)
class Controller(ABC):
    """u(q, v, t) for a plan that is executed from its start.

    plan: the motion and its torques.
    """

    plan: Trajectory
    _cache: dict[bytes, Sample] = field(default_factory=dict, init=False, repr=False)

    @abstractmethod
    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u (P, nv) in [N m] or [N], and du/d(q, v), shape (P, nv, 2, nv)."""

    def planned(self, t: Array) -> Sample:
        """q, v, a and tau of the plan at t (P,), clipped to its duration; caches the last call."""
        key = t.tobytes()
        if key not in self._cache:
            self._cache.clear()
            self._cache[key] = self.plan.sample(np.clip(t, 0.0, self.plan.duration))
        return self._cache[key]


@dataclass(frozen=True, eq=False)
class OpenLoop(Controller):
    """u = tau_plan(t)."""

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """The planned torques, independent of q and v."""
        return self.planned(t).tau, np.zeros((*v.shape, 2, v.shape[1]))


@dataclass(frozen=True, eq=False)
class ProportionalDerivative(Controller):
    """u = tau_plan + K (q_plan (-) q) + D (v_plan - v). [SicilianoKhatib2016, sec. 8.3]

    stiffness: K, shape (nv,), in [N m/rad]. damping: D, shape (nv,), in [N m s/rad].
    """

    stiffness: Array
    damping: Array

    @classmethod
    def of_bandwidth(cls, plan: Trajectory, robot: Robot, omega: float) -> ProportionalDerivative:
        """K = M_ii omega^2 and D = 2 M_ii omega, with the inertias at the start of the plan.

        omega: bandwidth of each decoupled joint, critically damped, in [rad/s].
        """
        mass = np.diagonal(MassMatrix(robot.model)(plan.q[:1])[0])
        return cls(plan, mass * omega**2, 2 * mass * omega)

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Independent feedback at each joint."""
        planned = self.planned(t)
        error, error_slopes = _position_error(self.plan, q, planned.q)
        u = planned.tau + self.stiffness * error + self.damping * (planned.v - v)
        damped = np.broadcast_to(-np.diag(self.damping), error_slopes.shape)
        return u, np.stack([self.stiffness[:, None] * error_slopes, damped], axis=2)


@dataclass(frozen=True, eq=False)
class ComputedTorque(Controller):
    """u = tau(q, v, a_plan + w^2 (q_plan (-) q) + 2 w (v_plan - v)) of the plan's own scene.

    If the plan's scene matches the simulated one, the error decays like exp(-w t) (1 + w t) in
    every joint; for orientations, if it is small. [SicilianoKhatib2016, sec. 8.5]

    scene: the model of the controller. omega: w, in [rad/s].
    """

    scene: Scene
    omega: float

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Inverse dynamics of the corrected acceleration."""
        planned, w, n = self.planned(t), self.omega, v.shape[1]
        error, error_slopes = _position_error(self.plan, q, planned.q)
        a = planned.a + w**2 * error + 2 * w * (planned.v - v)
        u, J = self.scene.torques.linearize(q, v, a, t)
        J = J.reshape(len(t), n, 3, n)
        by_q = J[:, :, 0] + w**2 * J[:, :, 2] @ error_slopes
        return u, np.stack([by_q, J[:, :, 1] - 2 * w * J[:, :, 2]], axis=2)


@dataclass(frozen=True, eq=False)
class PassiveJoints(Controller):
    """The torques of a controller, set to zero at passive joints.

    driver: the controller. passive: indices of the passive joints in v.
    """

    driver: Controller
    passive: npt.NDArray[np.intp]

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """The driver's torques with zeros at passive joints."""
        u, slope = (np.array(x) for x in self.driver.evaluate(q, v, t))
        u[:, self.passive], slope[:, self.passive] = 0.0, 0.0
        return u, slope


def _position_error(plan: Trajectory, q: Array, planned: Array) -> tuple[Array, Array]:
    """q_plan (-) q, shape (P, nv), and its derivatives by q in the tangent space, (P, nv, nv)."""
    if plan.space is None:
        n = q.shape[1]
        return planned - q, np.broadcast_to(-np.eye(n), (len(q), n, n))
    error = plan.space.difference(q, planned)
    return error, Chart(plan.space).difference_slopes(error)


FEEDBACKS = ("none", "pd", "computed-torque")


def controller(plan: Trajectory, feedback: str, scene: Scene, bandwidth: float) -> Controller:
    """A controller by name.

    feedback: "none", "pd" or "computed-torque". scene: the simulated scene; the inertias of its
    robot scale the gains, and its passive joints get no torque.
    bandwidth: of the feedback, in [rad/s]. Raises InputError.
    """
    driver = _driver(plan, feedback, scene, bandwidth)
    return PassiveJoints(plan, driver, scene.passive_coordinates) if scene.passive else driver


def _driver(plan: Trajectory, feedback: str, scene: Scene, bandwidth: float) -> Controller:
    if feedback not in FEEDBACKS:
        raise InputError(f"there is no feedback {feedback!r}: {nearest(feedback, FEEDBACKS)}")
    if feedback == "none":
        return OpenLoop(plan)
    if not 0 < bandwidth <= MAX_BANDWIDTH:
        raise InputError(
            f"the bandwidth must be positive and at most {MAX_BANDWIDTH:g} rad/s, got {bandwidth}."
        )
    if feedback == "pd":
        return ProportionalDerivative.of_bandwidth(plan, scene.robot, bandwidth)
    if scene.passive:
        have = "has" if len(scene.passive) == 1 else "have"
        raise InputError(
            f"computed torques need a motor at every joint, and {', '.join(scene.passive)} {have} "
            "none; choose the feedback 'pd'."
        )
    if plan.segments is not None:
        raise InputError(
            "computed torques need one scene, and a plan in segments has several; choose the "
            "feedback 'pd'."
        )
    if plan.scene is None:
        raise InputError(
            "computed torques need the plan's scene, which files do not store for a robot given as "
            "a pinocchio.Model; choose the feedback 'pd'."
        )
    return ComputedTorque(plan, plan.scene, bandwidth)
