"""Truncated polynomials in t (t^3 = 0) and e (e^2 = 0) over CasADi expressions.

Powers of t carry derivatives along a curve: the coefficient of t^i is the i-th derivative over
i!. The part in e makes a rotation a rigid motion: with turn w and translation v, w + e v obeys the
rules of SO(3), and SE(3) is SO(3) over these numbers [Study1903].
"""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import casadi as ca

Operation = Callable[[ca.SX, ca.SX], ca.SX]

ORDER = 2
"""The highest power of t that is kept."""
_TERMS = 20
"""Terms of entire series: exact to rounding for angles up to 2 pi."""


class Truncated:
    """sum over (i, j) of terms[i, j] t^i e^j; a term that is not there is zero.

    terms: numbers, columns or matrices, all of one shape.
    """

    def __init__(self, terms: dict[tuple[int, int], ca.SX]) -> None:
        self.terms = terms

    def __getitem__(self, power: tuple[int, int]) -> ca.SX:
        """The coefficient of t^i e^j, zeros of the right shape where it is not there."""
        if power in self.terms:
            return self.terms[power]
        return ca.SX.zeros(*next(iter(self.terms.values())).shape)

    def __add__(self, other: Truncated) -> Truncated:
        """The sum, term by term."""
        terms = dict(self.terms)
        for power, term in other.terms.items():
            terms[power] = terms[power] + term if power in terms else term
        return Truncated(terms)

    def __rmul__(self, factor: float) -> Truncated:
        """A multiple."""
        return Truncated({power: factor * term for power, term in self.terms.items()})

    def __sub__(self, other: Truncated) -> Truncated:
        """The difference, term by term."""
        return self + -1.0 * other

    def product(self, other: Truncated, operation: Operation | None = None) -> Truncated:
        """The product, its coefficients multiplied by a bilinear operation."""
        terms: dict[tuple[int, int], ca.SX] = {}
        for (i, j), x in self.terms.items():
            for (k, m), y in other.terms.items():
                if i + k <= ORDER and j + m <= 1:
                    xy = x * y if operation is None else operation(x, y)
                    power = i + k, j + m
                    terms[power] = terms[power] + xy if power in terms else xy
        return Truncated(terms)

    def map(self, linear: Callable[[ca.SX], ca.SX]) -> Truncated:
        """A linear operation on every coefficient."""
        return Truncated({power: linear(term) for power, term in self.terms.items()})

    def entire(self, coefficient: Callable[[int], float], derivative: int = 0) -> Truncated:
        """f(u) or one of its derivatives for a number u and f(u) = sum_k coefficient(k) u^k."""
        u = self[0, 0]
        rest = Truncated({p: term for p, term in self.terms.items() if p != (0, 0)})
        total = Truncated({(0, 0): _horner(u, coefficient, derivative)})
        power = Truncated({(0, 0): ca.SX(1)})
        for k in range(1, ORDER + 2):  # the product of ORDER + 2 terms without a constant is zero
            power = power.product(rest)
            slope = Truncated({(0, 0): _horner(u, coefficient, derivative + k) / factorial(k)})
            total = total + power.product(slope)
        return total


def _horner(u: ca.SX, coefficient: Callable[[int], float], derivative: int) -> ca.SX:
    """A derivative of the series at u."""
    total = ca.SX(0)
    for k in reversed(range(derivative, _TERMS + 1)):
        total = total * u + coefficient(k) * factorial(k) / factorial(k - derivative)
    return total
