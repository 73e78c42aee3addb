"""Where a minimisation begins."""

from __future__ import annotations

from typing import Generic, TypeVar

from hovi.system.dataclass import dataclass

X = TypeVar("X")
Z = TypeVar("Z")


@dataclass(frozen=True, eq=False)
class Start(Generic[X, Z]):
    """A first point, with the multipliers there if they are known.

    x: the point. z: multipliers of equations, shape (E,), or slacks and multipliers of bounds as a
        Barrier, of the solution of a similar problem; None if they are unknown.
    """

    x: X
    z: Z | None = None
