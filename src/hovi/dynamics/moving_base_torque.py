"""Joint torques of a robot on a base with prescribed motion, with analytic derivatives.

The robot is mounted on six additional joints (three prismatic, three revolute), RNEA is evaluated
along their prescribed motion, and the rows of the robot's own joints are kept.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.kinds import compact
from hovi.dynamics.mimic_kernel import rnea_kernel
from hovi.dynamics.point_function import PointFunction, default_threads
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import times
from hovi.robot.model import with_distinct_frames

Array = npt.NDArray[np.float64]

_JOINTS = (
    ("x", pin.JointModelPX),
    ("y", pin.JointModelPY),
    ("z", pin.JointModelPZ),
    ("yaw", pin.JointModelRZ),
    ("pitch", pin.JointModelRY),
    ("roll", pin.JointModelRX),
)
BASE_DOF = len(_JOINTS)


def on_base_joints(model: pin.Model) -> pin.Model:
    """The model mounted on massless joints x, y, z, yaw, pitch and roll, which come first."""
    base = pin.Model()
    parent = 0
    for name, joint in _JOINTS:
        parent = base.addJoint(parent, joint(), pin.SE3.Identity(), f"moving base {name}")
    frame = base.addFrame(
        pin.Frame("moving base", parent, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
    )
    moved = pin.appendModel(base, with_distinct_frames(model)[0], frame, pin.SE3.Identity())
    moved.gravity.linear = model.gravity.linear
    moved.armature = np.concatenate([np.zeros(BASE_DOF), model.armature])
    return moved


def base_jet(base: ca.SX, t: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Positions, velocities and accelerations of the base's joints at t, each of shape (6,)."""
    velocity = ca.jtimes(base, t, ca.SX(1))
    return base, velocity, ca.jtimes(velocity, t, ca.SX(1))


def inverse_dynamics(
    model: pin.Model, base: ca.SX | None, q: ca.SX, v: ca.SX, a: ca.SX, t: ca.SX
) -> ca.SX:
    """RNEA of a model on a moving base, or on a fixed one if None, shape (nv,)."""
    if base is None:
        return casadi_functions(model).inverse_dynamics(q, v, a)
    jet = zip(base_jet(base, t), (q, v, a), strict=True)
    moved = casadi_functions(on_base_joints(model)).inverse_dynamics
    return moved(*(ca.vertcat(*pair) for pair in jet))[BASE_DOF:]


class MovingBaseTorque:
    """A TorqueModel: the rows of the robot's joints in the kernel on a moving base.

    model: without the base's joints. base: its (x, y, z, yaw, pitch, roll) as expressions of t.
    """

    def __init__(self, model: pin.Model, base: ca.SX, t: ca.SX) -> None:
        self.kernel = rnea_kernel(on_base_joints(model))
        self._jet = PointFunction(ca.Function("base", [t], list(base_jet(base, t))))
        columns = np.arange(3 * (BASE_DOF + model.nv)).reshape(3, -1)[:, BASE_DOF:]
        self._columns = columns.ravel()
        self._threads = default_threads()

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> Array:
        """tau, shape (P, nv)."""
        return compact(self.kernel.torque(*self._on_base(q, v, a, t))[:, BASE_DOF:])

    def linearize(
        self, q: Array, v: Array, a: Array, t: Array | None = None
    ) -> tuple[Array, Array]:
        """tau and its Jacobian."""
        tau, J = self.kernel.linearize(*self._on_base(q, v, a, t))
        return compact(tau[:, BASE_DOF:]), compact(J[:, BASE_DOF:, self._columns])

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array | None,
        R: Array,
        curvature: Array | None,
    ) -> tuple[Array, Array, Array]:
        """tau, J and the Hessian of TorqueModel.expand; the rows of the base have weight 0."""
        jet = self._on_base(q, v, a, t)
        if curvature is None:
            curvature = R * self.kernel.torque(*jet)[:, BASE_DOF:]
        zeros = np.zeros((len(q), BASE_DOF))
        weight = np.concatenate([zeros, np.broadcast_to(R, v.shape)], axis=1)
        curvature = np.concatenate([zeros, curvature], axis=1)
        tau, J, H = self.kernel.expand(*jet, weight, curvature, self._threads)
        kept = self._columns
        own = tau[:, BASE_DOF:], J[:, BASE_DOF:, kept], H[:, kept[:, None], kept]
        return compact(own[0]), compact(own[1]), compact(own[2])

    def _on_base(self, q: Array, v: Array, a: Array, t: Array | None) -> tuple[Array, Array, Array]:
        jets = zip(self._jet(times(t, len(q))), (q, v, a), strict=True)
        on_base = [np.concatenate(pair, axis=1) for pair in jets]
        return on_base[0], on_base[1], on_base[2]
