"""Inverse dynamics in doubles over many points, with analytic derivatives, in C++.

The fast sibling of `RigidBodyFunctions.inverse_dynamics`: closed-form derivatives of RNEA
[CarpentierMansard2018] [SinghRussellWensing2022] for packs of points at once. The curvature enters
before second derivatives are formed: no tensor of n^3 numbers arises.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.dynamics.joint_tree import JointTree, read_joint_tree
from hovi.errors import InputError, ModelError
from hovi.robot.space.joint_kinds import kind_of

Array = npt.NDArray[np.float64]


def joints_without_kernel(model: pin.Model) -> tuple[str, ...]:
    """Names of the joints for which there are no analytic second derivatives."""
    alone = list(model.parents)[1:].count(0) == 1

    def served(index: int) -> bool:
        kernel = kind_of(model.joints[index]).kernel
        return kernel == "anywhere" or (kernel == "as base" and index == 1 and alone)

    return tuple(str(model.names[i]) for i in range(1, model.njoints) if not served(i))


class InverseDynamicsKernel:
    """tau = M(q) a + b(q, v) with its first and second derivatives over a batch of points.

    Points come as q of shape (P, nq) and v, a of shape (P, n) in [rad], [rad/s], [rad/s^2] (metres
    for sliding joints). Derivatives are in the tangent space: second ones by q are those along
    `integrate`, which is q + dq where all joints are ordinary.
    The points are shared out over at most `threads` threads, as many as are worth starting; their
    number does not change a bit of the result. The GIL is released and nothing is allocated per
    point. One call at a time runs on a kernel: calls from several Python threads wait for each
    other.
    """

    def __init__(self, model: pin.Model) -> None:
        """Reads the model, gravity and armature included; later changes to it have no effect.

        model: a model all of whose joints are revolute, continuous, prismatic, helical or
            translations, except that one which carries all others may be a free-flyer, spherical
            or planar.

        Raises ModelError when it has others, such as mimic joints.
        """
        unsupported = joints_without_kernel(model)
        if unsupported:
            raise ModelError(
                "analytic second derivatives exist only for joints with fixed axes and for a base "
                f"that carries all others, not for {', '.join(map(repr, unsupported))}; use "
                "hovi.dynamics.symbolic_dynamics.casadi_functions, or lock these joints."
            )
        self.__setstate__(read_joint_tree(model))

    def __getstate__(self) -> JointTree:
        """Pickled as the joint tree: the kernel is built again on the other side."""
        return self._tree

    def __setstate__(self, tree: JointTree) -> None:
        """Builds the kernel again from what `__getstate__` gave."""
        self._tree = tree
        self._compiled = tree.compiled()
        self._nq = int(self._compiled.nq)
        self._n = int(self._compiled.n)

    @property
    def n(self) -> int:
        """Number of degrees of freedom, nv."""
        return self._n

    def torque(self, q: Array, v: Array, a: Array, threads: int = 1) -> Array:
        """tau(q, v, a) at each point.

        q: shape (P, nq); v, a: shape (P, n), in [rad], [rad/s], [rad/s^2].
        threads: how many threads share the points.

        Returns tau (P, n) in [N m]. Raises InputError on a wrong shape.
        """
        q, v, a = self._points(q, v, a)
        _check_threads(threads)
        tau = np.empty_like(v)
        self._compiled.torque(q, v, a, tau, threads)
        return tau

    def linearize(self, q: Array, v: Array, a: Array, threads: int = 1) -> tuple[Array, Array]:
        """tau and J = d tau / d(q, v, a) at each point.

        q: shape (P, nq); v, a: shape (P, n), in [rad], [rad/s], [rad/s^2].
        threads: how many threads share the points.

        Returns tau (P, n) in [N m] and J (P, n, 3n), columns dq | dv | da. Raises InputError on a
        wrong shape.
        """
        q, v, a = self._points(q, v, a)
        _check_threads(threads)
        tau = np.empty_like(v)
        J = np.empty((*v.shape, 3 * self._n))
        self._compiled.linearize(q, v, a, tau, J, threads)
        return tau, J

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        weight: Array,
        curvature: Array | None = None,
        threads: int = 1,
    ) -> tuple[Array, Array, Array]:
        """tau, J and H = J^T diag(weight) J + sum_i curvature_i d^2 tau_i at each point.

        q: shape (P, nq); v, a: shape (P, n), in [rad], [rad/s], [rad/s^2].
        weight: shape (n,) or (P, n), the metric of the torques.
        curvature: shape (P, n), what multiplies each torque's second derivative; None drops the
            sum. With curvature = weight * tau, H is the Hessian of 1/2 tau^T diag(weight) tau.
        threads: how many threads share the points.

        Returns tau (P, n), J (P, n, 3n) and H (P, 3n, 3n), symmetric to the last bit, with index
        [k * n + i, l * n + j] for the i-th coordinate of the k-th of (q, v, a). Raises InputError
        on a wrong shape.
        """
        q, v, a = self._points(q, v, a)
        if np.shape(weight) == (self._n,):
            weight = np.full(v.shape, weight)
        weight = self._array("weight", weight, v.shape)
        if curvature is not None:
            curvature = self._array("curvature", curvature, v.shape)
        _check_threads(threads)
        tau = np.empty_like(v)
        J = np.empty((*v.shape, 3 * self._n))
        H = np.empty((len(q), 3 * self._n, 3 * self._n))
        self._compiled.expand(q, v, a, weight, curvature, tau, J, H, threads)
        return tau, J, H

    def _points(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        points = np.shape(q)[:1] or (1,)
        q = self._array("q", q, (*points, self._nq))
        v = self._array("v", v, (*points, self._n))
        return q, v, self._array("a", a, v.shape)

    def _array(self, name: str, x: Array, shape: tuple[int, ...]) -> Array:
        x = np.ascontiguousarray(x, dtype=np.float64)
        if x.shape != shape:
            raise InputError(f"{name} must have shape {shape}, got {x.shape}.")
        return x


def _check_threads(threads: int) -> None:
    if threads < 1:
        raise InputError(f"threads must be at least 1, got {threads}.")
