"""The kernel for robots with mimic joints: RNEA of the uncoupled robot in reduced coordinates.

With all joints free the robot has q_all = G q + g, v_all = G v and a_all = G a, so that

    tau = G^T tau_all,  d tau = G^T d tau_all diag(G, G, G),  d2 tau likewise,

which is exact and costs small matrix products at each point.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.dynamics.inverse_dynamics_kernel import InverseDynamicsKernel, joints_without_kernel
from hovi.robot.mimic_model import CoordinateMap, uncoupled

Array = npt.NDArray[np.float64]


class MimicKernel:
    """As InverseDynamicsKernel, for a model with mimic joints.

    model: with gravity and armature.
    """

    def __init__(self, model: pin.Model) -> None:
        free = uncoupled(model)
        self.kernel = InverseDynamicsKernel(free)
        self.coordinate_map = CoordinateMap.of(model, free)
        self.G = self.coordinate_map.matrix  # (nv_all, nv)
        self._blocks = np.kron(np.eye(3), self.G)  # diag(G, G, G), (3 nv_all, 3 nv)

    def torque(self, q: Array, v: Array, a: Array, threads: int = 1) -> Array:
        """tau at P points, shape (P, nv): q (P, nq), v and a (P, nv)."""
        return self.kernel.torque(*self._all(q, v, a), threads) @ self.G

    def linearize(self, q: Array, v: Array, a: Array, threads: int = 1) -> tuple[Array, Array]:
        """tau and d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        tau, J = self.kernel.linearize(*self._all(q, v, a), threads)
        return tau @ self.G, self.G.T @ (J @ self._blocks)

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        weight: Array,
        curvature: Array | None = None,
        threads: int = 1,
    ) -> tuple[Array, Array, Array]:
        """tau, J and J^T diag(weight) J + sum_i curvature_i d2 tau_i, shape (P, 3 nv, 3 nv).

        The weights apply to G^T tau_all, which no weights of tau_all can express, so the kernel
        evaluates only the second derivatives.
        """
        points = self._all(q, v, a)
        curvature_all = None if curvature is None else curvature @ self.G.T
        tau, J, H = self.kernel.expand(*points, np.zeros_like(points[1]), curvature_all, threads)
        pulled = self.G.T @ (J @ self._blocks)  # (P, nv, 3 nv)
        weighted = np.broadcast_to(weight, v.shape)[..., None] * pulled
        H = self._blocks.T @ (H @ self._blocks) + np.matmul(pulled.transpose(0, 2, 1), weighted)
        return tau @ self.G, pulled, H

    def _all(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(q_all, v_all, a_all) of all joints."""
        return self.coordinate_map.configurations(q), v @ self.G.T, a @ self.G.T


def rnea_kernel(model: pin.Model) -> InverseDynamicsKernel | MimicKernel:
    """The kernel of a model, with or without mimic joints. Raises ModelError."""
    return MimicKernel(model) if len(model.mimicking_joints) else InverseDynamicsKernel(model)


def without_rnea_kernel(model: pin.Model) -> tuple[str, ...]:
    """Names of the joints that the kernel of a model does not support; mimic joints count too."""
    return joints_without_kernel(uncoupled(model) if len(model.mimicking_joints) else model)
