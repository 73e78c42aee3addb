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
        """c, shape (k,), and its Jacobian with respect to (q, v), shape (k, 2, nv).

        Components of a position are in [m], of a turn or a joint in [rad], of a velocity per [s].
        """

    @abstractmethod
    def curvature(self, q: Array, v: Array, weights: Array) -> Array:
        """sum_i weights_i d2 c_i, shape (2, nv, 2, nv)."""

    def elsewhere(self, q: Array, v: Array) -> bool:
        """Whether c vanishes although what is meant is not met."""
        return False

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
