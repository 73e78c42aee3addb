"""Equations along a motion at the nodes of a grid: their values, and for level 0 their rates.

What is given at a node, or asked there already, may imply some of these rows. They are left out,
since multipliers of rows that depend on each other are not unique: those whose gradient in what is
free there is a combination of the others'. Where all is given, it has to satisfy the equation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.planning.conditions.condition import (
    Condition,
    Equation,
    EquationAlong,
    linear_at,
    rate_of,
)
from hovi.planning.conditions.excess import in_words
from hovi.planning.conditions.function import STATE, Curvature, Function, Points, Slopes, at_state
from hovi.planning.conditions.places import AtNode
from hovi.planning.conditions.sets import Equal
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

INDEPENDENT = 1e-6
"""Least part of a row, relative to the row, that is no combination of others."""


@dataclass(frozen=True, eq=False)
class NodeState:
    """What is given at a node.

    name: of the node, in messages. q, v: there, (nq,) and (nv,), or a guess of what is free.
    free: which components of q, in the tangent space, and of v are free, (2, nv).
    """

    name: str
    q: Array
    v: Array
    free: Mask

    def at(self, where: AtNode) -> Points:
        """The state at a node."""
        return at_state(self.q, self.v, where.time)


@dataclass(frozen=True, eq=False)
class NodeValues(Function):
    """Some of the values of a function and of its rates, these times a step in [s]."""

    of: Function
    rate: Function | None
    step: float
    rows: npt.NDArray[np.intp]

    @classmethod
    def of_equation(cls, each: EquationAlong, grid: Grid) -> NodeValues:
        """All rows of an equation, with the mean step of a grid."""
        rate = rate_of(each.y) if each.where.level == 0 else None
        rows = np.arange(each.y.size * (1 if rate is None else 2))
        return cls(each.y, rate, grid.duration / grid.intervals, rows)

    def wanted(self, each: EquationAlong) -> Equal:
        """The values of an equation, and zero for their rates."""
        every = np.zeros(self.all_rows)
        every[: self.of.size] = np.asarray(each.on.value)
        return Equal(every[self.rows])

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.of.needs if self.rate is None else self.of.needs | self.rate.needs

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.rows)

    @property
    def all_rows(self) -> int:
        """Number of rows that there are."""
        return self.of.size * (1 if self.rate is None else 2)

    def values(self, at: Points) -> Array:
        """See Function."""
        y = self.of.values(at)
        if self.rate is not None:
            y = np.concatenate([y, self.step * self.rate.values(at)], axis=1)
        return y[:, self.rows]

    def slopes(self, at: Points) -> Slopes:
        """See Function."""
        own = self.of.slopes(at)
        rate = {} if self.rate is None else self.rate.slopes(at)
        found, none = dict[str, Array](), np.zeros((len(at.q), self.of.size, at.v.shape[1]))
        for name in (x for x in STATE if x in own or x in rate):
            J = own.get(name, none)
            if self.rate is not None:
                J = np.concatenate([J, self.step * rate.get(name, none)], axis=1)
            found[name] = J[:, self.rows]
        return found

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """See Function."""
        every = np.zeros((len(at.q), self.all_rows))
        every[:, self.rows] = weights
        found = dict(self.of.curvature(at, every[:, : self.of.size]))
        if self.rate is not None:
            more = self.rate.curvature(at, self.step * every[:, self.of.size :])
            for pair, block in more.items():
                found[pair] = found[pair] + block if pair in found else block
        return found


def equations_at_nodes(
    along: Sequence[EquationAlong],
    grid: Grid,
    given: Mapping[int, NodeState],
    others: Sequence[Equation],
) -> Iterator[Equation]:
    """The equations along a motion at the nodes of its grid, without what is implied there.

    given: what is, by the number of the node; nodes at which others ask for something are among
    them. others: equations that are asked at nodes already.
    """
    for each in along:
        if each.where.level > 1:
            continue
        values = NodeValues.of_equation(each, grid)
        on = values.wanted(each)
        for node, time in enumerate(grid.t.tolist()):
            where, own, wanted, state = AtNode(node, time), values, on, given.get(node)
            if state is not None:
                asked = [x for x in others if x.where.node == node]
                own = replace(values, rows=_independent(values, where, state, asked))
                wanted = own.wanted(each)
            if own.size > 0:
                equation = Condition(own, wanted, where, each.name)
                others = others if state is None else [*others, equation]
                yield equation


def missed_where_given(
    along: Sequence[EquationAlong],
    grid: Grid,
    given: Mapping[int, NodeState],
    others: Sequence[Equation],
) -> str:
    """Which equation is violated where all is given, a sentence without its end; "" if none is.

    Also what is implied by others that are asked at a node, and violated where these hold.
    Arguments as of `equations_at_nodes`.
    """
    for each in along:
        if each.where.level > 1:
            continue
        values = NodeValues.of_equation(each, grid)
        for node, state in given.items():
            where = AtNode(node, float(grid.t[node]))
            asked = [x for x in others if x.where.node == node]
            missed = [x.on.missed(x.y.values(state.at(where))[0]) for x in asked]
            if any(np.abs(x).max(initial=0.0) > each.tolerance for x in missed):
                continue  # a guess that does not satisfy them
            kept = _independent(values, where, state, asked)
            over = np.abs(values.wanted(each).missed(values.values(state.at(where))[0]))
            over[kept] = 0.0
            entry = int(np.argmax(over))
            if over[entry] <= each.tolerance:
                continue
            name, size = in_words(each, entry % each.y.size), over[entry]
            if entry < each.y.size:
                return (
                    f"{name} is missed by {size:.3g} at {state.name}, where a motion cannot change "
                    f"that: change {state.name}"
                )
            return (
                f"{name} changes by {size / values.step:.3g} per second at {state.name}, where it "
                "should stay: change the velocity there"
            )
    return ""


def _independent(
    values: NodeValues, where: AtNode, state: NodeState, asked: Sequence[Equation]
) -> npt.NDArray[np.intp]:
    """The rows whose gradients in what is free are no combinations of others'."""
    every = Condition(values, Equal(), where)
    rows = np.concatenate([linear_at(each, state.q, state.v)[1] for each in (*asked, every)])
    columns = rows * [[1.0], [1.0 / values.step]]
    chosen = independent_rows(columns.reshape(len(rows), -1), state.free.ravel())
    first = len(rows) - values.size
    return chosen[chosen >= first] - first


def independent_rows(rows: Array, free: Mask) -> npt.NDArray[np.intp]:
    """The rows of a matrix (E, m) that are no combinations of those before, in free columns."""
    basis, found = np.zeros((0, rows.shape[1])), []
    for number, row in enumerate(rows):
        rest = np.where(free, row, 0.0)
        for _ in range(2):  # twice is enough for orthogonality to rounding
            rest = rest - basis.T @ (basis @ rest)
        left = float(np.linalg.norm(rest))
        if left > INDEPENDENT * float(np.linalg.norm(row)):
            basis = np.vstack([basis, rest / left])
            found.append(number)
    return np.array(found, dtype=np.intp)
