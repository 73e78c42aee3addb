"""Inverse dynamics of batches of points with analytic derivatives, in C++.

The fast counterpart of `RigidBodyFunctions.inverse_dynamics`: closed-form derivatives of RNEA
[CarpentierMansard2018] [SinghRussellWensing2022], vectorized over points. Second derivatives are
contracted with the curvature on the fly: no tensor with n^3 entries is formed.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi._native import dynamics as native
from hovi.checks.shapes import numbers_of
from hovi.dynamics.joint_tree import JointTree, read_joint_tree
from hovi.errors import InputError, ModelError
from hovi.robot.space.joint_kinds import kind_of

Array = npt.NDArray[np.float64]


def joints_without_kernel(model: pin.Model) -> tuple[str, ...]:
    """Names of the joints without analytic second derivatives."""
    alone = list(model.parents)[1:].count(0) == 1

    def supported(index: int) -> bool:
        kernel = kind_of(model.joints[index]).kernel
        return kernel == "anywhere" or (kernel == "as base" and index == 1 and alone)

    return tuple(str(model.names[i]) for i in range(1, model.njoints) if not supported(i))


class InverseDynamicsKernel:
    """tau = M(q) a + b(q, v) with its first and second derivatives over a batch of points.

    Points are q of shape (P, nq) and v, a of shape (P, n) in [rad], [rad/s], [rad/s^2] (metres for
    prismatic joints). Derivatives are in the tangent space: those in q are taken along `integrate`,
    which is q + dq on a vector space.
    The points are distributed over at most `threads` threads, as many as pay off; results are
    bitwise independent of their number. The GIL is released and nothing is allocated per point.
    Calls of one kernel from several Python threads run one after the other.
    """

    def __init__(self, model: pin.Model) -> None:
        """Reads the model with its gravity and armature; later changes to it have no effect.

        model: all joints are revolute, continuous, prismatic, helical or translations; a first
            joint on which all others stand may also be a free-flyer, spherical or planar.

        Raises ModelError for other joints, such as mimic joints.
        """
        unsupported = joints_without_kernel(model)
        if unsupported:
            raise ModelError(
                "analytic second derivatives exist only for joints with fixed axes and for a base "
                f"joint, not for {', '.join(map(repr, unsupported))}; use "
                "hovi.dynamics.symbolic_dynamics.casadi_functions, or lock these joints."
            )
        self.__setstate__(read_joint_tree(model))

    def __getstate__(self) -> JointTree:
        """Pickled as the joint tree."""
        return self._tree

    def __setstate__(self, tree: JointTree) -> None:
        """Build the kernel again from the joint tree."""
        self._tree = tree
        self._compiled = tree.compiled()
        self._nq = int(self._compiled.nq)
        self._n = int(self._compiled.n)

    @property
    def compiled(self) -> native.InverseDynamicsKernel:
        """The compiled object, for other compiled code."""
        return self._compiled

    @property
    def n(self) -> int:
        """Number of degrees of freedom, nv."""
        return self._n

    def torque(self, q: Array, v: Array, a: Array, threads: int = 1) -> Array:
        """tau(q, v, a) at each point.

        q: shape (P, nq); v, a: shape (P, n), in [rad], [rad/s], [rad/s^2].
        threads: maximum number of threads.

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
        threads: maximum number of threads.

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
        curvature: factor of each torque's second derivative, shape (P, n); None drops the
            sum. With curvature = weight * tau, H is the Hessian of 1/2 tau^T diag(weight) tau.
        threads: maximum number of threads.

        Returns tau (P, n), J (P, n, 3n) and H (P, 3n, 3n), bitwise symmetric, with index
        [k * n + i, l * n + j] for the i-th coordinate of the k-th of (q, v, a). Raises InputError
        on a wrong shape.
        """
        q, v, a = self._points(q, v, a)
        if np.shape(weight) == (self._n,):
            weight = np.full(v.shape, weight)
        weight = _numbers("weight", weight, v.shape)
        if curvature is not None:
            curvature = _numbers("curvature", curvature, v.shape)
        _check_threads(threads)
        tau = np.empty_like(v)
        J = np.empty((*v.shape, 3 * self._n))
        H = np.empty((len(q), 3 * self._n, 3 * self._n))
        self._compiled.expand(q, v, a, weight, curvature, tau, J, H, threads)
        return tau, J, H

    def _points(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        q = _numbers("q", q)
        shape = len(q), self._n
        if q.shape != (len(q), self._nq):
            raise InputError(f"q must have shape {(len(q), self._nq)}, got {q.shape}.")
        return q, _numbers("v", v, shape), _numbers("a", a, shape)


def _numbers(name: str, x: Array, shape: tuple[int, ...] | None = None) -> Array:
    """x as contiguous doubles of a shape; None for any of one dimension or more."""
    x = np.atleast_1d(numbers_of(name, x))
    if shape not in (None, x.shape):
        raise InputError(f"{name} must have shape {shape}, got {x.shape}.")
    return x


def _check_threads(threads: int) -> None:
    if threads < 1:
        raise InputError(f"threads must be at least 1, got {threads}.")
