"""Lagrangians on T^(k)Q, evaluated at batches of points with their exact derivatives.

This is the narrow waist: below it are CasADi and Pinocchio, above it NumPy and LAPACK.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.torque_model import TorqueModel, times
from hovi.robot.robot import Robot
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.tangent import Symbols
from hovi.scene.cost_terms import EffortTerm
from hovi.scene.squared_effort import expand_squares, weighted_square

Array = npt.NDArray[np.float64]


class Lagrangian(ABC):
    """L on T^(k)Q: what a discrete Lagrangian needs to know of it.

    Derivatives live in the tangent space: with respect to q they are taken along `integrate`.
    """

    order: int
    """k, the highest derivative that L depends on."""

    @property
    @abstractmethod
    def nq(self) -> int:
        """Numbers in a configuration."""

    @property
    @abstractmethod
    def nv(self) -> int:
        """Degrees of freedom."""

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None where configurations are vectors."""
        return None

    @abstractmethod
    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L at P points of the jet (q, v, a, ...), shape (P,).

        jet: q of shape (P, nq) and k arrays of shape (P, nv). t: times, shape (P,), in [s].
        """

    @abstractmethod
    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """L, its gradient and its Hessian at P points.

        Returns value (P,), gradient (P, k+1, nv), hessian (P, k+1, nv, k+1, nv).
        """

    def gradient(self, *jet: Array, t: Array | None = None) -> Array:
        """The gradient alone, shape (P, k+1, nv)."""
        return self.evaluate(*jet, t=t)[1]


class EffortScene(Protocol):
    """Where an effort Lagrangian comes from: the robot whose torques it squares."""

    @property
    def robot(self) -> Robot:
        """The robot."""


@dataclass(frozen=True, eq=False)
class PointTerms:
    """What limits add to an effort Lagrangian's derivatives at P points.

    With x = (q, v, a), gradient: jet_gradient + J^T effort_gradient; Hessian: diag(jet_weight) +
    J^T diag(effort_weight) J, and configuration_weight in its block of q.

    jet_gradient, jet_weight: shape (P, 3 nv). effort_gradient, effort_weight: shape (P, nv).
    configuration_weight: shape (P, nv, nv); nothing when None.
    """

    jet_gradient: Array
    jet_weight: Array
    effort_gradient: Array
    effort_weight: Array
    configuration_weight: Array | None = None

    @classmethod
    def of_effort(cls, gradient: Array) -> PointTerms:
        """A force on the torques alone, shape (P, nv)."""
        jet = np.zeros((len(gradient), 3 * gradient.shape[1]))
        return cls(jet, jet, gradient, np.zeros_like(gradient))


@dataclass(frozen=True, eq=False)
class EffortLagrangian(Lagrangian):
    """L~ = 1/2 tau^T diag(R) tau + V + phi(tau, v): the cost of control as a Lagrangian on T^(2)Q.

    [ColomboFerraroMartin2016, section 5]

    torques: tau(q, v, a, t).
    scene: the scene that it belongs to.
    potential: (q, v, a, t) -> V, gradient (3 nv), Hessian (3 nv, 3 nv), or None where V = 0.
    weight: R, shape (nv,).
    effort_term: phi, or None where it is zero.
    """

    torques: TorqueModel
    scene: EffortScene
    weight: Array
    potential: PotentialTerm | None = None
    effort_term: EffortTerm | None = None
    order: int = 2

    @property
    def nq(self) -> int:
        """Numbers in a configuration."""
        return self.scene.robot.nq

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.scene.robot.nv

    @property
    def space(self) -> ConfigurationSpace | None:
        """The robot's configuration space; None where configurations are vectors."""
        robot = self.scene.robot
        return None if robot.vector_joints else robot.space

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> tuple[Array, Array]:
        """tau (P, nv) and J = d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        return self.torques.linearize(q, v, a, t)

    def hessian(
        self, q: Array, v: Array, a: Array, t: Array | None, R: Array, curvature: Array
    ) -> Array:
        """J^T diag(R) J + sum_i curvature_i d2 tau_i, shape (P, 3 nv, 3 nv)."""
        return self.torques.expand(q, v, a, t, R, curvature)[2]

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """1/2 tau^T diag(R) tau + V + phi, shape (P,)."""
        tau = self.torques.torque(jet[0], jet[1], jet[2], t)
        value = 0.5 * np.vecdot(tau, self.weight * tau)
        if self.potential is not None:
            value = value + self.potential.value(*jet, t=t)
        if self.effort_term is not None:
            value = value + self.effort_term.value(tau, jet[1])
        return np.asarray(value)

    def integral(
        self, tau: Array, jet: tuple[Array, ...], t: Array | None, weights: Array
    ) -> float:
        """sum_p w_p L at points where the torque is known; weights: w, shape (P,)."""
        total = weighted_square(tau, self.weight, weights)
        if self.potential is not None:
            total += float(weights @ self.potential.value(*jet, t=t))
        if self.effort_term is not None:
            total += float(weights @ self.effort_term.value(tau, jet[1]))
        return total

    def gradient(
        self, *jet: Array, t: Array | None = None, terms: PointTerms | None = None
    ) -> Array:
        """The gradient J^T R tau + dV + dphi, shape (P, 3, nv).

        terms: what limits and multipliers add.
        """
        q, v, a = jet
        tau, J = self.torques.linearize(q, v, a, t)
        force = None if terms is None else terms.effort_gradient
        _, gradient = expand_squares(tau, self.weight, J, force)
        if self.effort_term is not None:
            gradient = gradient + self.effort_term.expand(tau, v, J)[1]
        if terms is not None:
            gradient += terms.jet_gradient
        if self.potential is not None:
            gradient = gradient + self.potential.expand(q, v, a, t=t)[1]
        return np.asarray(gradient.reshape(len(tau), 3, self.nv))

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian: see Lagrangian.evaluate."""
        value, gradient, hessian, _, _ = self.expand(*jet, t=t)
        points, n = len(value), self.nv
        return value, gradient.reshape(points, 3, n), hessian.reshape(points, 3, n, 3, n)

    def expand(
        self,
        *jet: Array,
        t: Array | None = None,
        multiplier: Array | None = None,
        terms: PointTerms | None = None,
    ) -> tuple[Array, Array, Array, Array, Array]:
        """As evaluate, with the curvature of tau weighted by `multiplier` instead of R tau.

        multiplier: shape (P, nv). Weighted with the torque that the last step predicted
            (R (tau + J dx), a lifted Newton step) an optimiser needs fewer steps.
        terms: what limits add.
        Returns value (P,), gradient (P, 3 nv), hessian (P, 3 nv, 3 nv), tau, J.
        """
        q, v, a = jet
        R = self.weight if terms is None else self.weight + terms.effort_weight
        if self.effort_term is not None:
            tau = self.torques.torque(q, v, a, t)
            given = self.weight * tau if multiplier is None else multiplier
            multiplier = given + self.effort_term.slope(tau, v)
        tau, J, hessian = self.torques.expand(q, v, a, t, R, multiplier)
        force = None if terms is None else terms.effort_gradient
        value, gradient = expand_squares(tau, self.weight, J, force)
        if terms is not None:
            gradient += terms.jet_gradient
            diagonal = np.arange(hessian.shape[1])
            hessian[:, diagonal, diagonal] += terms.jet_weight
            if terms.configuration_weight is not None:
                hessian[:, : self.nv, : self.nv] += terms.configuration_weight
        if self.potential is not None:
            V, dV, ddV = self.potential.expand(q, v, a, t=t)
            value, gradient, hessian = value + V, gradient + dV, hessian + ddV
        if self.effort_term is not None:
            phi, dphi, ddphi = self.effort_term.expand(tau, v, J)
            value, gradient, hessian = value + phi, gradient + dphi, hessian + ddphi
        return value, gradient, hessian, tau, J


class PotentialTerm:
    """A term V(q, v, a, t) of the cost from a CasADi expression.

    compile: whether its functions become machine code: see PointFunction.
    space: the configuration space; None where configurations are vectors.
    """

    def __init__(
        self,
        symbols: Symbols,
        expression: ca.SX,
        compile: bool = False,
        space: ConfigurationSpace | None = None,
    ) -> None:
        q, v, a, t = symbols
        hessian, gradient = tangent.hessian(expression, symbols, space)
        expand = ca.Function("V_expand", [q, v, a, t], [expression, gradient, hessian])
        self._value = PointFunction(ca.Function("V", [q, v, a, t], [expression]), compile)
        self._expand = PointFunction(expand, compile)

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """V at P points, shape (P,)."""
        return self._value(*jet, times(t, len(jet[0])))[0]

    def expand(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """V (P,), its gradient (P, 3 nv) and its Hessian (P, 3 nv, 3 nv)."""
        value, gradient, hessian = self._expand(*jet, times(t, len(jet[0])))
        return value, gradient, hessian


class CasadiLagrangian(Lagrangian):
    """A Lagrangian of any order k from a CasADi expression.

    jet: symbols (q, v, a, ...), k + 1 columns of n each; q one of nq where there is a space.
    expression: L as a function of them. [ColomboFerraroMartin2016, section 2]
    space: the configuration space; None where configurations are vectors.
    """

    def __init__(
        self, jet: list[ca.SX], expression: ca.SX, space: ConfigurationSpace | None = None
    ) -> None:
        self.order = len(jet) - 1
        self.jet = list(jet)
        self.expression = expression
        self._space = space
        nothing = ca.SX(0, 1)
        symbols = jet[0], ca.vertcat(*jet[1:]), nothing, nothing
        hessian, gradient = tangent.hessian(expression, symbols, space)
        self._value = PointFunction(ca.Function("L", jet, [expression]))
        self._expand = PointFunction(ca.Function("L_expand", jet, [expression, gradient, hessian]))

    @property
    def nq(self) -> int:
        """Numbers in a configuration."""
        return int(self.jet[0].shape[0])

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return int(self.jet[1].shape[0])

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None where configurations are vectors."""
        return self._space

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L at P points, shape (P,)."""
        return self._value(*jet)[0]

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian: see Lagrangian.evaluate."""
        value, gradient, hessian = self._expand(*jet)
        shape = (len(value), self.order + 1, self.nv)
        return value, gradient.reshape(shape), hessian.reshape(*shape, *shape[1:])
