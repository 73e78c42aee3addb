"""Equality constraints c(q, v) = 0 at the nodes of a motion."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


class Condition(ABC):
    """c(q, v) = 0, with its derivatives in the tangent space."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number k of equations."""

    @abstractmethod
    def evaluate(self, q: Array, v: Array) -> tuple[Array, Array]:
        """c, shape (k,), and its Jacobian with respect to (q, v), shape (k, 2, nv).

        Components of a position are in [m], of a rotation or a joint in [rad], of a velocity per
        [s].
        """

    @abstractmethod
    def curvature(self, q: Array, v: Array, weights: Array) -> Array:
        """sum_i weights_i d2 c_i, shape (2, nv, 2, nv): a new array, which may be changed."""

    def is_spurious(self, q: Array, v: Array) -> bool:
        """Whether c = 0 holds at a spurious root, where the goal itself is not met."""
        return False

    @abstractmethod
    def describe(self, q: Array, v: Array) -> str:
        """The error of the condition, as a clause of a sentence."""


@dataclass(frozen=True, eq=False)
class NodeCondition:
    """A condition at a node of a grid.

    node: index of the node. condition: c(q, v) = 0.
    """

    node: int
    condition: Condition


@dataclass(frozen=True, eq=False)
class JointCondition(Condition):
    """q (-) target = 0 and v = velocity, in the prescribed components.

    target: configuration, shape (nq,). velocity: shape (nv,). held: which components of (q, v)
    are prescribed, shape (2, nv).
    """

    coordinates: Coordinates
    target: Array
    velocity: Array
    held: npt.NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of prescribed components."""
        return int(self.held.sum())

    def evaluate(self, q: Array, v: Array) -> tuple[Array, Array]:
        """The prescribed components of (q (-) target, v - velocity), and their Jacobian."""
        n = self.coordinates.nv
        J = np.eye(2 * n).reshape(2, n, 2, n)
        if not self.coordinates.vector_joints:
            J[0, :, 0] = self.coordinates.chart.end_slope(
                self.coordinates.difference(self.target, q)
            )
        return self._error(q, v)[self.held], J[self.held]

    def curvature(self, q: Array, v: Array, weights: Array) -> Array:
        """Zero: c is linear, or its curvature vanishes at its root."""
        n = len(v)
        return np.zeros((2, n, 2, n))

    def describe(self, q: Array, v: Array) -> str:
        """The joint with the largest error."""
        error = np.abs(self._error(q, v)) * self.held
        row, i = np.unravel_index(int(np.argmax(error)), error.shape)
        kind = ("position", "velocity")[row]
        joint = self.coordinates.coordinate_names[i]
        return f"the {kind} of joint {joint!r} misses it by {error[row, i]:.3g}"

    def _error(self, q: Array, v: Array) -> Array:
        return np.stack([self.coordinates.difference(self.target, q), v - self.velocity])
