"""Multipliers of control points, as forces at instants of the motion."""

from __future__ import annotations

import copy
import dataclasses
from functools import cache
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.instants import Instants
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.lagrangian import PointTerms
from hovi.schemes.control_points import control_degree, control_nodes
from hovi.schemes.interval_curve import jet_rows

if TYPE_CHECKING:
    from hovi.planning.solver.limits.limit_rows import LimitRows, RowsAtNodes

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_AT_INSTANTS: WeakKeyDictionary[DiscreteLagrangian, DiscreteLagrangian] = WeakKeyDictionary()
"""The last discrete Lagrangian with further instants of each one, with what it has computed."""


def forces_of(
    problem: TrajectoryProblem, rows: LimitRows, multipliers: Array
) -> tuple[Instants | None, list[PointTerms]]:
    """The multipliers of control points as forces on (q, v, ...) at instants of every interval.

    multipliers: of the rows, shape (E,). The terms follow those at the quadrature points, one per
    batch of instants: see `by_segment`.
    """
    if rows.size == 0:
        return None, []
    grid, nv = problem.grid, problem.coordinates.nv
    nodes = control_nodes(control_degree(grid.order, grid.inner_modes, 0))
    slope = np.zeros((grid.intervals, grid.order + 1, nv, len(nodes)))
    forces = rows.weights * multipliers / rows.of.ranges[rows.coordinate]
    if rows.at_nodes is None:
        rows.at_nodes = _at_nodes(rows)
    for order, own, intervals, joints, values in rows.at_nodes:
        sums = np.zeros((grid.intervals, len(nodes), nv))
        native.pull_rows(intervals, joints, values, forces[own], sums)
        slope[:, order] = sums.transpose(0, 2, 1)
    instants = rows.instants
    force = slope.transpose(0, 3, 1, 2).reshape(len(instants.weights), -1)
    force = force / instants.weights[:, None]
    outputs = np.zeros((len(force), 0))
    return instants, [PointTerms(force, np.zeros_like(force), outputs, np.zeros_like(outputs))]


def joined(
    instants: Instants | None,
    terms: list[PointTerms],
    others: Instants,
    more: list[PointTerms],
) -> tuple[Instants, list[PointTerms]]:
    """Forces at instants and at others, one batch each, as one batch."""
    if instants is None:
        return others, more
    k = np.append(instants.intervals, others.intervals)
    s = np.append(instants.positions, others.positions)
    weights = np.append(instants.weights, others.weights)
    both = terms[0], more[0]
    jet = np.concatenate([each.jet_gradient for each in both])
    output = np.concatenate([each.output_gradient for each in both])
    order = np.lexsort((s, k))
    jet, output = jet[order], output[order]
    joint = PointTerms(jet, np.zeros_like(jet), output, np.zeros_like(output))
    if more[0].time_gradient is not None:
        rates = np.append(np.zeros(len(instants)), more[0].time_gradient)[order]
        joint = dataclasses.replace(joint, time_gradient=rates)
    return Instants(k[order], s[order], weights[order]), [joint]


def by_segment(
    problem: TrajectoryProblem, instants: Instants | None, terms: list[PointTerms]
) -> list[PointTerms]:
    """Forces at instants as one batch, as those of each segment of a motion."""
    segments = problem.ld.segments
    if instants is None or segments is None:
        return terms
    of = segments[instants.intervals]
    return [_chosen(terms[0], of == each) for each in np.unique(of)]


def _chosen(terms: PointTerms, here: Mask) -> PointTerms:
    """The terms at some of the points."""
    given = {each.name: getattr(terms, each.name) for each in dataclasses.fields(terms)}
    known = {name: x[here] for name, x in given.items() if x is not None}
    return PointTerms(**known)


def _at_nodes(rows: LimitRows) -> list[RowsAtNodes]:
    """The rows of every order as sums of values at the nodes of `forces_of`."""
    found = []
    for order in map(int, np.unique(rows.orders)):
        own = np.flatnonzero(rows.orders == order)
        values = _values_in(rows.table[own], rows.grid, order)
        found.append((order, own, rows.intervals[own], rows.joints[own], values))
    return found


def _values_in(table: Array, grid: Grid, order: int) -> Array:
    """Rows of h^j q^(j), or q, over (h q0', ..., Z, c) as sums of its values at nodes, (E, M)."""
    inverse = _inverse_values(grid.order, grid.inner_modes, order)
    if order == 0:  # rows of q have a fraction of 1 in q0
        return np.asarray(table @ inverse[1:] + inverse[0])
    return np.asarray(table @ inverse)


@cache
def _inverse_values(k: int, modes: int, order: int) -> Array:
    """(h q0', ..., Z, c), after q0 for order 0, from the values of h^j q^(j) at the nodes."""
    nodes = control_nodes(control_degree(k, modes, 0))
    values = jet_rows(nodes, k, modes)[:, order]
    if order == 0:
        values = np.pad(values, ((0, 0), (1, 0)), constant_values=1.0)
    return np.asarray(np.linalg.pinv(values))


def at_instants(problem: TrajectoryProblem, instants: Instants | None) -> TrajectoryProblem:
    """The same problem, with further instants in its discrete Lagrangian; none for None."""
    if instants is problem.ld.instants:
        return problem
    whole = copy.copy(problem)  # nothing else depends on them
    known = _AT_INSTANTS.get(problem.ld)
    if known is None or known.instants is not instants:
        known = DiscreteLagrangian(problem.ld.lagrangian, problem.grid, instants)
        _AT_INSTANTS[problem.ld] = known
    object.__setattr__(whole, "ld", known)
    return whole
