"""The effort of a scene plus the weighted square of the jerk: a Lagrangian on T^(3)Q."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.dynamics.torque_rate import TorqueRate
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.effort_lagrangian import EffortLagrangian, EffortScene
from hovi.scene.lagrangian import Lagrangian, PointExpansion, PointTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JerkLagrangian(Lagrangian):
    """L = L~(q, v, a) + 1/2 j^T diag(W) j on T^(3)Q, with L~ the effort of a scene.

    Its accelerations and torques are continuous, and its accelerations at both ends are data.

    effort: L~. jerk_weight: W, shape (nv,), positive.
    torque_rates: whether d tau / dt is among the outputs, after tau, for limits on it.
    Raises InputError for torque rates of torques that depend on time.
    """

    effort: EffortLagrangian
    jerk_weight: Array
    torque_rates: bool = False
    order: int = 3

    def __post_init__(self) -> None:
        if self.torque_rates and self.timed:
            raise InputError(
                "limits on the torque rate need torques that do not depend on time, but an effect "
                "of the scene does; leave the limits or the effect out."
            )

    def with_torque_rates(self) -> JerkLagrangian:
        """The same Lagrangian with d tau / dt among its outputs."""
        return replace(self, torque_rates=True)

    @property
    def scene(self) -> EffortScene:
        """The scene that defines it."""
        return self.effort.scene

    @property
    def weight(self) -> Array:
        """R of the effort, shape (nv,)."""
        return self.effort.weight

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.effort.nq

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.effort.nv

    @property
    def space(self) -> ConfigurationSpace | None:
        """The robot's configuration space; None if it is a vector space."""
        return self.effort.space

    @property
    def coordinates(self) -> Robot:
        """Those of the robot's joints."""
        return self.effort.coordinates

    @property
    def timed(self) -> bool:
        """Whether an effect depends on time."""
        return self.effort.timed

    def within(self, begin: float, end: float) -> JerkLagrangian:
        """The same of the scene by a clock that starts at `begin`, in [s]."""
        effort = self.effort.within(begin, end)
        return self if effort is self.effort else replace(self, effort=effort)

    @property
    def output_weight(self) -> Array:
        """R of the torques, and zero for their rates."""
        R = self.effort.weight
        return np.concatenate([R, np.zeros(self.nv)]) if self.torque_rates else R

    @property
    def needs_torques(self) -> bool:
        """Whether torques are part of the cost."""
        return self.effort.needs_torques

    @property
    def output_name(self) -> str:
        """Name of an output in messages."""
        return self.effort.output_name

    def output(self, *jet: Array, t: Array | None = None) -> Array:
        """tau, or (tau, d tau / dt), at P points, shape (P, nv) or (P, 2 nv)."""
        q, v, a, j = jet
        if not self.torque_rates:
            return self.effort.output(q, v, a, t=t)
        tau, J = self.effort.torque(q, v, a, t)
        rate = TorqueRate(self.effort.torques, q, v, a, j, self.space)
        return np.concatenate([tau, rate.value(J)], axis=1)

    def torque_slopes(self, *jet: Array, t: Array | None = None) -> Array:
        """d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        return self.effort.torque_slopes(*jet[:3], t=t)

    @check_arguments
    def reweighted(self, weight: Array) -> JerkLagrangian:
        """The same Lagrangian with another R; weight: as `output_weight`."""
        return replace(self, effort=self.effort.reweighted(weight[: self.nv]))

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L~ + 1/2 j^T diag(W) j, shape (P,)."""
        return self.effort.value(*jet[:3], t=t) + self._square(jet[3])

    def integral(
        self, outputs: Array, jet: tuple[Array, ...], t: Array | None, weights: Array
    ) -> float:
        """sum_p w_p L at points with known torques; weights: w, shape (P,)."""
        effort = self.effort.integral(outputs[:, : self.nv], jet[:3], t, weights)
        return effort + float(weights @ self._square(jet[3]))

    def gradient(
        self, *jet: Array, t: Array | None = None, terms: PointTerms | None = None
    ) -> Array:
        """The gradient, shape (P, 4, nv). terms: contributions of limits and multipliers."""
        q, v, a, j = jet
        own = None if terms is None else self._without_jerk(terms)
        first = self.effort.gradient(q, v, a, t=t, terms=own)
        gradient = np.concatenate([first, (self.jerk_weight * j)[:, None]], axis=1)
        if terms is not None:
            n = self.nv
            gradient[:, 3] += terms.jet_gradient[:, 3 * n :]
            if self.torque_rates:
                J = self.effort.torque(q, v, a, t)[1]
                Jr = TorqueRate(self.effort.torques, q, v, a, j, self.space).linearize(J)[1]
                gradient += _transposed(Jr, terms.output_gradient[:, n:]).reshape(gradient.shape)
        return gradient

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
        """As evaluate, with the curvature of the outputs weighted by `multiplier`.

        multiplier: shape (P, m) for m outputs; R tau when None. terms: contributions of limits.
        """
        q, v, a, j = jet
        n, k = self.nv, 3 * self.nv
        weights = None if multiplier is None else np.ascontiguousarray(multiplier[:, :n])
        own = None if terms is None else self._without_jerk(terms)
        first = self.effort.expand(q, v, a, t=t, multiplier=weights, terms=own)
        gradient = np.concatenate([first.gradient, self.jerk_weight * j], axis=1)
        hessian, jacobian = np.zeros((len(q), 4 * n, 4 * n)), np.zeros((len(q), n, 4 * n))
        hessian[:, :k, :k], jacobian[:, :, :k] = first.hessian, first.jacobian
        last = np.arange(k, 4 * n)
        hessian[:, last, last] = self.jerk_weight
        if terms is not None:
            gradient[:, k:] += terms.jet_gradient[:, k:]
            hessian[:, last, last] += terms.jet_weight[:, k:]
        value, outputs = first.value + self._square(j), first.outputs
        if self.torque_rates:
            rate = TorqueRate(self.effort.torques, q, v, a, j, self.space)
            rates, Jr = rate.linearize(np.ascontiguousarray(first.jacobian))
            if terms is not None:
                gradient += _transposed(Jr, terms.output_gradient[:, n:])
                weighted = terms.output_weight[:, n:, None] * Jr
                hessian += np.matmul(Jr.transpose(0, 2, 1), weighted)
            if multiplier is not None and multiplier[:, n:].any():
                hessian += rate.curvature(np.ascontiguousarray(multiplier[:, n:]))
            outputs = np.concatenate([outputs, rates], axis=1)
            jacobian = np.concatenate([jacobian, Jr], axis=1)
        return PointExpansion(value, gradient, hessian, outputs, jacobian)

    def _square(self, j: Array) -> Array:
        """1/2 j^T diag(W) j, shape (P,)."""
        return np.asarray(0.5 * np.vecdot(j, self.jerk_weight * j))

    def _without_jerk(self, terms: PointTerms) -> PointTerms:
        """The terms in (q, v, a) and tau."""
        n = self.nv
        return PointTerms(
            terms.jet_gradient[:, : 3 * n],
            terms.jet_weight[:, : 3 * n],
            np.ascontiguousarray(terms.output_gradient[:, :n]),
            np.ascontiguousarray(terms.output_weight[:, :n]),
            terms.leading_weight,
        )


def _transposed(jacobian: Array, force: Array) -> Array:
    """J^T f at every point, shape (P, k); jacobian: (P, n, k), force: (P, n)."""
    return np.asarray(np.matmul(force[:, None], jacobian)[:, 0])
