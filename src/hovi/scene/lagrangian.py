"""Lagrangians on T^(k)Q, evaluated at batches of points with their exact derivatives.

This is the only interface between CasADi and Pinocchio below it and NumPy and LAPACK above it.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates, NamedCoordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

DIFFERENCE = 6e-6
"""Step of central differences in time, relative to the time, or in [s] where that is more."""


@dataclass(frozen=True, eq=False)
class PointTerms:
    """Contributions of limits and multipliers to a Lagrangian's derivatives at P points.

    With the jet x = (q, v, a, ...) and the outputs y(x) of the Lagrangian, gradient:
    jet_gradient + J^T output_gradient; Hessian: diag(jet_weight) + J^T diag(output_weight) J, and
    leading_weight in the block of the first m entries of the jet, such as q.

    jet_gradient, jet_weight: shape (P, (k+1) nv). output_gradient, output_weight: shape (P, m).
    leading_weight: shape (P, m, m); none when None.
    time_gradient: of what depends on time itself, at a fixed jet and fixed outputs, shape (P,);
        none when None.
    """

    jet_gradient: Array
    jet_weight: Array
    output_gradient: Array
    output_weight: Array
    leading_weight: Array | None = None
    time_gradient: Array | None = None

    def plus(self, gradient: Array, curvature: Array) -> PointTerms:
        """These plus a gradient (P, (k+1) nv) and a Hessian (P, (k+1) nv, (k+1) nv) in the jet."""
        if self.leading_weight is not None:
            curvature = curvature.copy()
            m = self.leading_weight.shape[1]
            curvature[:, :m, :m] += self.leading_weight
        jet_gradient = self.jet_gradient + gradient
        return dataclasses.replace(self, jet_gradient=jet_gradient, leading_weight=curvature)

    @classmethod
    def on_outputs(cls, gradient: Array, jet_size: int) -> PointTerms:
        """A gradient in the outputs alone, shape (P, m); jet_size: (k+1) nv."""
        jet = np.zeros((len(gradient), jet_size))
        return cls(jet, jet, gradient, np.zeros_like(gradient))


class PointExpansion(NamedTuple):
    """A Lagrangian at P points to second order, and its outputs to first order.

    value: shape (P,). gradient: shape (P, (k+1) nv). hessian: shape (P, (k+1) nv, (k+1) nv).
    outputs: y, shape (P, m). jacobian: J = dy/dx, shape (P, m, (k+1) nv).
    """

    value: Array
    gradient: Array
    hessian: Array
    outputs: Array
    jacobian: Array

    def by_derivative(self, nv: int) -> tuple[Array, Array, Array]:
        """Value (P,), gradient (P, k+1, nv) and Hessian (P, k+1, nv, k+1, nv)."""
        points, size = self.gradient.shape
        shape = points, size // nv, nv
        return self.value, self.gradient.reshape(shape), self.hessian.reshape(*shape, *shape[1:])


class Lagrangian(ABC):
    """L on T^(k)Q with its derivatives.

    Derivatives with respect to q are in the tangent space: they are taken along `integrate`.

    A Lagrangian may have the form L = 1/2 y^T diag(R) y + rest with m outputs y of its jet, such as
    joint torques. Outputs can have bounds and multipliers, and a lifted Newton step weights their
    curvature with the prediction of the last step. By default there are no outputs.
    """

    order: int
    """k, the highest derivative that L depends on."""

    @property
    @abstractmethod
    def nq(self) -> int:
        """Length of a configuration."""

    @property
    @abstractmethod
    def nv(self) -> int:
        """Degrees of freedom."""

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""
        return None

    @property
    def coordinates(self) -> Coordinates:
        """The space and names of the coordinates: q[0], q[1], ... if they are nobody's joints."""
        names = tuple(f"q[{i}]" for i in range(self.nv))
        return NamedCoordinates(names, self.space or ConfigurationSpace((self.nv,)))

    @property
    def timed(self) -> bool:
        """Whether L depends on time."""
        return False

    def within(self, begin: float, end: float) -> Lagrangian:
        """L of the part of a motion from one time to another, by a clock that starts there, in [s].

        Raises InputError where it depends on time and its class does not say how.
        """
        if self.timed:
            raise InputError(
                f"a {type(self).__name__} depends on time and says of no part of a motion what it "
                "is there: give its class a method `within(begin, end)`."
            )
        return self

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

    @property
    def output_weight(self) -> Array:
        """R, shape (m,); m = 0 without outputs."""
        return np.zeros(0)

    @property
    def needs_torques(self) -> bool:
        """Whether it is one of a robot's torques or energies, for which every joint has inertia."""
        return True

    @property
    def output_name(self) -> str:
        """Name of an output in messages."""
        return "output"

    def output(self, *jet: Array, t: Array | None = None) -> Array:
        """y at P points, shape (P, m)."""
        return np.zeros((len(jet[0]), 0))

    def torque_slopes(self, *jet: Array, t: Array | None = None) -> Array:
        """d tau / d(q, v, a) of the outputs that are torques, shape (P, nv, 3 nv)."""
        raise NotImplementedError

    def output_slope(self, outputs: Array) -> Array:
        """R y, shape (P, m)."""
        return self.output_weight * outputs

    def predicted_slope(self, outputs: Array, jacobian: Array, change: Array) -> Array:
        """R (y + J dx) after a change dx of the jet, shape (P, m)."""
        return self.output_slope(outputs + np.matmul(jacobian, change[:, :, None])[:, :, 0])

    def reweighted(self, weight: Array) -> Lagrangian:
        """The same Lagrangian with another R, shape (m,)."""
        raise NotImplementedError

    def integral(
        self, outputs: Array, jet: tuple[Array, ...], t: Array | None, weights: Array
    ) -> float:
        """sum_p w_p L at points with known outputs; weights: w, shape (P,)."""
        return float(weights @ self.value(*jet, t=t))

    def gradient(
        self, *jet: Array, t: Array | None = None, terms: PointTerms | None = None
    ) -> Array:
        """The gradient, shape (P, k+1, nv). terms: contributions of limits and multipliers."""
        gradient = self.evaluate(*jet, t=t)[1]
        return gradient if terms is None else gradient + terms.jet_gradient.reshape(gradient.shape)

    def expand(
        self,
        *jet: Array,
        t: Array | None = None,
        multiplier: Array | None = None,
        terms: PointTerms | None = None,
    ) -> PointExpansion:
        """As evaluate, with outputs and the contributions of limits and multipliers.

        multiplier: weights of the curvature of the outputs instead of R y, shape (P, m).
        """
        value, gradient, hessian = self.evaluate(*jet, t=t)
        size = (self.order + 1) * self.nv
        gradient, hessian = gradient.reshape(-1, size), hessian.reshape(-1, size, size)
        if terms is not None:
            gradient, hessian = gradient + terms.jet_gradient, hessian.copy()
            add_weights(hessian, terms)
        outputs = self.output(*jet, t=t)
        return PointExpansion(value, gradient, hessian, outputs, np.zeros((len(value), 0, size)))


class NoCost(Lagrangian):
    """L = 0 without outputs, on the space of another Lagrangian.

    of: the other one.
    """

    def __init__(self, of: Lagrangian) -> None:
        self.of = of
        self.order = of.order

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return self.of.nq

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return self.of.nv

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space of the other one."""
        return self.of.space

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """Zeros, shape (P,)."""
        return np.zeros(len(jet[0]))

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Zeros: see Lagrangian.evaluate."""
        P, rows, n = len(jet[0]), self.order + 1, self.nv
        return np.zeros(P), np.zeros((P, rows, n)), np.zeros((P, rows, n, rows, n))


def over_time(function: Callable[[Array], Array], t: Array) -> Array:
    """d function(t) / dt, by central differences. t: shape (P,), in [s]."""
    d = DIFFERENCE * max(1.0, float(np.abs(t).max(initial=0.0)))
    return np.asarray((function(t + d) - function(t - d)) / (2 * d))


def time_slope(L: Lagrangian, jet: tuple[Array, ...], t: Array, terms: PointTerms | None) -> Array:
    """dL/dt at a fixed jet, shape (P,). terms: contributions of limits and multipliers."""
    slope = over_time(lambda t: L.value(*jet, t=t), t)
    if terms is None:
        return slope
    if terms.output_gradient.any():
        slope += np.vecdot(terms.output_gradient, over_time(lambda t: L.output(*jet, t=t), t))
    return slope if terms.time_gradient is None else slope + terms.time_gradient


def add_weights(hessian: Array, terms: PointTerms) -> None:
    """Add the contributions of limits on the jet to its Hessian, in place."""
    if terms.jet_weight.any():
        diagonal = np.arange(hessian.shape[1])
        hessian[:, diagonal, diagonal] += terms.jet_weight
    if terms.leading_weight is not None:
        m = terms.leading_weight.shape[1]
        hessian[:, :m, :m] += terms.leading_weight
