"""Functions from formulas and from CasADi expressions of q, v, a, tau and t."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Mapping
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.function import ARGUMENTS, Curvature, Function, Points, Slopes
from hovi.discrete.cells import CHANGE
from hovi.dynamics.point_function import PointFunction
from hovi.effects.expressions.enclosure import Enclosed, Enclosure
from hovi.effects.expressions.interval_rules import Bound
from hovi.errors import InputError, reason
from hovi.robot.robot import Robot
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates

Array = npt.NDArray[np.float64]
FunctionLike = str | Callable[..., Any] | Function
"""A formula, a function of CasADi symbols whose arguments are some of ARGUMENTS, or a Function."""
_TAKEN = (
    "give a formula, a function of CasADi symbols with names of q, v, a, tau and t, or, for NumPy, "
    "a hovi.Function"
)
_JERK = "jerk", "j", "dtau", "torque_rate", "tau_rate"


class Expression(Function):
    """y from a CasADi expression.

    symbols: of q, v, a, tau and t. y: a column of them. space: of the configurations; None if it is
    a vector space.
    """

    def __init__(
        self, symbols: dict[str, ca.SX], y: ca.SX, space: ConfigurationSpace | None
    ) -> None:
        self._symbols, self._y, self._space = symbols, y, space
        self._n, self._size = int(symbols["v"].numel()), int(y.numel())
        self._named = [x for x in ARGUMENTS if ca.depends_on(y, symbols[x])]
        self._names = [x for x in self._named if x != "t"]
        self._begin = 0.0

    def from_time(self, time: float) -> Function:
        """The same by a clock that starts at a time, in [s]: with the same compiled functions."""
        if "t" not in self._named:
            return self
        later = copy.copy(self)
        later._begin = self._begin + time
        vars(later).pop("_enclosure", None)
        if "rate" in vars(self):
            vars(later)["rate"] = self.rate.from_time(time)
        return later

    def minus(self, offset: Callable[[ca.SX], ca.SX]) -> Expression:
        """y(q, v, a, tau, t) - offset(t)."""
        return Expression(self._symbols, self._y - offset(self._symbols["t"]), self._space)

    @cached_property
    def rate(self) -> Function:
        """dy/dt of y(q, t)."""
        q, v, t = (self._symbols[x] for x in ("q", "v", "t"))
        empty = ca.SX(0, 1)
        J = tangent.jacobian(self._y, (q, empty, empty, t), self._space)
        rate = Expression(self._symbols, J @ v + ca.jacobian(self._y, t), self._space)
        return rate.from_time(self._begin) if self._begin else rate

    @property
    def function(self) -> ca.Function:
        """y of the arguments that it names, in the order of ARGUMENTS."""
        own = self._values.function
        if not self._begin:
            return own
        given = [ca.SX.sym(x, own.numel_in(i)) for i, x in enumerate(self._named)]
        by_its_clock = [*given[:-1], given[-1] + self._begin]  # t is the last of ARGUMENTS
        return ca.Function("y", given, [own(*by_its_clock)])

    @property
    def needs(self) -> frozenset[str]:
        """What the expression names."""
        return frozenset(self._named)

    @property
    def size(self) -> int:
        """Number of rows of y."""
        return self._size

    def values(self, at: Points) -> Array:
        """y, shape (P, size)."""
        return self._values(*self._arguments(at))[0].reshape(len(at.q), self.size)

    def enclosure(self, box: Mapping[str, Bound]) -> Enclosed | None:
        """Bounds of y over boxes of its arguments, by their names; None if it has none."""
        if not self._enclosure.known:
            return None
        return self._enclosure([box[x] for x in self._named], CHANGE)

    def slopes(self, at: Points) -> Slopes:
        """First derivatives in what y names."""
        found = self._slopes(*self._arguments(at))
        shape = len(at.q), self.size, self._n
        return {x: J.reshape(shape) for x, J in zip(self._names, found, strict=True)}

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """Weighted second derivatives in what y names."""
        if not self._pairs:
            return {}
        found = self._curvature(*self._arguments(at), weights)
        shape = len(at.q), self._n, self._n
        return {pair: H.reshape(shape) for pair, H in zip(self._pairs, found, strict=True)}

    def __getstate__(self) -> dict[str, Any]:
        """The functions without the expression, which cannot be pickled."""
        functions = {name: getattr(self, name) for name in ("_values", "_slopes", "_curvature")}
        kept = ("_named", "_names", "_n", "_size", "_pairs", "_begin")
        known = {"rate": self.rate} if "rate" in vars(self) else {}
        return functions | {name: getattr(self, name) for name in kept} | known

    @cached_property
    def _enclosure(self) -> Enclosure:
        return Enclosure(self.function)

    def _arguments(self, at: Points) -> list[Array]:
        shifts = {"t": self._begin} if self._begin else {}
        return [at.argument(x) + shifts[x] if x in shifts else at.argument(x) for x in self._named]

    def _block(self, name: str) -> slice:
        """The columns of an argument among those of (q, v, a, tau)."""
        first = ARGUMENTS.index(name) * self._n
        return slice(first, first + self._n)

    def _function(self, name: str, results: list[ca.SX], *more: ca.SX) -> PointFunction:
        return PointFunction(
            ca.Function(name, [*(self._symbols[x] for x in self._named), *more], results)
        )

    @cached_property
    def _columns(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
        q, v, a, tau = (self._symbols[x] for x in ARGUMENTS[:4])
        return q, ca.vertcat(v, a, tau), ca.SX(0, 1), ca.SX(0, 1)

    @cached_property
    def _values(self) -> PointFunction:
        return self._function("y", [self._y])

    @cached_property
    def _slopes(self) -> PointFunction:
        J = tangent.jacobian(self._y, self._columns, self._space)
        return self._function("dy", [J[:, self._block(x)] for x in self._names])

    @cached_property
    def _bent(self) -> tuple[ca.SX, dict[tuple[str, str], ca.SX]]:
        """The weights, and the blocks of the second derivatives that are not zero."""
        weights = ca.SX.sym("w", self.size)
        H = tangent.hessian(ca.dot(weights, self._y), self._columns, self._space)[0]
        pairs = combinations_with_replacement(self._names, 2)
        blocks = {(x, z): H[self._block(x), self._block(z)] for x, z in pairs}
        return weights, {pair: block for pair, block in blocks.items() if block.nnz() > 0}

    @cached_property
    def _pairs(self) -> list[tuple[str, str]]:
        return list(self._bent[1])

    @cached_property
    def _curvature(self) -> PointFunction:
        weights, blocks = self._bent
        return self._function("ddy", list(blocks.values()), weights)


def function_of(given: FunctionLike, name: str, coordinates: Coordinates) -> Function:
    """A function of a robot's motion, or of other coordinates.

    name: of the condition, in messages. Raises InputError or SceneError for formulas and functions
    that are none of q, v, a, tau and t, that do not depend on the motion, or without values.
    """
    if isinstance(given, Expression):
        return given
    if isinstance(given, Function):
        return _tried(given, f"condition {name!r}", coordinates)
    n = coordinates.nv
    sizes = {"q": coordinates.nq, "v": n, "a": n, "tau": n, "t": 1}
    symbols = {x: ca.SX.sym(x, size) for x, size in sizes.items()}
    what = f"condition {name!r}"
    if isinstance(given, str):
        if not isinstance(coordinates, Robot):
            raise InputError(f"{what}: formulas need a robot: give a function of q, v and a.")
        from hovi.effects.expressions.formula import expression  # 10 ms
        from hovi.effects.expressions.formula_symbols import cost_symbols
        from hovi.effects.expressions.symbols import SceneSymbols

        q, v, a, tau, t = symbols.values()
        known = cost_symbols(coordinates, SceneSymbols(q, v, a, t), tau)
        y = expression(what, given, known, columns=True)
    else:
        y = _called(given, what, symbols)
    found = Expression(symbols, ca.densify(y), coordinates.curved_space)
    if not found.needs - {"t"}:
        raise InputError(
            f"{what}: its function depends on none of q, v, a and tau, so that no motion changes "
            "it: leave the condition out, or name one of them."
        )
    return found


def _tried(y: Function, what: str, on: Coordinates) -> Function:
    """A function, after its values and slopes at two instants at rest have the shapes they need."""
    n, q = on.nv, np.stack([on.neutral() if isinstance(on, Robot) else np.zeros(on.nq)] * 2)
    rest = [np.zeros((2, n)) for _ in range(3)]
    at = Points(q, rest[0], np.zeros(2), rest[1], rest[2])
    try:
        needs, size = frozenset(y.needs), y.size
        found = {"values": np.shape(y.values(at))}
        found |= {f"slopes in {x}": np.shape(J) for x, J in y.slopes(at).items()}
    except Exception as error:  # a user's own function may raise anything
        raise InputError(f"{what}: its function failed: {reason(error)}.") from error
    if not needs or needs - set(ARGUMENTS):
        raise InputError(
            f"{what}: its function needs some of q, v, a, tau and t, got {sorted(map(str, needs))}."
        )
    wanted = {"values": (2, size)} | {f"slopes in {x}": (2, size, n) for x in needs - {"t"}}
    for name, shape in wanted.items():
        if found.get(name) != shape:
            raise InputError(
                f"{what}: the {name} of its function must have shape {shape} at two instants, got "
                f"{found.get(name, 'none')}."
            )
    return y


def _called(given: Callable[..., Any], what: str, symbols: dict[str, ca.SX]) -> ca.SX:
    """The value of a function of some of the symbols, by the names of its arguments."""
    try:
        names = list(inspect.signature(given).parameters)
    except (TypeError, ValueError):
        names = []
    for each in names:
        if each in _JERK:
            raise InputError(
                f"{what}: its function takes {each!r}, and conditions on the jerk and on the "
                "torque rate are not supported: use `limits`, or q, v, a, tau and t."
            )
        if each not in ARGUMENTS:
            raise InputError(
                f"{what}: its function takes {each!r}, which is none of q, v, a, tau and t: "
                f"{_TAKEN}."
            )
    try:
        y = given(*(symbols[each] for each in names))
    except Exception as error:  # a user's own function may raise anything
        said = reason(error)
        raise InputError(f"{what}: its function failed: {said}; {_TAKEN}.") from error
    try:
        y = ca.SX(y) if not isinstance(y, list | tuple) else ca.vertcat(*map(ca.SX, y))
    except (NotImplementedError, TypeError, ValueError):
        raise InputError(
            f"{what}: its function must return a CasADi expression or a list of them, got "
            f"{type(y).__name__}: {_TAKEN}."
        ) from None
    if min(y.shape) != 1:
        raise InputError(
            f"{what}: its function must return a column of one or more values, got shape {y.shape}."
        )
    known = {each.element_hash() for x in symbols.values() for each in ca.vertsplit(x)}
    foreign = [str(each) for each in ca.symvar(y) if each.element_hash() not in known]
    if foreign:
        raise InputError(
            f"{what}: its function contains {', '.join(foreign[:3])}, which is none of q, v, a, "
            "tau and t: give it a value."
        )
    return ca.vec(y)
