"""Interval arithmetic: bounds of the result of each of CasADi's operations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Bound = tuple[Array, Array]

POLYNOMIAL_POWER = 4
"""Largest whole exponent whose power counts as arithmetic."""


@dataclass(eq=False)
class Run:
    """What is seen of the functions while boxes go through the instructions."""

    calm: Mask
    jumps: Mask
    change: float
    here: Mask = field(default_factory=lambda: np.array(True))
    """Whether the present instruction is calm."""

    def resolves(self, width: Array) -> None:
        """An argument, or its relative size, has such a width."""
        self.here = self.here & (width <= self.change)

    def switches(self, where: Mask, jump: bool = False) -> None:
        """A function has a kink, or jumps, where this holds."""
        self.here = self.here & ~where
        if jump:
            self.jumps |= where

    def settle(self, negligible: Mask) -> None:
        """The end of an instruction, whose result may change by a negligible amount."""
        self.calm &= self.here | negligible
        self.here = np.array(True)


def _hull(*corners: Array) -> Bound:
    """The bounds of values; 0 for products of 0 and infinity."""
    low, high = corners[0], corners[0]
    for x in corners[1:]:
        low, high = np.minimum(low, x), np.maximum(high, x)
    if np.isnan(low).any():  # of one corner
        return _hull(*(np.where(np.isnan(x), 0.0, x) for x in corners))
    return low, high


def _add(run: Run, x: Bound, y: Bound) -> Bound:
    return x[0] + y[0], x[1] + y[1]


def _subtract(run: Run, x: Bound, y: Bound) -> Bound:
    return x[0] - y[1], x[1] - y[0]


def _multiply(run: Run, x: Bound, y: Bound) -> Bound:
    if x is y:
        return _square(run, x)
    return _hull(x[0] * y[0], x[0] * y[1], x[1] * y[0], x[1] * y[1])


def _square(run: Run, x: Bound) -> Bound:
    low, high = _hull(x[0] * x[0], x[1] * x[1])
    return np.where((x[0] <= 0) & (x[1] >= 0), 0.0, low), high


def _invert(run: Run, x: Bound) -> Bound:
    crosses = (x[0] <= 0) & (x[1] >= 0)
    run.resolves(_relative(x))
    low, high = np.minimum(1 / x[0], 1 / x[1]), np.maximum(1 / x[0], 1 / x[1])
    return np.where(crosses, -np.inf, low), np.where(crosses, np.inf, high)


def _divide(run: Run, x: Bound, y: Bound) -> Bound:
    if np.ndim(y[0]) == 0 and y[0] == y[1] != 0:  # by a number
        return _hull(x[0] / y[0], x[1] / y[0])
    return _multiply(run, x, _invert(run, y))


def _power(run: Run, x: Bound, p: Bound) -> Bound:
    exponent = float(np.ravel(p[0])[0])
    if not (np.all(p[0] == exponent) and np.all(p[1] == exponent)):
        return _exp(run, _multiply(run, p, _log(run, x)))
    ends = x[0] ** exponent, x[1] ** exponent
    whole = exponent == np.floor(exponent)
    if not (whole and 0 <= exponent <= POLYNOMIAL_POWER):
        run.resolves(abs(exponent) * _relative(x))
    crosses = (x[0] <= 0) & (x[1] >= 0)
    if exponent < 0:
        low, high = np.minimum(*ends), np.maximum(*ends)
        return np.where(crosses, -np.inf, low), np.where(crosses, np.inf, high)
    if whole and exponent % 2 == 0:
        return np.where(crosses, 0.0, np.minimum(*ends)), np.maximum(*ends)
    return ends


def _relative(x: Bound) -> Array:
    """Width relative to the least absolute value; infinite if that is 0."""
    least = np.where((x[0] <= 0) & (x[1] >= 0), 0.0, np.minimum(np.abs(x[0]), np.abs(x[1])))
    width = x[1] - x[0]
    return np.asarray(np.where(width == 0, 0.0, width / least))


def _rising(function: Callable[[Array], Array]) -> Callable[[Run, Bound], Bound]:
    """The rule of a monotone function whose scale is 1."""

    def rule(run: Run, x: Bound) -> Bound:
        run.resolves(x[1] - x[0])
        return function(x[0]), function(x[1])

    return rule


def _relatively_rising(function: Callable[[Array], Array]) -> Callable[[Run, Bound], Bound]:
    """The rule of a monotone function that is singular at 0."""

    def rule(run: Run, x: Bound) -> Bound:
        run.resolves(_relative(x))
        return function(np.maximum(x[0], 0.0)), function(np.maximum(x[1], 0.0))

    return rule


_exp = _rising(np.exp)
_log = _relatively_rising(np.log)


def _wave(phase: float) -> Callable[[Run, Bound], Bound]:
    """The rule of sin(x + phase)."""

    def rule(run: Run, x: Bound) -> Bound:
        run.resolves(x[1] - x[0])
        a, b = x[0] + phase, x[1] + phase
        low, high = _hull(np.sin(a), np.sin(b))
        turn = 2 * np.pi
        top = np.floor((b - np.pi / 2) / turn) > np.floor((a - np.pi / 2) / turn)
        bottom = np.floor((b + np.pi / 2) / turn) > np.floor((a + np.pi / 2) / turn)
        wild = ~np.isfinite(b - a)
        return np.where(bottom | wild, -1.0, low), np.where(top | wild, 1.0, high)

    return rule


def _tan(run: Run, x: Bound) -> Bound:
    run.resolves((x[1] - x[0]) / np.minimum(np.abs(np.cos(x[0])), np.abs(np.cos(x[1]))))
    pole = np.floor(x[0] / np.pi + 0.5) != np.floor(x[1] / np.pi + 0.5)
    return np.where(pole, -np.inf, np.tan(x[0])), np.where(pole, np.inf, np.tan(x[1]))


def _arc(function: Callable[[Array], Array]) -> Callable[[Run, Bound], Bound]:
    """The rule of asin and acos, singular at -1 and 1."""

    def rule(run: Run, x: Bound) -> Bound:
        room = 1.0 - np.maximum(np.abs(x[0]), np.abs(x[1]))
        width = x[1] - x[0]
        run.resolves(np.where(width == 0, 0.0, width / np.sqrt(np.maximum(room, 0.0))))
        return _hull(function(np.clip(x[0], -1, 1)), function(np.clip(x[1], -1, 1)))

    return rule


def _atan2(run: Run, y: Bound, x: Bound) -> Bound:
    corners = [np.arctan2(a, b) for a in y for b in x]
    cut = (y[0] <= 0) & (y[1] >= 0) & (x[0] <= 0)
    near = np.hypot(*(np.where((z[0] <= 0) & (z[1] >= 0), 0.0, _least(z)) for z in (y, x)))
    run.resolves((y[1] - y[0] + x[1] - x[0]) / near)
    run.switches(cut, jump=True)
    low, high = _hull(*corners)
    return np.where(cut, -np.pi, low), np.where(cut, np.pi, high)


def _least(x: Bound) -> Array:
    return np.minimum(np.abs(x[0]), np.abs(x[1]))


def _abs(run: Run, x: Bound) -> Bound:
    crosses = (x[0] < 0) & (x[1] > 0)
    run.switches(crosses)
    low, high = _hull(np.abs(x[0]), np.abs(x[1]))
    return np.where(crosses, 0.0, low), high


def _extreme(function: Callable[[Array, Array], Array]) -> Callable[[Run, Bound, Bound], Bound]:
    """The rule of min and max."""

    def rule(run: Run, x: Bound, y: Bound) -> Bound:
        run.switches((x[0] < y[1]) & (y[0] < x[1]))
        return function(x[0], y[0]), function(x[1], y[1])

    return rule


def _stepping(function: Callable[..., Array]) -> Callable[..., Bound]:
    """The rule of a function that is constant between jumps, and rises or falls with each."""

    def rule(run: Run, *x: Bound) -> Bound:
        corners = [function(*each) for each in _corners(x)]
        low, high = np.minimum.reduce(corners), np.maximum.reduce(corners)
        run.switches(low < high, jump=True)
        return low, high

    return rule


def _corners(x: Sequence[Bound]) -> list[tuple[Array, ...]]:
    if len(x) == 1:
        return [(x[0][0],), (x[0][1],)]
    return [(a, b) for a in x[0] for b in x[1]]


def _equal(run: Run, x: Bound, y: Bound) -> Bound:
    may = (x[0] <= y[1]) & (y[0] <= x[1])
    must = (x[0] == x[1]) & (y[0] == y[1]) & (x[0] == y[0])
    run.switches(may & ~must, jump=True)
    return must.astype(float), may.astype(float)


def _negated(run: Run, x: Bound) -> Bound:
    return 1.0 - np.minimum(np.abs(x[1]), 1.0), 1.0 - np.minimum(np.abs(x[0]), 1.0)


def _if_else_zero(run: Run, condition: Bound, x: Bound) -> Bound:
    never, always = condition[1] == 0, condition[0] != 0
    low, high = np.minimum(x[0], 0.0), np.maximum(x[1], 0.0)
    return (
        np.where(always, x[0], np.where(never, 0.0, low)),
        np.where(always, x[1], np.where(never, 0.0, high)),
    )


def _cosh(run: Run, x: Bound) -> Bound:
    run.resolves(x[1] - x[0])
    low, high = _hull(np.cosh(x[0]), np.cosh(x[1]))
    return np.where((x[0] <= 0) & (x[1] >= 0), 1.0, low), high


def _hypot(run: Run, x: Bound, y: Bound) -> Bound:
    total = _add(run, _square(run, x), _square(run, y))
    return _relatively_rising(np.sqrt)(run, total)


def unknown(run: Run, *x: Bound) -> Bound:
    """The rule of an operation without one."""
    run.switches(np.ones_like(run.calm), jump=True)
    return np.full(run.calm.shape, -np.inf), np.full(run.calm.shape, np.inf)


RULES: dict[int, Callable[..., Bound]] = {
    ca.OP_ASSIGN: lambda run, x: x,
    ca.OP_ADD: _add,
    ca.OP_SUB: _subtract,
    ca.OP_NEG: lambda run, x: (-x[1], -x[0]),
    ca.OP_TWICE: lambda run, x: (2.0 * x[0], 2.0 * x[1]),
    ca.OP_MUL: _multiply,
    ca.OP_SQ: _square,
    ca.OP_DIV: _divide,
    ca.OP_INV: _invert,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_SQRT: _relatively_rising(np.sqrt),
    ca.OP_EXP: _exp,
    ca.OP_LOG: _log,
    ca.OP_EXPM1: _rising(np.expm1),
    ca.OP_SIN: _wave(0.0),
    ca.OP_COS: _wave(np.pi / 2),
    ca.OP_TAN: _tan,
    ca.OP_ASIN: _arc(np.arcsin),
    ca.OP_ACOS: _arc(np.arccos),
    ca.OP_ATAN: _rising(np.arctan),
    ca.OP_ATAN2: _atan2,
    ca.OP_SINH: _rising(np.sinh),
    ca.OP_COSH: _cosh,
    ca.OP_TANH: _rising(np.tanh),
    ca.OP_ASINH: _rising(np.arcsinh),
    ca.OP_FABS: _abs,
    ca.OP_FMIN: _extreme(np.minimum),
    ca.OP_FMAX: _extreme(np.maximum),
    ca.OP_HYPOT: _hypot,
    ca.OP_SIGN: _stepping(np.sign),
    ca.OP_FLOOR: _stepping(np.floor),
    ca.OP_CEIL: _stepping(np.ceil),
    ca.OP_LT: _stepping(lambda x, y: np.less(x, y).astype(float)),
    ca.OP_LE: _stepping(lambda x, y: np.less_equal(x, y).astype(float)),
    ca.OP_EQ: _equal,
    ca.OP_NE: lambda run, x, y: _negated(run, _equal(run, x, y)),
    ca.OP_NOT: _negated,
    ca.OP_AND: _stepping(lambda x, y: np.logical_and(x, y).astype(float)),
    ca.OP_OR: _stepping(lambda x, y: np.logical_or(x, y).astype(float)),
    ca.OP_IF_ELSE_ZERO: _if_else_zero,
}
"""The bounds of an operation on bounds, by its number."""
PLAIN = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
"""Instructions that are no operations."""
ARITHMETIC = PLAIN | {
    *(ca.OP_ASSIGN, ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_MUL, ca.OP_SQ)
}
"""Those that a function of sums and products has."""
