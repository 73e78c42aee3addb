"""Seams: nodes where the segments of a motion meet, and what the goals of segments fix there."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Curve, Ends, joined, named_curve
from hovi.discrete.interval_paths import path_of_order, regularized_nodes
from hovi.planning.conditions.condition import Equation, equation
from hovi.planning.problem.goals import Via, goal_state, via_differences
from hovi.planning.problem.limits import Limits
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Seam(Via):
    """The end of a segment: a goal on the way, at rest unless its velocity is given or free.

    What it prescribes of joints are no equations with multipliers, as those of a via point, but no
    unknowns, as at the ends of a motion. For joints with nq = nv, which segments have.

    unreachable: why there is no such motion, or "".
    """

    unreachable: str = ""


@dataclass(frozen=True, eq=False)
class Hold:
    """What is fixed at a node, and what an initial guess has there.

    node: its index. time: in [s]. q, v: shape (nv,). fixed: which of their components are no
    unknowns, shape (2, nv).
    """

    node: int
    time: float
    q: Array
    v: Array
    fixed: Mask


@dataclass(frozen=True, eq=False)
class ViaPoints:
    """What the via points of a problem ask for.

    equations: at nodes. holds: of seams, by ascending time. reason: why one of them
    cannot be reached, or "".
    """

    equations: tuple[Equation, ...]
    holds: tuple[Hold, ...]
    reason: str

    @classmethod
    def of(
        cls,
        via: Sequence[Via],
        grid: Grid,
        coordinates: Coordinates,
        near: Array,
        limits: Limits | None,
    ) -> Self:
        """Those of a motion on a grid.

        near: the first seed of inverse kinematics, shape (nq,); that of a seam is the configuration
            at the last one.
        """
        equations: list[Equation] = []
        holds: list[Hold] = []
        reason = ""
        for each in sorted(via, key=lambda each: isinstance(each, Seam) * each.time):
            name, node = f"via point at {each.time:g} s", grid.node_at(each.time)
            seed = holds[-1].q if holds else near
            bounds = None if limits is None else limits.until(each.time)
            reached = goal_state(each.goal, name, coordinates, seed, bounds)
            wanted = via_differences(each, reached, coordinates)
            if isinstance(each, Seam):
                wanted = reached.differences
                fixed = ~reached.state.free_on(coordinates, "via")
                holds.append(Hold(node, each.time, *reached.state.on(coordinates, "via"), fixed))
            equations += [equation(each, node, float(grid.t[node])) for each in wanted]
            reason = reason or getattr(each, "unreachable", "") or reached.reason
        return cls(tuple(equations), tuple(holds), reason)


def holding(path: DiscretePath, grid: Grid, holds: Sequence[Hold]) -> DiscretePath:
    """The path with what is fixed at its nodes, for joints with nq = nv."""
    if not holds:
        return path
    change = np.zeros((grid.intervals + 1, grid.order, path.v.shape[1]))
    for each in holds:
        known = each.q - path.q[each.node], each.v - path.v[each.node]
        change[each.node, :2] = np.where(each.fixed, known, 0.0)
    if not change.any():
        return path
    q, rates = path.q + change[:, 0], path.rates + change[:, 1:]
    z = path.z + regularized_nodes(change, grid.steps)
    for each in holds:  # to the last digit
        q[each.node] = np.where(each.fixed[0], each.q, q[each.node])
        rates[each.node, 0] = np.where(each.fixed[1], each.v, rates[each.node, 0])
    return path_of_order(grid.order, q, rates, z, path.inner, grid.steps)


def curve_through(
    name: str, coordinates: Coordinates, ends: Ends, duration: float, holds: Sequence[Hold]
) -> Curve:
    """The initial guess with a name between all neighbouring seams and ends.

    A free velocity at a seam is the mean one of the motion between its neighbours, and zero where
    it would reverse. For orders other than 2 the Hermite polynomials between them.
    duration: T, in [s].
    """
    times = np.array([0.0, *(each.time for each in holds), duration])
    nodes = np.zeros((len(times), len(ends), coordinates.nv))
    nodes[[0, -1]] = np.stack(ends, axis=1)
    for node, each in zip(nodes[1:-1], holds, strict=True):
        node[:2] = each.q, each.v
    slopes = np.diff(nodes[:, 0], axis=0) / np.diff(times)[:, None]
    mean = (nodes[2:, 0] - nodes[:-2, 0]) / (times[2:] - times[:-2])[:, None]
    mean[slopes[1:] * slopes[:-1] <= 0] = 0.0
    free = ~np.array([each.fixed[1] for each in holds])
    nodes[1:-1, 1][free] = mean[free]
    pieces = []
    for (one, other), T in zip(pairwise(nodes), np.diff(times), strict=True):
        pieces.append(named_curve(name, coordinates, [*np.stack([one, other], axis=1)], T))
    return joined(pieces, times[:-1])
