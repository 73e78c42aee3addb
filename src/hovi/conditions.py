"""Conditions c(q, v) = 0 that a motion has to meet at one of its nodes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Condition(ABC):
    """c(q, v) = 0, with its derivatives in the tangent space."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number k of equations."""

    @abstractmethod
    def evaluate(self, q: Array, v: Array) -> tuple[Array, Array]:
        """c, shape (k,), in [m] or [rad], and its Jacobian with respect to (q, v), (k, 2, nv)."""

    @abstractmethod
    def curvature(self, q: Array, v: Array, weights: Array) -> Array:
        """sum_i weights_i d2 c_i, shape (2, nv, 2, nv)."""

    @abstractmethod
    def describe(self, q: Array, v: Array) -> str:
        """What is missed, and by how much, as the end of a sentence."""


@dataclass(frozen=True, eq=False)
class NodeCondition:
    """A condition at a node of a grid.

    node: its number. condition: c(q, v) = 0.
    """

    node: int
    condition: Condition


@dataclass(frozen=True, eq=False)
class JointCondition(Condition):
    """q (-) target = 0, and v = target's, in the components that are held.

    target: configuration, shape (nq,). velocity: shape (nv,). held: which components of (q, v)
    count, shape (2, nv). difference: q1 (-) q0 of the robot.
    """

    target: Array
    velocity: Array
    held: npt.NDArray[np.bool_]
    names: tuple[str, ...]

    @property
    def size(self) -> int:
        """Number of held components."""
        return int(self.held.sum())

    def evaluate(self, q: Array, v: Array) -> tuple[Array, Array]:
        """The held components of (q - target, v - velocity), and rows of the identity."""
        c = np.stack([q - self.target, v - self.velocity])
        J = np.eye(c.size).reshape(c.size, *c.shape)
        return c[self.held], J[self.held.ravel()]

    def curvature(self, q: Array, v: Array, weights: Array) -> Array:
        """Zero: the condition is linear."""
        n = len(v)
        return np.zeros((2, n, 2, n))

    def describe(self, q: Array, v: Array) -> str:
        """The joint that misses most."""
        missed = np.abs(np.stack([q - self.target, v - self.velocity])) * self.held
        row, i = np.unravel_index(int(np.argmax(missed)), missed.shape)
        kind = ("position", "velocity")[row]
        return f"the {kind} of joint {self.names[i]!r} misses it by {missed[row, i]:.3g}"
