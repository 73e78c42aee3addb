"""A condition: the values of a function, in a set, at some instants of a motion."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.planning.conditions.function import Function, at_state, bend, linear
from hovi.planning.conditions.places import AtNode, Where
from hovi.planning.conditions.sets import Between, Equal
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Values = TypeVar("Values", bound=Equal | Between, covariant=True)
Place = TypeVar("Place", bound=Where, covariant=True)


@dataclass(frozen=True, eq=False)
class Condition(Generic[Values, Place]):
    """y(q, v, a, tau, t) in a set, at instants of a motion.

    function: y. on: the set. where: the instants.
    """

    function: Function
    on: Values
    where: Place


Equation = Condition[Equal, AtNode]
"""c(q, v) = value at a node."""


def equation(function: Function, node: int, time: float) -> Equation:
    """c(q, v) = 0 at a node, and the time there in [s]."""
    return Condition(function, Equal(), AtNode(node, time))


def residual(each: Equation, x: DiscretePath) -> Array:
    """c - value at a path, shape (k,)."""
    return linear_at(each, *each.where.state(x))[0]


def linear_at(each: Equation, q: Array, v: Array) -> tuple[Array, Array]:
    """c - value at a state, shape (k,), and its Jacobian in (q, v), shape (k, 2, nv)."""
    c, J = linear(each.function, q, v, each.where.time)
    return each.on.missed(c), J


def bend_at(each: Equation, q: Array, v: Array, weights: Array) -> Array:
    """sum_i weights_i d2 c_i at a state, shape (2, nv, 2, nv)."""
    return bend(each.function, q, v, weights, each.where.time)


def describe(each: Equation, x: DiscretePath) -> str:
    """By how much an equation is missed at a path, as a clause."""
    at = at_state(*each.where.state(x), each.where.time)
    return each.function.describe(at, residual(each, x))


def is_spurious(each: Equation, x: DiscretePath) -> bool:
    """Whether an equation holds at a path at a root where what is meant does not."""
    return each.function.is_spurious(at_state(*each.where.state(x), each.where.time))
