"""A condition: the values of a function, in a set, at some instants of a motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, Generic, Self, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_number
from hovi.checks.shapes import numbers_of
from hovi.conditions.expression import Expression, FunctionLike, function_of
from hovi.conditions.function import Function, linear
from hovi.conditions.places import Along, AtNode, AtPoints, AtTimes, Where
from hovi.conditions.sets import Between, Equal, TwoSided
from hovi.discrete.grid import DiscretePath, Grid
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Values = TypeVar("Values", bound=Equal | TwoSided, covariant=True)
Place = TypeVar("Place", bound=Where, covariant=True)

TOLERANCE = 1e-6
"""Fraction of its scale by which a bound may be exceeded."""
DIGITS = 4, 6, 9
"""Digits of values in messages: the least that tell a value from its bound."""
EVERYWHERE: Any = AtPoints()


@check_arguments_except("function", "on", "where")
@dataclass(frozen=True, eq=False)
class Condition(Generic[Values, Place]):
    """y(q, v, a, tau, t) in a set, at instants of a motion.

    Bounds of y(q, v, a, tau, t) and values of y(q, v, a, t) hold at all times, values of y(q, v, t)
    at given times.

    function: y: a formula as of the effect RunningCost, which may be a column, as in "tau * v"; a
        function that returns a CasADi expression of the arguments that it names, of q, v, a, tau
        and t; or a hovi.Function.
    on: hovi.Between(lower, upper) or hovi.Equal(value).
    where: hovi.AtTimes(times) for a value at some times; left out for all times.
    name: in messages. unit: of y, in messages. of: names of its entries there, such as joints.
    read: of a value of y what messages say, in that unit: such as the root, where y is a square.
    middle: of narrow bounds, the values between them, with which a solve begins.
    scale: of bounded y, one number or one for each entry: by default upper - lower, or
        max(1, |bound|) of a single bound. Bounds that are functions of time need it.
    tolerance: at least 1e-6: the fraction of the scale by which a bound may be exceeded anywhere;
        how far y may be from a value between the nodes of a grid, in the unit of y, in each entry
        where entries have names, else in all together. Values have no scale, and those at given
        times no tolerance: they are missed by at most 1e-6.
    during: (begin, end) in [s], the part of the motion in which it holds, between which grids have
        nodes; the whole motion if None.
    Raises InputError for anything else.
    """

    function: FunctionLike
    on: Values
    where: Place = EVERYWHERE
    name: str = "given"
    unit: str = ""
    scale: npt.ArrayLike | None = None
    tolerance: float = TOLERANCE
    of: Sequence[str] = ()
    during: tuple[float, float] | None = None
    read: Callable[[float], float] | None = None
    middle: Condition[Any, Any] | None = None

    def __post_init__(self) -> None:
        if not (isinstance(self.function, str | Function) or callable(self.function)):
            raise InputError(
                "the function of a condition must be a formula, a function of CasADi symbols or a "
                f"Function, got {self.function!r}."
            )
        if not isinstance(self.on, Equal | TwoSided):
            raise InputError(
                f"a condition needs a hovi.Between or a hovi.Equal, got {self.on!r:.200}."
            )
        _require_place(self)
        if not (is_number(self.tolerance) and TOLERANCE <= self.tolerance < np.inf):
            raise InputError(
                f"condition {self.name!r} needs a positive tolerance of at least {TOLERANCE:g}, "
                f"not {self.tolerance!r}."
            )
        timed = isinstance(self.where, AtTimes) and self.tolerance != TOLERANCE
        if self.during is not None:
            require_part(self.during, f"condition {self.name!r}")
            if isinstance(self.where, AtTimes):
                raise InputError(
                    f"condition {self.name!r} is asked at given times: leave its `during` out."
                )
        if isinstance(self.on, Equal) and (self.scale is not None or timed):
            raise InputError(
                f"condition {self.name!r} has a value: leave its `scale` out, which is that of "
                "bounds, and at given times its `tolerance`, or use a hovi.Between."
            )
        if self.middle is not None and not isinstance(self.middle.on, Equal):
            raise InputError(
                f"the middle of condition {self.name!r} must be a condition with a hovi.Equal."
            )
        if self.scale is not None:
            scale = numbers_of(f"the scale of condition {self.name!r}", self.scale)
            if scale.ndim > 1 or not (np.isfinite(scale) & (scale > 0)).all():
                raise InputError(
                    f"the scale of condition {self.name!r} must be positive, got {self.scale!r}."
                )
        elif isinstance(self.on, TwoSided) and self.on.varies:
            raise InputError(
                f"condition {self.name!r} has bounds that are functions of time and needs a "
                "`scale`: the size of its values that counts as large."
            )

    @property
    def y(self) -> Function:
        """The function; of a condition `with_function`."""
        assert isinstance(self.function, Function)
        return self.function

    def shown(self, y: float, digits: int = 6) -> str:
        """A value or a bound as messages have it, in `unit`."""
        return f"{float(y) if self.read is None or np.isinf(y) else self.read(y):.{digits}g}"

    def shown_apart(self, y: float, bound: float) -> tuple[str, str]:
        """A value and its bound in as few digits as tell one from the other."""
        pairs = [(self.shown(y, n), self.shown(bound, n)) for n in DIGITS]
        return next((pair for pair in pairs if pair[0] != pair[1]), pairs[0])

    @property
    def timed(self) -> bool:
        """Whether it changes with time, whatever the motion; of a condition `with_function`."""
        return "t" in self.y.needs or (isinstance(self.on, TwoSided) and self.on.varies)

    def from_time(self, time: float) -> Self:
        """The same by a clock that starts at a time, in [s], but for the times of its place."""
        if not self.timed and self.during is None:
            return self
        on: Any = self.on.from_time(time)
        part = self.during and (self.during[0] - time, self.during[1] - time)
        middle = self.middle and self.middle.from_time(time)
        changes: dict[str, Any] = {"function": self.y.from_time(time), "middle": middle}
        return dataclasses.replace(self, on=on, during=part, **changes)

    @property
    def centered(self) -> Condition[Any, Any]:
        """The values between narrow bounds; itself without these."""
        if self.middle is None:
            return self
        return dataclasses.replace(self.middle, name=self.name, during=self.during)

    def holds_at(self, t: Array) -> Mask:
        """Where it holds, at times in [s] that are no nodes of a grid: shape of t."""
        if self.during is None:
            return np.ones(np.shape(t), dtype=bool)
        begin, end = self.during
        return np.asarray((begin < t) & (t < end))

    def holds_in(self, grid: Grid) -> Mask:
        """The intervals of a grid in which it holds, shape (N,)."""
        return self.holds_at(grid.t[:-1] + grid.steps / 2)


def _require_place(given: Condition[Any, Any]) -> None:
    """Raise InputError for sets at places that are not supported."""
    if not isinstance(given.where, Where):
        raise InputError(
            f"condition {given.name!r} needs hovi.AtTimes(times) as `where`, or none for all "
            f"times, got {given.where!r:.200}."
        )
    if isinstance(given.on, TwoSided) and isinstance(given.where, AtNode | AtTimes | Along):
        raise InputError(
            f"condition {given.name!r} has bounds, which hold at all times: leave `where` out."
        )


def require_part(during: Any, subject: str) -> None:
    """Raise InputError for a part of a motion that is none. subject: whose it is, in messages."""
    try:
        begin, end = (float(t) for t in during)
    except (TypeError, ValueError):
        begin = end = np.nan
    if not (np.isfinite([begin, end]).all() and begin < end):
        raise InputError(
            f"`during` of {subject} must be (begin, end) in [s], two ascending times, got "
            f"{during!r:.200}."
        )


Equation = Condition[Equal, AtNode]
"""c(q, v) = value at a node."""
EquationAlong = Condition[Equal, Along]
"""y(q, v, a, t) = value at all times."""
Inequality = Condition[Between, AtPoints]
"""lower <= y(q, v, a, tau, t) <= upper at all times."""


@lru_cache(maxsize=256)
def with_function(
    given: Condition[Equal | Between, Where], coordinates: Coordinates
) -> Condition[Equal | Between, Where]:
    """The condition with its function of a robot's coordinates.

    Raises InputError for a function, bounds, a value or a scale that do not fit each other.
    """
    y = function_of(given.function, given.name, coordinates)
    where = given.where
    if isinstance(given.on, Between):
        given.on.at(np.zeros(1), y.size)
    else:
        _require_size("value", given, np.asarray(given.on.value), y.size)
        if not isinstance(where, AtTimes):
            where = _along(given, y, coordinates)
        elif more := sorted(y.needs - {"q", "v", "t"}):
            raise InputError(
                f"condition {given.name!r} at given times must be a function of q, v and t, but it "
                f"depends on {' and '.join(more)}."
            )
    if given.scale is not None:
        _require_size("scale", given, np.asarray(given.scale), y.size)
    if len(given.of) not in (0, y.size):
        raise InputError(
            f"condition {given.name!r} needs {y.size} names in `of`, one for each value of its "
            f"function, got {len(given.of)}."
        )
    middle = given.middle and with_function(given.middle, coordinates)
    return dataclasses.replace(given, function=y, where=where, middle=middle)


def _along(given: Condition[Equal | Between, Where], y: Function, on: Coordinates) -> Along:
    """Where an equation along the motion holds. Raises InputError for one that cannot."""
    if "tau" in y.needs:
        raise InputError(
            f"condition {given.name!r} is an equation of torques at all times, which is not "
            "supported: name joints without torque as `passive`, or use a hovi.Between with some "
            "room."
        )
    level = max((i for i, x in enumerate(("q", "v", "a")) if x in y.needs), default=0)
    if level == 0 and not isinstance(y, Expression) and on.curved_space is not None:
        raise InputError(
            f"condition {given.name!r} is an equation of orientations at all times, and needs the "
            "derivative of its function in time: give a formula or a function of CasADi symbols."
        )
    if level == 0:
        _ = y.rate  # what is pickled has it
    return Along(level)


def _require_size(
    what: str, given: Condition[Equal | Between, Where], numbers: Array, size: int
) -> None:
    if numbers.size not in (1, size):
        raise InputError(
            f"the {what} of condition {given.name!r} must be one number or {size}, one for each "
            f"value of its function, got {numbers.size}."
        )


def scales(each: Condition[TwoSided, Any]) -> Array:
    """The scale of every entry, shape (size,): as given, or the range between the bounds."""
    if each.scale is not None:
        return np.broadcast_to(np.asarray(each.scale, dtype=float), (each.y.size,))
    low, high = (side[0] for side in each.on.at(np.zeros(1), each.y.size))
    single = np.where(np.isfinite(low), low, high)
    size = np.maximum(1.0, np.abs(np.where(np.isfinite(single), single, 1.0)))
    with np.errstate(invalid="ignore"):
        both = high - low
    return np.where(np.isfinite(both), both, size)


def equation(function: Function, node: int, time: float) -> Equation:
    """c(q, v) = 0 at a node, and the time there in [s]."""
    return Condition(function, Equal(), AtNode(node, time), "")


def residual(each: Equation, x: DiscretePath) -> Array:
    """c - value at a path, shape (k,)."""
    return each.on.missed(each.y.values(each.where.points(x))[0])


def linear_at(each: Equation, q: Array, v: Array) -> tuple[Array, Array]:
    """c - value at a state, shape (k,), and its Jacobian in (q, v), shape (k, 2, nv)."""
    c, J = linear(each.y, q, v, each.where.time)
    return each.on.missed(c), J


def missed(each: Equation, x: DiscretePath) -> str:
    """By how much an equation is missed at a path, as a clause; "" if it is satisfied."""
    size = np.max(np.abs(residual(each, x)), initial=0.0)
    return "" if size <= each.tolerance and not is_spurious(each, x) else describe(each, x)


def describe(each: Equation, x: DiscretePath) -> str:
    """By how much an equation is missed at a path, as a clause."""
    return each.y.describe(each.where.points(x), residual(each, x))


def whose(each: Equation) -> str:
    """What an equation is of, as the subject of a sentence."""
    return f"condition {each.name!r}" if each.name else "the goal"


def is_spurious(each: Equation, x: DiscretePath) -> bool:
    """Whether an equation holds at a path at a root where what is meant does not."""
    return each.y.is_spurious(each.where.points(x))
