"""Equations along a motion at the nodes of a grid: their values, and for level 0 their rates.

What is given at a node, or asked there already, may imply some of these rows. They are left out,
since multipliers of rows that depend on each other are not unique: those whose gradient in what is
free there is a combination of the others'. A row that is left out has to hold where the others do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import (
    TOLERANCE,
    Condition,
    Equation,
    EquationAlong,
    linear_at,
)
from hovi.conditions.excess import in_words
from hovi.conditions.function import Curvature, Function, Points, Slopes, at_state
from hovi.conditions.places import AtNode
from hovi.conditions.sets import Equal
from hovi.discrete.grid import Grid
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

MOST_RATE = 27.0 / 4.0
"""Rate times step at which a cubic between a node and the next one deviates by 1."""
INDEPENDENT = 1e-6
"""Least part of a row, relative to the row, that is no combination of others."""


@dataclass(frozen=True, eq=False)
class NodeState:
    """What is given at a node.

    name: of the node, in messages; "" where nothing is known. q, v: there, (nq,) and (nv,); what is
        free has some value.
    free: which components of q, in the tangent space, and of v are free, (2, nv).
    """

    name: str
    q: Array
    v: Array
    free: Mask


@dataclass(frozen=True, eq=False)
class Rows(Function):
    """Some rows of a function. factors: by which they are multiplied, (K,). rows: their numbers."""

    of: Function
    factors: Array
    rows: Index

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.of.needs

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.rows)

    def values(self, at: Points) -> Array:
        """See Function."""
        return np.asarray(self.factors * self.of.values(at)[:, self.rows])

    def slopes(self, at: Points) -> Slopes:
        """See Function."""
        factors = self.factors[:, None]
        return {x: factors * J[:, self.rows] for x, J in self.of.slopes(at).items()}

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """See Function."""
        every = np.zeros((len(at.q), self.of.size))
        every[:, self.rows] = self.factors * weights
        return self.of.curvature(at, every)

    def describe(self, at: Points, missed: Array) -> str:
        """See Function."""
        sizes = np.abs(missed) / self.factors
        entry = int(np.argmax(np.abs(missed)))
        which = f"its entry {self.rows[entry]}" if self.of.size > 1 else "it"
        return f"{which} misses it by {sizes[entry]:.3g}"


def equations_at_nodes(
    along: Sequence[EquationAlong],
    grid: Grid,
    given: Mapping[int, NodeState],
    others: Sequence[Equation],
    sizes: Sequence[Array],
) -> tuple[list[Equation], str]:
    """The equations along a motion at the nodes of its grid, without what is implied there.

    Also which of them is violated, whatever the motion, a sentence without its end; "" if none is.

    given: what is, by the number of the node; nodes at which others ask for something are among
    them. others: equations that are asked at nodes already. sizes: see `sizes_of`.
    """
    found, reason, step = list[Equation](), "", grid.duration / grid.intervals
    asked = {node: [each for each in others if each.where.node == node] for node in given}
    rows = {node: _rows_of(asked[node], state, step) for node, state in given.items()}
    satisfied = {node: _holds(asked[node], state) for node, state in given.items()}
    known = zip(along, sizes, strict=True)
    for part in (part for each, size in known for part in _parts(each, size, step)):
        for node, time in _nodes_of(part.given, grid):
            where, state = AtNode(node, time), given.get(node)
            if state is None:
                found.append(part.at(where))
                continue
            before, own = rows[node], _rows_of([part.at(where)], state, step)
            every = np.concatenate([before, own])
            chosen = independent_rows(every, state.free.ravel())
            kept = chosen[chosen >= len(before)] - len(before)
            rows[node] = np.concatenate([before, own[kept]])
            if len(kept) > 0:
                found.append(part.some(kept).at(where))
            if satisfied[node]:
                left = np.setdiff1d(part.rows.rows, kept)
                reason = reason or part.some(left).violated(where, state)
    return found, reason


def _nodes_of(given: EquationAlong, grid: Grid) -> list[tuple[int, float]]:
    """The nodes of a grid at which an equation holds, and their times."""
    holds = np.pad(given.holds_in(grid), 1)
    return [(i, t) for i, t in enumerate(grid.t.tolist()) if holds[i] or holds[i + 1]]


@dataclass(frozen=True, eq=False)
class _Part:
    """The values of an equation at nodes, or its rates. step: of the grid, in [s]."""

    given: EquationAlong
    rows: Rows
    wanted: Equal
    rate: bool
    step: float

    def at(self, where: AtNode) -> Equation:
        """The equation at a node."""
        return Condition(self.rows, self.wanted, where, self.given.name)

    def some(self, chosen: Index) -> _Part:
        """Some of its rows."""
        rows = replace(self.rows, rows=chosen, factors=self.rows.factors[chosen])
        return replace(self, rows=rows, wanted=Equal(np.asarray(self.wanted.value)[chosen]))

    def violated(self, where: AtNode, state: NodeState) -> str:
        """What of it is violated at a state, whatever is free there; "" if nothing is."""
        if self.rows.size == 0:
            return ""
        missed = np.abs(_missed(self.at(where), state)) / self.rows.factors
        worst = int(np.argmax(missed))  # what is no number comes first
        name, size = in_words(self.given, int(self.rows.rows[worst])), missed[worst]
        if size * (self.step / MOST_RATE if self.rate else 1.0) <= self.given.tolerance:
            return ""
        if np.isnan(size):
            return f"{name} has no value at {state.name}: change {state.name}"
        if self.rate:
            return (
                f"{name} changes by {size:.3g} per second at {state.name}, where it should stay: "
                "change the velocity there"
            )
        return (
            f"{name} is missed by {size:.3g} at {state.name}, where a motion cannot change that: "
            f"change {state.name} or the value"
        )


def _parts(each: EquationAlong, size: Array, step: float) -> list[_Part]:
    """What is asked at nodes: values below level 2, rates of level 0."""
    y, level, every = each.y, each.where.level, np.arange(each.y.size)
    value = size * np.asarray(each.on.value, dtype=float)
    parts = list[_Part]()
    if level < 2:
        values = Rows(y, step**level * size, every)
        parts.append(_Part(each, values, Equal(step**level * value), False, step))
    if level == 0:
        rates = Rows(y.rate, step * size, every)
        parts.append(_Part(each, rates, Equal(np.zeros(y.size)), True, step))
    return parts


def sizes_of(each: EquationAlong, jets: Sequence[Array], times: Array) -> Array:
    """Factors of an equation by which its rows are of one size, whatever the unit of y, (size,).

    They are 1 over its largest derivative in q^(l) at some instants. jets: q, v and a there.
    """
    q, v, a = jets
    level = "q", "v", "a"
    J = np.abs(each.y.slopes(Points(q, v, times, a))[level[each.where.level]])
    largest = np.nan_to_num(J.max(axis=(0, 2)), posinf=0.0)
    return np.where(largest > 0.0, 1.0 / np.where(largest > 0.0, largest, 1.0), 1.0)


def _missed(each: Equation, state: NodeState) -> Array:
    """By how much a state misses an equation, shape (size,)."""
    return each.on.missed(each.y.values(at_state(state.q, state.v, each.where.time))[0])


def _rows_of(equations: Sequence[Equation], state: NodeState, step: float) -> Array:
    """Their gradients in (q, step v) at a state, (E, 2 nv)."""
    size = 2 * state.free.shape[1]
    slopes = (linear_at(each, state.q, state.v)[1] for each in equations)
    scaled = [(J / np.array([[1.0], [step]])).reshape(-1, size) for J in slopes]
    return np.concatenate([np.zeros((0, size)), *scaled])


def _holds(equations: Sequence[Equation], state: NodeState) -> bool:
    """Whether a node is known, and what is asked there already holds."""
    near = (np.abs(_missed(each, state)).max() <= TOLERANCE for each in equations)
    return bool(state.name) and all(near)


def independent_rows(rows: Array, free: Mask) -> Index:
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
