"""Lagrangians on T^(k)Q, evaluated at batches of points with their exact derivatives.

This is the narrow waist: below it are CasADi and Pinocchio, above it NumPy and LAPACK.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.robot.space.configuration_space import ConfigurationSpace

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
