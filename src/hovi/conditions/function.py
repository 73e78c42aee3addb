"""Functions of a motion at one instant, with exact derivatives in the tangent space."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, without_checks
from hovi.scene.lagrangian import over_time
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Slopes = Mapping[str, Array]
"""See `Function.slopes`."""
Curvature = Mapping[tuple[str, str], Array]
"""See `Function.curvature`."""
ARGUMENTS = "q", "v", "a", "tau", "t"
"""What a function may depend on."""
STEP = 6e-6
"""Step of central differences along v, in [rad] or [m]."""


@check_arguments
@dataclass(frozen=True, eq=False)
class Points:
    """A motion at P instants, of which a Function returns its values.

    q: configurations, shape (P, nq). v: velocities, (P, nv). t: times, (P,), in [s]. a, tau, jerk,
    torque_rate: accelerations, joint torques, and the rates of both, (P, nv); None where no
    function needs them.
    """

    q: Array
    v: Array
    t: Array
    a: Array | None = None
    tau: Array | None = None
    jerk: Array | None = None
    torque_rate: Array | None = None

    def argument(self, name: str) -> Array:
        """One of its fields by its name, shape (P, number of entries)."""
        found = getattr(self, name)
        assert found is not None
        return np.asarray(found.reshape(len(self.q), -1))


_new_points = without_checks(Points)  # called for each state


class Function(ABC):
    """The function y(q, v, a, tau, t) of a Condition, with its derivatives, without CasADi.

    A class of one's own has `needs`, `size`, `values` and `slopes`, and `curvature` where y is not
    linear. Its methods take the motion at P instants, as Points. Derivatives in q are in the
    tangent space, along `Robot.integrate`; those in q, v and a are at fixed tau: hovi adds what
    comes through tau(q, v, a, t).
    """

    @property
    @abstractmethod
    def needs(self) -> frozenset[str]:
        """What y depends on: some of "q", "v", "a", "tau" and "t"."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of entries of y."""

    @abstractmethod
    def values(self, at: Points) -> Array:
        """y, shape (P, size)."""

    @abstractmethod
    def slopes(self, at: Points) -> Slopes:
        """dy / dx by x, for each x in `needs` but t, shape (P, size, nv)."""

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """sum_i w_i d2 y_i / dx dx' by (x, x'), shape (P, nv, nv); zero by default.

        What is left out is zero. Of two different x and x', one order alone: (x', x) is its
        transpose.

        weights: w, shape (P, size).
        """
        return {}

    @property
    def rate(self) -> Function:
        """dy/dt of y(q, t) on a vector space, a function of q, v and t."""
        return Rate(self)

    def from_time(self, time: float) -> Function:
        """The same by a clock that starts at a time, in [s]."""
        return LaterFunction(self, time) if "t" in self.needs else self

    def named(self, entry: int) -> tuple[str, str] | None:
        """What an entry of y is called in sentences, and its unit; None if the condition says."""
        return None

    def is_spurious(self, at: Points) -> bool:
        """Whether y has its value at a root where what is meant does not hold."""
        return False

    def describe(self, at: Points, missed: Array) -> str:
        """By how much y misses its value at one instant, as a clause; missed: shape (size,)."""
        entry = int(np.argmax(np.abs(missed)))
        return f"its entry {entry} misses it by {abs(missed[entry]):.3g}"


class Rate(Function):
    """dy/dt of a function y(q, t) on a vector space, with differences of its curvature."""

    def __init__(self, of: Function) -> None:
        self.of = of

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.of.needs | {"q", "v"}

    @property
    def size(self) -> int:
        """See Function."""
        return self.of.size

    def values(self, at: Points) -> Array:
        """J v, and the partial derivative in time."""
        rate = np.matmul(self._slopes(at), at.v[:, :, None])[:, :, 0]
        if "t" in self.needs:
            rate += over_time(lambda t: self.of.values(replace(at, t=t)), at.t)
        return np.asarray(rate)

    def slopes(self, at: Points) -> Slopes:
        """d(J v), and the partial derivative of J in time."""
        J = self._slopes(at)
        bent = np.zeros_like(J)
        for entry, weights in enumerate(np.eye(self.size)):
            H = self._curvature(at, np.tile(weights, (len(at.q), 1)))
            bent[:, entry] = np.matmul(H, at.v[:, :, None])[:, :, 0]
        if "t" in self.needs:
            bent += over_time(lambda t: self._slopes(replace(at, t=t)), at.t)
        return {"q": bent, "v": J}

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """In (q, q) the rate of the function's curvature, by differences, in (q, v) that itself."""
        size = STEP / np.maximum(np.abs(at.v).max(axis=1, keepdims=True), 1.0)
        before, after = (replace(at, q=at.q + s * at.v, t=at.t + s[:, 0]) for s in (-size, size))
        change = self._curvature(after, weights) - self._curvature(before, weights)
        bent = change / (2 * size[:, :, None])
        return {("q", "q"): bent, ("q", "v"): self._curvature(at, weights)}

    def _slopes(self, at: Points) -> Array:
        return np.asarray(self.of.slopes(at)["q"])

    def _curvature(self, at: Points, weights: Array) -> Array:
        """That in (q, q), (P, nv, nv), zero if the function leaves it out."""
        n = at.v.shape[1]
        return self.of.curvature(at, weights).get(("q", "q"), np.zeros((len(at.q), n, n)))

    def from_time(self, time: float) -> Function:
        """See Function."""
        return Rate(self.of.from_time(time))


class LaterFunction(Function):
    """A function by a clock that starts at a time, in [s]. of: the function."""

    def __init__(self, of: Function, time: float) -> None:
        self.of, self.time = of, time

    def _by_its_clock(self, at: Points) -> Points:
        return replace(at, t=at.t + self.time)

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.of.needs

    @property
    def size(self) -> int:
        """See Function."""
        return self.of.size

    def values(self, at: Points) -> Array:
        """See Function."""
        return self.of.values(self._by_its_clock(at))

    def slopes(self, at: Points) -> Slopes:
        """See Function."""
        return self.of.slopes(self._by_its_clock(at))

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """See Function."""
        return self.of.curvature(self._by_its_clock(at), weights)

    def from_time(self, time: float) -> Function:
        """See Function."""
        return LaterFunction(self.of, self.time + time)

    def named(self, entry: int) -> tuple[str, str] | None:
        """See Function."""
        return self.of.named(entry)

    def is_spurious(self, at: Points) -> bool:
        """See Function."""
        return self.of.is_spurious(self._by_its_clock(at))

    def describe(self, at: Points, missed: Array) -> str:
        """See Function."""
        return self.of.describe(self._by_its_clock(at), missed)


STATE = "q", "v"
"""What a function of a state depends on, in the order of its derivatives."""


def linear(function: Function, q: Array, v: Array, t: float = 0.0) -> tuple[Array, Array]:
    """y at a state, shape (k,), and its Jacobian in (q, v), shape (k, 2, nv).

    q: shape (nq,). v: shape (nv,).
    """
    at, J = at_state(q, v, t), np.zeros((function.size, 2, len(v)))
    for name, slope in function.slopes(at).items():
        J[:, STATE.index(name)] = slope[0]
    return function.values(at)[0], J


def at_state(q: Array, v: Array, t: float = 0.0) -> Points:
    """One instant of a state."""
    return _new_points(np.asarray(q)[None], np.asarray(v)[None], np.array([t]))
