"""Torques that play a plan: as planned, or with a feedback that holds the motion to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import InputError, nearest
from hovi.robot.mass_matrix import MassMatrix
from hovi.robot.robot import Robot
from hovi.robot.space.chart import Chart
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Controller(ABC):
    """u(q, v, t) for a plan that is played from its start.

    plan: the motion and its torques.
    """

    plan: Trajectory
    _last: dict[bytes, Sample] = field(default_factory=dict, init=False, repr=False)

    @abstractmethod
    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u (P, nv) in [N m] or [N], and du/d(q, v), shape (P, nv, 2, nv)."""

    def planned(self, t: Array) -> Sample:
        """q, v, a and tau of the plan at t (P,), its ends held; the last times are remembered."""
        key = t.tobytes()
        if key not in self._last:
            self._last.clear()
            self._last[key] = self.plan.sample(np.clip(t, 0.0, self.plan.duration))
        return self._last[key]


@dataclass(frozen=True, eq=False)
class OpenLoop(Controller):
    """u = tau_plan(t)."""

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """The planned torques, whatever happens."""
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
        """K = M_ii omega^2 and D = 2 M_ii omega, with the masses at the plan's start.

        omega: what each joint would have alone, critically damped, in [rad/s].
        """
        mass = np.diagonal(MassMatrix(robot.model)(plan.q[:1])[0])
        return cls(plan, mass * omega**2, 2 * mass * omega)

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Feedback by joint."""
        wanted = self.planned(t)
        ahead, slopes = _ahead(self.plan, q, wanted.q)
        u = wanted.tau + self.stiffness * ahead + self.damping * (wanted.v - v)
        damped = np.broadcast_to(-np.diag(self.damping), slopes.shape)
        return u, np.stack([self.stiffness[:, None] * slopes, damped], axis=2)


@dataclass(frozen=True, eq=False)
class ComputedTorque(Controller):
    """u = tau(q, v, a_plan + w^2 (q_plan (-) q) + 2 w (v_plan - v)) of the plan's own scene.

    Where the world is as planned, the error decays like exp(-w t) (1 + w t) in every joint; in
    orientations as far as it is small.
    [SicilianoKhatib2016, sec. 8.5]

    scene: what is believed. omega: w, in [rad/s].
    """

    scene: Scene
    omega: float

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """Inverse dynamics of the corrected acceleration."""
        wanted, w, n = self.planned(t), self.omega, v.shape[1]
        ahead, slopes = _ahead(self.plan, q, wanted.q)
        a = wanted.a + w**2 * ahead + 2 * w * (wanted.v - v)
        u, J = self.scene.torques.linearize(q, v, a, t)
        J = J.reshape(len(t), n, 3, n)
        by_q = J[:, :, 0] + w**2 * J[:, :, 2] @ slopes
        return u, np.stack([by_q, J[:, :, 1] - 2 * w * J[:, :, 2]], axis=2)


@dataclass(frozen=True, eq=False)
class WithoutMotors(Controller):
    """The torques of a controller, and none at joints that carry none.

    driver: whose torques they are. passive: places of those joints in v.
    """

    driver: Controller
    passive: npt.NDArray[np.intp]

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """As the driver's, with zeros."""
        u, slope = (np.array(x) for x in self.driver.evaluate(q, v, t))
        u[:, self.passive], slope[:, self.passive] = 0.0, 0.0
        return u, slope


def _ahead(plan: Trajectory, q: Array, wanted: Array) -> tuple[Array, Array]:
    """q_plan (-) q, shape (P, nv), and its derivatives by q in the tangent space, (P, nv, nv)."""
    if plan.space is None:
        n = q.shape[1]
        return wanted - q, np.broadcast_to(-np.eye(n), (len(q), n, n))
    ahead = plan.space.difference(q, wanted)
    return ahead, Chart(plan.space).difference_slopes(ahead)


FEEDBACKS = ("none", "pd", "computed-torque")


def controller(plan: Trajectory, feedback: str, scene: Scene, bandwidth: float) -> Controller:
    """The controller of a name.

    feedback: "none", "pd" or "computed-torque". scene: what is driven; its robot's masses scale
    the gains, and its passive joints get no torque.
    bandwidth: of the feedback, in [rad/s]. Raises InputError.
    """
    driver = _driver(plan, feedback, scene, bandwidth)
    return WithoutMotors(plan, driver, scene.passive_coordinates) if scene.passive else driver


def _driver(plan: Trajectory, feedback: str, scene: Scene, bandwidth: float) -> Controller:
    if feedback not in FEEDBACKS:
        raise InputError(f"there is no feedback {feedback!r}: {nearest(feedback, FEEDBACKS)}")
    if feedback == "none":
        return OpenLoop(plan)
    if not 0 < bandwidth < np.inf:
        raise InputError(f"the bandwidth must be positive and finite, got {bandwidth} rad/s.")
    if feedback == "pd":
        return ProportionalDerivative.of_bandwidth(plan, scene.robot, bandwidth)
    if scene.passive:
        have = "has" if len(scene.passive) == 1 else "have"
        raise InputError(
            f"computed torques need a motor at every joint, and {', '.join(scene.passive)} {have} "
            "none; choose the feedback 'pd'."
        )
    if plan.scene is None:
        raise InputError(
            "computed torques need the plan's scene, which a robot given as a pinocchio.Model does "
            "not leave in a file; choose the feedback 'pd'."
        )
    return ComputedTorque(plan, plan.scene, bandwidth)
