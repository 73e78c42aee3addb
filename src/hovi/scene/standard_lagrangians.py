"""Ready-made Lagrangians on T^(k)Q, and forces beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.moving_base_torque import inverse_dynamics
from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import times
from hovi.errors import InputError, SceneError
from hovi.robot.space import tangent
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.lagrangian import CasadiLagrangian, Lagrangian
from hovi.scene.scene import Scene, require_known_joints

Array = npt.NDArray[np.float64]
Torque = Callable[[Array], Array]
"""u(t): times (P,) in [s] -> joint efforts (P, nv) in [N m] or [N]."""


def spline(n: int, derivatives: int = 2) -> CasadiLagrangian:
    """L = 1/2 |q^(k)|^2 on R^n: cubic splines for k = 2, quintic ones (least jerk) for k = 3.

    n: dimension, 1 or more. derivatives: k, 1 or more. Raises InputError otherwise.
    [ColomboFerraroMartin2016, examples of sections 3 and 4]
    """
    if n < 1 or derivatives < 1:
        raise InputError(f"a spline needs n >= 1 and k >= 1, got n = {n}, k = {derivatives}.")
    jet = [ca.SX.sym(f"q{j}", n) for j in range(derivatives + 1)]
    return CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2)


def mechanics(scene: Scene) -> CasadiLagrangian:
    """L = 1/2 v^T (M(q) + A(q)) v - V(q) on TQ, in [J]: the robot under its gravity, k = 1.

    A: the inertia of effects whose torque has a part A(q) a. What effects add besides, and what
    the motion of a base brings with it, are not in it: see `scene_force`.
    Raises ModelError for joints of no known kind, SceneError for effects whose torque depends on
    the acceleration in another way.
    """
    require_known_joints(scene.robot)
    functions = casadi_functions(scene.model)
    q, v = ca.SX.sym("q", scene.robot.nq), ca.SX.sym("v", scene.robot.nv)
    L = functions.kinetic_energy(q, v) - functions.potential_energy(q)
    inertia = _added_inertia(scene)
    if inertia is not None:
        A = ca.Function("A", [scene.terms.symbols.q], [inertia])(q)
        L += ca.bilin(A, v, v) / 2
    return CasadiLagrangian([q, v], L, _space(scene))


def riemannian_cubic(scene: Scene) -> CasadiLagrangian:
    """L = 1/2 g(D_t v, D_t v) for the robot's own metric g = M(q), k = 2.

    With D_t v = M^-1 (M a + C(q, v) v), the acceleration that needs no torque taken away.
    Effects count only as far as they change the masses (armature).
    Raises ModelError for joints of no known kind.
    [NoakesHeinzingerPaden1989; ColomboFerraroMartin2016, equation of special Lagrangians]
    """
    model = scene.model.copy()
    model.gravity.linear = np.zeros(3)
    functions = casadi_functions(model)
    require_known_joints(scene.robot)
    q, (v, a) = ca.SX.sym("q", scene.robot.nq), (ca.SX.sym(x, scene.robot.nv) for x in "va")
    force = functions.inverse_dynamics(q, v, a)
    covariant = ca.solve(functions.mass_matrix(q), force)
    return CasadiLagrangian([q, v, a], ca.dot(force, covariant) / 2, _space(scene))


class Drive(Protocol):
    """Joint efforts that depend on the motion: a feedback."""

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u (P, nv) and du/d(q, v), shape (P, nv, 2, nv)."""


@dataclass(frozen=True, eq=False)
class Prescribed:
    """A Drive that does not look at the motion: u(t)."""

    torque: Torque

    def evaluate(self, q: Array, v: Array, t: Array) -> tuple[Array, Array]:
        """u(t), with no slope."""
        u = np.asarray(self.torque(t), dtype=np.float64).reshape(v.shape)
        return u, np.zeros((*v.shape, 2, v.shape[1]))


@dataclass(frozen=True, eq=False)
class Force:
    """A force on TQ x time: f = u(q, v, t) - d(q, v, t).

    n: degrees of freedom. drive: u; none when None.
    resistance: what a scene's effects ask of the joints, d, or None.
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
    """The torques that are put on a scene's joints, less what its effects resist with.

    drive: u(q, v, t); none when not given.
    Raises SceneError for an effect whose torque depends on the acceleration in another way than
    an inertia does.
    """
    resistance = resistance_of(scene)
    if resistance is None:
        return Force(scene.robot.nv, drive)
    q, v, t = scene.terms.symbols.q, scene.terms.symbols.v, scene.terms.symbols.t
    slope = tangent.jacobian(resistance, (q, v, ca.SX(0, 1), t), _space(scene))
    function = ca.Function("resistance", [q, v, t], [resistance, slope])
    return Force(scene.robot.nv, drive, PointFunction(function, scene.compile))


def resistance_of(scene: Scene) -> ca.SX | None:
    """d(q, v, t) of M a + ... + d = u: what is not in the Euler-Lagrange equations of `mechanics`.

    An expression of scene.terms.symbols, shape (nv,); None where there is nothing.
    """
    q, v, a, t = scene.terms.symbols.columns()
    parts = []
    added = scene.terms.torque
    if added is not None:
        inertia = _added_inertia(scene)
        parts.append(added if inertia is None else ca.substitute(added, a, ca.SX.zeros(a.shape)))
        if inertia is not None:
            momentum, energy = inertia @ v, ca.bilin(inertia, v, v) / 2
            parts.append(_slope(scene, energy) - ca.jtimes(momentum, q, _rate(scene)))
            parts.append(_turned_back(scene, momentum))
    if np.any(scene.model.armature):
        parts.append(_turned_back(scene, ca.DM(np.array(scene.model.armature)) * v))
    if scene.terms.symbols.base is not None:
        # masses do not depend on where a base is: without accelerations the difference is exact
        still = ca.SX.zeros(a.shape)
        parts.append(inverse_dynamics(scene.model, scene.terms.symbols.base, q, v, still, t))
        parts.append(-inverse_dynamics(scene.model, None, q, v, still, t))
    total = sum(parts[1:], parts[0]) if parts else None
    return None if total is None or ca.SX(total).is_zero() else total


def _space(scene: Scene) -> ConfigurationSpace | None:
    return None if scene.robot.vector_joints else scene.robot.space


def _slope(scene: Scene, energy: ca.SX) -> ca.SX:
    """d energy / dq in the tangent space, shape (nv,)."""
    nothing, t = ca.SX(0, 1), scene.terms.symbols.t
    symbols = scene.terms.symbols.q, nothing, nothing, t
    return ca.densify(tangent.jacobian(energy, symbols, _space(scene))).T


def _rate(scene: Scene) -> ca.SX:
    """q' of the scene's symbols, shape (nq,)."""
    q, v = scene.terms.symbols.q, scene.terms.symbols.v
    return v if scene.robot.vector_joints else configuration_rate(scene.model, q, v)


def _turned_back(scene: Scene, momentum: ca.SX) -> ca.SX:
    """ad*_v of a momentum in the body's axes, shape (nv,): zero where tangent vectors add.

    The equations of Lagrange on a group are (d/dt - ad*_v) dL/dv - dL/dq = f, but inertia that
    RNEA or an effect states as A a turns no momentum.
    """
    v, turned = scene.terms.symbols.v, ca.SX.zeros(scene.robot.nv)
    for factor in scene.robot.space.curved:
        i, places = factor.v, list(factor.group.places)
        p, twist = ca.SX.zeros(6), ca.SX.zeros(6)
        p[places], twist[places] = momentum[i], v[i]
        moment = ca.cross(p[:3], twist[:3]) + ca.cross(p[3:], twist[3:])
        turned[i] = ca.vertcat(ca.cross(p[:3], twist[3:]), moment)[places]
    return turned


def bracket(space: ConfigurationSpace, x: Array, y: Array) -> Array:
    """[x, y] of tangent vectors in the bodies' axes, (M, nv) each: zero where they add."""
    result = np.zeros_like(x)
    for factor in space.curved:
        i, places = factor.v, list(factor.group.places)
        a, b, c = np.zeros((3, len(x), 6))
        a[:, places], b[:, places] = x[:, i], y[:, i]
        c[:, :3] = np.cross(a[:, 3:], b[:, :3]) + np.cross(a[:, :3], b[:, 3:])
        c[:, 3:] = np.cross(a[:, 3:], b[:, 3:])
        result[:, i] = c[:, places]
    return result


def _added_inertia(scene: Scene) -> ca.SX | None:
    """A(q) of effects whose torque is A(q) a + ..., shape (nv, nv); None without such effects."""
    q, v, a, t = scene.terms.symbols.columns()
    total = None
    for effect in scene.effects:
        term = effect.torque(scene.robot, scene.terms.symbols)
        if term is None or not ca.depends_on(term, a):
            continue
        A = ca.simplify(ca.jacobian(term, a))
        if ca.depends_on(A, ca.vertcat(v, a, t)) or not _symmetric(A, q):
            raise SceneError(
                f"effect {effect.key!r} depends on the acceleration, but not as an inertia does "
                "(a symmetric A(q) times a): it cannot be simulated; leave it out."
            )
        total = A if total is None else total + A
    return total


def _symmetric(A: ca.SX, q: ca.SX) -> bool:
    """Whether A(q) equals its transpose, at three fixed random points."""
    skew = ca.Function("skew", [q], [ca.densify(A - A.T), ca.densify(A)])
    random = np.random.default_rng(0)
    pairs = (skew(random.normal(size=q.shape[0])) for _ in range(3))
    return all(
        np.abs(np.array(odd)).max() <= 1e-12 * max(1.0, np.abs(np.array(full)).max())
        for odd, full in pairs
    )


@dataclass(frozen=True, eq=False)
class ForcedLagrangian(Lagrangian):
    """L on TQ with a force: the Lagrange-d'Alembert principle.

    The virtual work f . delta q joins dL in every variation, so that f is added to dL/dq wherever
    a discrete Lagrangian contracts it: at the quadrature points this is the discrete
    Lagrange-d'Alembert principle with its forces F_d^+ and F_d^-. The "Hessian" is not symmetric
    then. [MarsdenWest2001, section 3.2]

    free: L, of order 1. force: f(q, v, t).
    """

    free: Lagrangian
    force: Force
    order: int = 1

    @property
    def nq(self) -> int:
        """Numbers in a configuration."""
        return self.free.nq

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None where configurations are vectors."""
        return self.free.space

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.free.nv

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L without the work of the force, shape (P,)."""
        return self.free.value(*jet, t=t)

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """L, dL + (f, 0) and the derivatives of that."""
        value, gradient, hessian = self.free.evaluate(*jet, t=t)
        f, df = self.force.evaluate(jet[0], jet[1], times(t, len(value))[:, 0])
        gradient, hessian = gradient.copy(), hessian.copy()
        gradient[:, 0] += f
        hessian[:, 0] += df
        return value, gradient, hessian
