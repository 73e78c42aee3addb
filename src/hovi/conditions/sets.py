"""Sets in which the values of a function lie: one value, or what is between two bounds."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, reason
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Bound = npt.ArrayLike | Callable[[float], npt.ArrayLike]
"""A number, one for each entry of y, or a function of the time in [s] that returns either."""


@check_arguments
@dataclass(frozen=True, eq=False)
class Equal:
    """y = value.

    value: a number, or one for each entry of y.
    Raises InputError for anything that is not finite numbers.
    """

    value: npt.ArrayLike = 0.0

    def __post_init__(self) -> None:
        value = numbers_of("the value of an Equal", self.value)
        if value.ndim > 1 or not np.isfinite(value).all():
            raise InputError(f"an Equal needs finite numbers, got {self.value!r}.")
        object.__setattr__(self, "value", value)

    def from_time(self, time: float) -> Self:
        """See TwoSided: itself."""
        return self

    def missed(self, y: Array) -> Array:
        """y - value, shape of y."""
        return np.asarray(y - np.asarray(self.value))


class TwoSided(ABC):
    """What is between two bounds, which may change with time."""

    @property
    def varies(self) -> bool:
        """Whether a bound is a function of time."""
        return False

    def from_time(self, time: float) -> Self:
        """The same by a clock that starts at a time, in [s]."""
        return self

    @abstractmethod
    def at(self, t: Array, size: int | None, within: Array | None = None) -> tuple[Array, Array]:
        """Lower and upper bounds at times, (P, size) each; one column, or as given, for size None.

        within: a time inside the interval of each, by which seams are in one of two segments.
        """


@check_arguments
@dataclass(frozen=True, eq=False)
class Between(TwoSided):
    """lower <= y <= upper.

    lower, upper: a number, one for each entry of y, or a function of the time that returns either;
    infinite where there is no bound.
    Raises InputError for NaN and for a range that is empty.
    """

    lower: Bound = -np.inf
    upper: Bound = np.inf

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            bound = getattr(self, name)
            if not callable(bound):
                object.__setattr__(self, name, _numbers(name, bound))
        if not self.varies:
            low, high = self.at(np.zeros(1), None)
            if 1 not in (low.size, high.size) and low.size != high.size:
                raise InputError(
                    f"a Between has {low.size} lower and {high.size} upper bounds: give one, or "
                    "one for each entry of y."
                )
            if (low >= high).any():
                raise InputError(
                    f"the range of a Between is empty: [{self.lower}, {self.upper}]; lower must be "
                    "less than upper."
                )

    @property
    def varies(self) -> bool:
        """Whether a bound is a function of time."""
        return callable(self.lower) or callable(self.upper)

    def from_time(self, time: float) -> Self:
        """See TwoSided."""
        lower, upper = (_from_time(each, time) for each in (self.lower, self.upper))
        return dataclasses.replace(self, lower=lower, upper=upper)

    def at(self, t: Array, size: int | None, within: Array | None = None) -> tuple[Array, Array]:
        """See TwoSided.

        Raises InputError for another number of bounds than size, and for bounds that are NaN.
        """
        sides = [self._side(name, t) for name in ("lower", "upper")]
        if size is None:
            return sides[0], sides[1]
        for name, side in zip(("lower", "upper"), sides, strict=True):
            if side.shape[1] not in (1, size):
                raise InputError(
                    f"the {name} bound of a Between must be one number or {size}, one for each "
                    f"value of the function, got {side.shape[1]}."
                )
        low, high = (np.broadcast_to(side, (len(t), size)) for side in sides)
        return low, high

    def _side(self, name: str, t: Array) -> Array:
        """One bound at times, (P, entries)."""
        bound = getattr(self, name)
        if not callable(bound):
            return np.broadcast_to(bound, (len(t), bound.size))
        rows = [_value(f"{name} bound at t = {each:.4g} s", bound, float(each)) for each in t]
        if len({row.size for row in rows}) > 1:
            raise InputError(f"the {name} bound of a Between has not as many numbers at all times.")
        return np.stack(rows) if rows else np.zeros((0, 1))


@dataclass(frozen=True, eq=False)
class Near(TwoSided):
    """Within a distance of values that should be equal to others.

    value: those of an Equal. room: the largest distance that is accepted.
    """

    value: npt.ArrayLike
    room: float

    def at(self, t: Array, size: int | None, within: Array | None = None) -> tuple[Array, Array]:
        """See TwoSided."""
        value = np.asarray(self.value, dtype=float)
        value = np.broadcast_to(value, (len(t), value.size if size is None else size))
        return value - self.room, value + self.room


@dataclass(frozen=True, eq=False)
class _Later:
    """A bound that is a function of time, by a clock that starts at `time`."""

    bound: Callable[[float], npt.ArrayLike]
    time: float

    def __call__(self, t: float) -> npt.ArrayLike:
        return self.bound(self.time + t)


def _from_time(bound: Bound, time: float) -> Bound:
    if isinstance(bound, _Later):
        return _Later(bound.bound, bound.time + time)
    return _Later(bound, time) if callable(bound) else bound


def _value(name: str, bound: Callable[[float], npt.ArrayLike], t: float) -> Array:
    """A bound that is a function of time, at a time."""
    try:
        value = bound(t)
    except Exception as error:  # a user's own function may raise anything
        raise InputError(f"the {name} of a Between failed: {reason(error)}.") from error
    return _numbers(name, value)


def _numbers(name: str, value: npt.ArrayLike) -> Array:
    """A bound as an array of one dimension."""
    numbers = np.atleast_1d(numbers_of(f"the {name} of a Between", value))
    if numbers.ndim > 1 or np.isnan(numbers).any():
        raise InputError(
            f"the {name} of a Between must be numbers, -inf or inf for no bound, got {value!r}."
        )
    return np.asarray(numbers)
