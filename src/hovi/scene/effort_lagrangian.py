"""The effort 1/2 |tau|^2 of a scene as a Lagrangian on T^(2)Q."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.dynamics.torque_model import TorqueModel
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.cost_terms import PotentialTerm, RunningCostTerm
from hovi.scene.lagrangian import Lagrangian, PointExpansion, PointTerms, add_weights
from hovi.scene.squared_effort import expand_squares, predict, weighted_square
from hovi.scene.terms import SceneTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


class EffortScene(Protocol):
    """The scene of an effort Lagrangian, with the robot whose torques it squares."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def terms(self) -> SceneTerms:
        """The contributions of its effects."""

    def from_time(self, time: float) -> Self:
        """The scene by a clock that starts at a time, in [s]."""

    def effort(self, weight: Array) -> EffortLagrangian:
        """Its effort; weight: R."""


@dataclass(frozen=True, eq=False)
class EffortLagrangian(Lagrangian):
    """L~ = 1/2 tau^T diag(R) tau + V + C: the cost of control as a Lagrangian on T^(2)Q.

    [ColomboFerraroMartin2016, section 5]

    torques: tau(q, v, a, t).
    scene: the scene that defines it.
    weight: R, shape (nv,), 0 or more.
    potential: V(q, v, a, t), or None if it is zero.
    running_cost: C(q, v, a, tau, t), or None if it is zero.
    """

    torques: TorqueModel
    scene: EffortScene
    weight: Array
    potential: PotentialTerm | None = None
    running_cost: RunningCostTerm | None = None
    order: int = 2

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.scene.robot.nq

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.scene.robot.nv

    @property
    def space(self) -> ConfigurationSpace | None:
        """The robot's configuration space; None if it is a vector space."""
        return self.scene.robot.curved_space

    @property
    def coordinates(self) -> Robot:
        """Those of the robot's joints."""
        return self.scene.robot

    @property
    def timed(self) -> bool:
        """Whether an effect depends on time."""
        return bool(self.scene.terms.timed)

    def within(self, begin: float, end: float) -> EffortLagrangian:
        """The same of the scene by a clock that starts at `begin`, in [s]."""
        later = self.scene.from_time(begin)
        return self if later is self.scene else later.effort(self.weight)

    @property
    def output_weight(self) -> Array:
        """R: the outputs are the torques."""
        return self.weight

    @property
    def needs_torques(self) -> bool:
        """Whether torques are part of the cost."""
        more = self.running_cost
        return bool(self.weight.any()) or (more is not None and more.names_torques)

    @property
    def output_name(self) -> str:
        """Name of an output in messages."""
        return "torque"

    def output(self, *jet: Array, t: Array | None = None) -> Array:
        """tau at P points, shape (P, nv)."""
        return self.torques.torque(jet[0], jet[1], jet[2], t)

    def torque_slopes(self, *jet: Array, t: Array | None = None) -> Array:
        """d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        return self.torques.linearize(jet[0], jet[1], jet[2], t)[1]

    def predicted_slope(self, outputs: Array, jacobian: Array, change: Array) -> Array:
        """R (tau + J dx), shape (P, nv)."""
        return predict(outputs, self.weight, jacobian, change)

    @check_arguments
    def reweighted(self, weight: Array) -> EffortLagrangian:
        """The same Lagrangian with another R, shape (nv,)."""
        return replace(self, weight=weight)

    def torque(self, q: Array, v: Array, a: Array, t: Array | None = None) -> tuple[Array, Array]:
        """tau (P, nv) and J = d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        return self.torques.linearize(q, v, a, t)

    def hessian(
        self, q: Array, v: Array, a: Array, t: Array | None, R: Array, curvature: Array
    ) -> Array:
        """J^T diag(R) J + sum_i curvature_i d2 tau_i, shape (P, 3 nv, 3 nv)."""
        return self.torques.expand(q, v, a, t, R, curvature)[2]

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """1/2 tau^T diag(R) tau + V + C, shape (P,)."""
        tau = self.output(*jet, t=t)
        value = 0.5 * np.vecdot(tau, self.weight * tau)
        if self.potential is not None:
            value = value + self.potential.value(*jet, t=t)
        if self.running_cost is not None:
            value = value + self.running_cost.value(*jet, tau=tau, t=t)
        return np.asarray(value)

    def integral(
        self, outputs: Array, jet: tuple[Array, ...], t: Array | None, weights: Array
    ) -> float:
        """sum_p w_p L at points with known torques; weights: w, shape (P,)."""
        total = weighted_square(outputs, self.weight, weights)
        if self.potential is not None:
            total += float(weights @ self.potential.value(*jet, t=t))
        if self.running_cost is not None:
            total += float(weights @ self.running_cost.value(*jet, tau=outputs, t=t))
        return total

    def gradient(
        self, *jet: Array, t: Array | None = None, terms: PointTerms | None = None
    ) -> Array:
        """The gradient J^T R tau + dV + dC, shape (P, 3, nv).

        terms: contributions of limits and multipliers.
        """
        q, v, a = jet
        tau, J = self.torques.linearize(q, v, a, t)
        force = None if terms is None else terms.output_gradient
        _, gradient = expand_squares(tau, self.weight, J, force)
        if self.running_cost is not None:
            at = self.running_cost.derivatives(q, v, a, tau=tau, t=t)
            gradient = gradient + self.running_cost.gradient(at, J)
        if terms is not None:
            gradient += terms.jet_gradient
        if self.potential is not None:
            gradient = gradient + self.potential.expand(q, v, a, t=t)[1]
        return np.asarray(gradient.reshape(len(tau), 3, self.nv))

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian: see Lagrangian.evaluate."""
        return self.expand(*jet, t=t).by_derivative(self.nv)

    def expand(
        self,
        *jet: Array,
        t: Array | None = None,
        multiplier: Array | None = None,
        terms: PointTerms | None = None,
    ) -> PointExpansion:
        """As evaluate, with the curvature of tau weighted by `multiplier` instead of R tau.

        multiplier: shape (P, nv). With the torque predicted by the last step, R (tau + J dx), this
            is a lifted Newton step, and the optimiser needs fewer iterations.
        terms: contributions of limits.
        """
        q, v, a = jet
        R = self.weight if terms is None else self.weight + terms.output_weight
        at = None
        if self.running_cost is not None:
            tau = self.torques.torque(q, v, a, t)
            at = self.running_cost.derivatives(q, v, a, tau=tau, t=t)
            multiplier = at.torque + (self.weight * tau if multiplier is None else multiplier)
        tau, J, hessian = self.torques.expand(q, v, a, t, R, multiplier)
        force = None if terms is None else terms.output_gradient
        value, gradient = expand_squares(tau, self.weight, J, force)
        if terms is not None:
            gradient += terms.jet_gradient
            add_weights(hessian, terms)
        if self.potential is not None:
            V, dV, ddV = self.potential.expand(q, v, a, t=t)
            value, gradient, hessian = value + V, gradient + dV, hessian + ddV
        if self.running_cost is not None and at is not None:
            value, gradient = value + at.value, gradient + self.running_cost.gradient(at, J)
            hessian = hessian + self.running_cost.hessian(at, J)
        return PointExpansion(value, gradient, hessian, tau, J)
