"""A limit that holds only from some time on, as the start of a motion is outside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cache
from math import comb
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.conditions.joint_quantity import QUANTITIES
from hovi.errors import InputError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

KINDS = tuple(QUANTITIES)
ROUNDING = 1e-12
"""Relative rounding error of a time."""
MOST_POWERS = 4
"""Number of coefficients of a polynomial at most: of the third degree for positions of order 3."""


@dataclass(frozen=True)
class Excused:
    """A limit that a start exceeds, or cannot but exceed, and how it is led back inside.

    Until a time the bound of the coordinate is wider by e(t) = sum_j powers_j t^j >= 0, which is
    fixed before the solve; e vanishes at that time, and from there on the limit holds.

    limit: its kind, such as "v". joint: name of the coordinate. excess: the largest e, in the unit
        of the limit. until: in [s] from the start of the motion.
    coordinate: its index. side: 1 for the upper bound, -1 for the lower one. powers: of e, in the
        unit of the limit per [s^j].
    """

    limit: str
    joint: str
    excess: float
    until: float
    coordinate: int = field(repr=False)
    side: int = field(repr=False)
    powers: tuple[float, ...] = field(repr=False)

    def __str__(self) -> str:
        """Which limit is exceeded by how much, and until when, as a clause."""
        return (
            f"the {QUANTITIES[self.limit]} of joint {self.joint!r} by up to {self.excess:.3g} "
            f"until {self.until:.3g} s"
        )

    @property
    def row(self) -> int:
        """The row of its kind in limits."""
        return KINDS.index(self.limit)

    def at(self, t: Array) -> Array:
        """e at times t of any shape, in [s]; zero from `until` on."""
        e = np.polynomial.polynomial.polyval(t, self.powers)
        return np.where(t < self.until, np.maximum(e, 0.0), 0.0)

    def control_points(self, begin: Array, length: Array, degree: int) -> Array:
        """Control points of a polynomial of a degree that is at most e, (M, degree + 1).

        Of e itself on parts of the motion that end by `until`, and of zero on others.
        begin, length: of the parts, shape (M,), in [s].
        """
        points = np.zeros((len(begin), degree + 1))
        inside = begin + length <= self.until * (1.0 + ROUNDING)
        e = np.polynomial.Polynomial(self.powers)
        for j in range(min(len(self.powers), degree + 1)):
            local = e.deriv(j)(begin[inside]) * length[inside] ** j if j else e(begin[inside])
            points[inside] += local[:, None] * _monomial(degree, j)
        return points

    def to_dict(self) -> dict[str, Any]:
        """As JSON-able data."""
        names = "limit", "joint", "excess", "until", "coordinate", "side"
        return {**{name: getattr(self, name) for name in names}, "powers": list(self.powers)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], coordinates: int) -> Excused:
        """The inverse of to_dict; the data may be a stranger's. coordinates: their number.

        Raises InputError for other data.
        """
        try:
            numbers = tuple(float(each) for each in data["powers"])
            found = cls(
                str(data["limit"]),
                str(data["joint"]),
                float(data["excess"]),
                float(data["until"]),
                int(data["coordinate"]),
                int(data["side"]),
                numbers,
            )
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise InputError(f"an excused limit has no valid {error.args[0]!r}.") from error
        known = found.limit in KINDS and 0 <= found.coordinate < coordinates
        finite = np.isfinite([found.excess, found.until, *numbers]).all() and found.until >= 0
        if not (known and finite and abs(found.side) == 1 and 0 < len(numbers) <= MOST_POWERS):
            raise InputError(f"an excused limit is not valid: {found}.")
        return found


def excused_sentence(excused: Sequence[Excused]) -> str:
    """What of its limits a motion exceeds from its start on; "" if nothing."""
    if not excused:
        return ""
    return f"The start is led back inside its limits; excused is {', '.join(map(str, excused))}."


def widening(excused: Sequence[Excused], side: int, t: Array, shape: tuple[int, ...]) -> Array:
    """By how much bounds of a side are wider at times t, shape (*t.shape, kinds, nv).

    shape: (kinds, nv).
    """
    wider = np.zeros((*t.shape, *shape))
    for each in excused:
        if each.side == side:
            wider[..., each.row, each.coordinate] += each.at(t)
    return wider


@cache
def _monomial(degree: int, j: int) -> Array:
    """Control points of s^j / j! on [0, 1], shape (degree + 1,)."""
    factorial = float(np.prod(np.arange(1, j + 1)))
    return np.array([comb(i, j) / comb(degree, j) / factorial for i in range(degree + 1)])
