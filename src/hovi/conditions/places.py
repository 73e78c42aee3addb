"""Where along a motion a condition holds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.checks.shapes import numbers_of
from hovi.conditions.function import Points
from hovi.discrete.grid import DiscretePath
from hovi.errors import InputError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class AtNode:
    """At one node of a grid, where a condition is a function of q, v and further rates.

    node: its index. time: in [s]. given: whether what is asked is no unknown there, as at ends.
    """

    node: int
    time: float
    given: bool = False

    def state(self, x: DiscretePath) -> tuple[Array, Array]:
        """q (nq,) and v (nv,) of a path there."""
        return x.q[self.node], x.v[self.node]

    def points(self, x: DiscretePath) -> Points:
        """The motion there."""
        q, v = self.state(x)
        more = dict(zip(("a", "jerk"), x.rates[self.node, 1:, None], strict=False))
        return Points(q[None], v[None], np.array([self.time]), **more)


@dataclass(frozen=True, eq=False)
class AtTimes:
    """At given times, which become nodes of every grid.

    times: one or more, positive, in [s].
    Raises InputError for anything else.
    """

    times: npt.ArrayLike

    def __post_init__(self) -> None:
        times = np.atleast_1d(numbers_of("the times of an AtTimes", self.times))
        if times.ndim > 1 or times.size == 0 or not (np.isfinite(times) & (times > 0)).all():
            raise InputError(f"an AtTimes needs positive times in [s], got {self.times!r}.")
        object.__setattr__(self, "times", np.unique(times))


@dataclass(frozen=True)
class AtPoints:
    """At all times: bounds at the quadrature points, tightened where they do not hold between."""


@dataclass(frozen=True)
class ControlPoints:
    """At all times: bounds of what is linear in the unknowns, by control points of the motion."""


@dataclass(frozen=True)
class Exchange:
    """At all times: bounds at instants that are added where the motion exceeds them."""


@dataclass(frozen=True)
class Along:
    """At all times: equations, of which a grid imposes as many as a curve has unknowns for them.

    For functions of level l, that of the highest derivative of q in them, and motions of order k:
    k - l at every node, the value and its first derivatives in time, and r + l moments of every
    interval with r inner modes. Between the nodes they are missed by O(h^(r + 4 - l)).

    level: l, from 0 to 2.
    """

    level: int


Where = AtNode | AtTimes | AtPoints | ControlPoints | Exchange | Along
