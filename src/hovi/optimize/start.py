"""Where a minimisation begins."""

from __future__ import annotations

from typing import Generic, TypeVar

from hovi.system.dataclass import dataclass

X = TypeVar("X")
Z = TypeVar("Z")


@dataclass(frozen=True, eq=False)
class Start(Generic[X, Z]):
    """A first point, with the multipliers there if they are known.

    x: the point. z: slacks and multipliers of bounds as a Barrier, of the solution of a similar
        problem; None if they are unknown. Of a motion on a grid: the central path of a similar
        problem on the same intervals.
    mu: barrier parameter at which a central path is begun, relative to the mean density of the
        objective; None to infer it from how far the ends have moved.
    near: whether the point is near a solution.
    """

    x: X
    z: Z | None = None
    mu: float | None = None
    near: bool = False
