"""Distances of pairs of shapes: to obstacles, and between links."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.conditions.function import Function, Points, Slopes
from hovi.planning.clearance.distances import Distances
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairDistances(Function):
    """The distance of every pair, in [m]; negative where they overlap."""

    distances: Distances

    @property
    def needs(self) -> frozenset[str]:
        """Configurations, and times where obstacles move."""
        return frozenset({"q", "t"})

    @property
    def size(self) -> int:
        """Number of pairs."""
        return len(self.distances.pairs)

    def values(self, at: Points) -> Array:
        """Distances, shape (P, size)."""
        return self.distances.values(self.distances.at(at.q, at.t))

    def slopes(self, at: Points) -> Slopes:
        """As the two nearest points move with their shapes."""
        return {"q": self.distances.expansion(self.distances.at(at.q, at.t), None)[1]}
