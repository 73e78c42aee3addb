"""Forces that are not part of a Lagrangian: drive torques and resistance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.shapes import numbers_of
from hovi.dynamics.moving_base_torque import inverse_dynamics
from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.torque_model import times
from hovi.errors import InputError
from hovi.robot.space import tangent
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.added_inertia import added_inertia
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

Torque = Callable[[Array], Array]
"""u(t): times (P,) in [s] -> joint efforts (P, nv) in [N m] or [N]."""


class Drive(Protocol):
    """Joint efforts that depend on the motion: a feedback."""

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u (P, nv) and du/d(q, v), shape (P, nv, 2, nv)."""


@dataclass(frozen=True, eq=False)
class Prescribed:
    """A Drive that is a function of time alone: u(t)."""

    torque: Torque

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u(t), with zero derivatives. Raises InputError for a result of another shape."""
        u = numbers_of("torque(t)", self.torque(t))
        if u.size != v.size:
            raise InputError(f"torque(t) must have shape {v.shape} for these times, got {u.shape}.")
        return u.reshape(v.shape), np.zeros((*v.shape, 2, v.shape[1]))


@dataclass(frozen=True, eq=False)
class Force:
    """A force on TQ x time: f = u(q, v, t) - d(q, v, t).

    n: degrees of freedom. drive: u; none when None.
    resistance: d, the torques that the effects of a scene require; none when None.
    """

    n: int
    drive: Drive | None = None
    resistance: PointFunction | None = None

    def driven(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u (P, n) and its derivatives with respect to (q, v), shape (P, n, 2, n)."""
        if self.drive is None:
            return np.zeros((len(q), self.n)), np.zeros((len(q), self.n, 2, self.n))
        return self.drive.evaluate(q, v, t)

    def resisted(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """d (P, n) and its derivatives with respect to (q, v), shape (P, n, 2, n)."""
        if self.resistance is None:
            return np.zeros((len(q), self.n)), np.zeros((len(q), self.n, 2, self.n))
        d, slope = self.resistance(q, v, times(t, len(q)))
        shape = (len(q), self.n)
        return d.reshape(shape), slope.reshape(*shape, 2, self.n)

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """f (P, n) and its derivatives with respect to (q, v), shape (P, n, 2, n)."""
        (u, du), (d, dd) = self.driven(q, v, t), self.resisted(q, v, t)
        return u - d, du - dd


def scene_force(scene: Scene, drive: Drive | None = None) -> Force:
    """The drive torques of a scene minus the resistance of its effects.

    drive: u(q, v, t); none when None.
    Raises SceneError for an effect whose torque depends on the acceleration other than as an
    inertia.
    """
    resistance = resistance_of(scene)
    if resistance is None:
        return Force(scene.robot.nv, drive)
    q, v, t = scene.terms.symbols.q, scene.terms.symbols.v, scene.terms.symbols.t
    slope = tangent.jacobian(resistance, (q, v, ca.SX(0, 1), t), scene.robot.curved_space)
    function = ca.Function("resistance", [q, v, t], [resistance, slope])
    return Force(scene.robot.nv, drive, PointFunction(function))


def resistance_of(scene: Scene) -> ca.SX | None:
    """d(q, v, t) of M a + ... + d = u: terms not in the Euler-Lagrange equations of `mechanics`.

    An expression in scene.terms.symbols, shape (nv,); None if it is zero.
    """
    q, v, a, t = scene.terms.symbols.columns()
    parts = []
    added = scene.terms.torque
    if added is not None:
        inertia = added_inertia(scene)
        parts.append(added if inertia is None else ca.substitute(added, a, ca.SX.zeros(a.shape)))
        if inertia is not None:
            momentum, energy = inertia @ v, ca.bilin(inertia, v, v) / 2
            parts.append(_slope(scene, energy) - ca.jtimes(momentum, q, _rate(scene)))
            parts.append(_coadjoint(scene, momentum))
    if np.any(scene.model.armature):
        parts.append(_coadjoint(scene, ca.DM(np.array(scene.model.armature)) * v))
    if scene.terms.base is not None:
        # M(q) does not depend on the base: the difference at zero acceleration is exact
        still = ca.SX.zeros(a.shape)
        parts.append(inverse_dynamics(scene.model, scene.terms.base, q, v, still, t))
        parts.append(-inverse_dynamics(scene.model, None, q, v, still, t))
    total = sum(parts[1:], parts[0]) if parts else None
    return None if total is None or ca.SX(total).is_zero() else total


@dataclass(frozen=True, eq=False)
class ForcedLagrangian(Lagrangian):
    """L on TQ with a force: the Lagrange-d'Alembert principle.

    The virtual work f . delta q is added to dL in every variation, that is f to dL/dq at the
    quadrature points: this is the discrete Lagrange-d'Alembert principle with its forces F_d^+ and
    F_d^-. The "Hessian" is not symmetric. [MarsdenWest2001, section 3.2]

    free: L, of order 1. force: f(q, v, t).
    """

    free: Lagrangian
    force: Force
    order: int = 1

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.free.nq

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""
        return self.free.space

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.free.nv

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L without the work of the force, shape (P,)."""
        return self.free.value(*jet, t=t)

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """L, dL + (f, 0), and the derivatives of the latter."""
        value, gradient, hessian = self.free.evaluate(*jet, t=t)
        f, df = self.force.evaluate(jet[0], jet[1], times(t, len(value))[:, 0])
        gradient, hessian = gradient.copy(), hessian.copy()
        gradient[:, 0] += f
        hessian[:, 0] += df
        return value, gradient, hessian


def _slope(scene: Scene, energy: ca.SX) -> ca.SX:
    """d energy / dq in the tangent space, shape (nv,)."""
    nothing, t = ca.SX(0, 1), scene.terms.symbols.t
    symbols = scene.terms.symbols.q, nothing, nothing, t
    return ca.densify(tangent.jacobian(energy, symbols, scene.robot.curved_space)).T


def _rate(scene: Scene) -> ca.SX:
    """q' of the scene's symbols, shape (nq,)."""
    q, v = scene.terms.symbols.q, scene.terms.symbols.v
    return v if scene.robot.vector_joints else configuration_rate(scene.model, q, v)


def _coadjoint(scene: Scene, momentum: ca.SX) -> ca.SX:
    """ad*_v of a momentum in the body frame, shape (nv,): zero on commutative groups.

    The Euler-Poincare equations are (d/dt - ad*_v) dL/dv - dL/dq = f, but armature and effects with
    a torque A a have no coadjoint term.
    """
    v, result = scene.terms.symbols.v, ca.SX.zeros(scene.robot.nv)
    for factor in scene.robot.space.curved:
        i, indices = factor.v, list(factor.group.se3_indices)
        p, twist = ca.SX.zeros(6), ca.SX.zeros(6)
        p[indices], twist[indices] = momentum[i], v[i]
        moment = ca.cross(p[:3], twist[:3]) + ca.cross(p[3:], twist[3:])
        result[i] = ca.vertcat(ca.cross(p[:3], twist[3:]), moment)[indices]
    return result
