"""Seams: nodes where the segments of a motion meet, and what the goals of segments fix there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Equation, equation
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import Curve, Ends, joined, named_curve, with_ends_of_nodes
from hovi.discrete.interval_paths import path_of_order, regularized_nodes
from hovi.discrete.state import State
from hovi.planning.problem.goals import (
    Via,
    goal_state,
    require_times,
    turning,
    via_differences,
)
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.goal_turns import keeping_turns, turns_to
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Seam(Via):
    """The end of a segment: a goal on the way, at rest unless its velocity is given or free.

    What it prescribes of joints are no equations with multipliers, as those of a via point, but no
    unknowns, as at the ends of a motion.

    unreachable: why there is no such motion, or "".
    higher: (q'', ..., q^(k-1)) there, shape (k - 2, nv), where cycles meet; free if None.
    """

    unreachable: str = ""
    higher: Array | None = None
    takes_turns: ClassVar[bool] = True
    takes_regions: ClassVar[bool] = True


@dataclass(frozen=True, eq=False)
class Hold:
    """What is fixed at a node, and what an initial guess has there.

    node: its index. time: in [s]. q: shape (nq,). v: shape (nv,). fixed: which of their components
    are no unknowns, those of q in the tangent space, shape (2, nv). goal: of the seam, or the state
    at which a frame reaches it. turns: full turns of the guess since the last seam, or the start,
    beyond the shortest way: see `State.turns_on`. start: q with all full turns made until then.
    higher: further derivatives that are fixed, (k - 2, nv); none if None.
    """

    node: int
    time: float
    q: Array
    v: Array
    fixed: Mask
    goal: State
    turns: Array
    start: State
    higher: Array | None = None

    def configuration(self, q: Array, on: Coordinates) -> Array:
        """q, (nq,), with what is fixed of it, to the last digit."""
        free = ~self.fixed[0]
        known = on.integrate(self.q, np.where(free, on.difference(self.q, q), 0.0))
        entries, coordinates = on.space.plain
        same = entries[free[coordinates]]
        known[same] = q[same]
        return known


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
        start: State,
        limits: Limits | None,
        free: Sequence[str] = (),
    ) -> Self:
        """Those of a motion on a grid.

        start: whose configuration is the first seed of inverse kinematics; that of a seam is the
            configuration at the last one. free: joints that are free where a frame has its goal.
        """
        equations: list[Equation] = []
        holds: list[Hold] = []
        reason, last, q0 = "", start, start.on(coordinates, "start")[0]
        require_times(via)
        for each in sorted(via, key=lambda each: isinstance(each, Seam) * each.time):
            name, node = f"via point at {each.time:g} s", grid.node_at(each.time)
            bounds = None if limits is None else limits.until(each.time)
            reached = goal_state(each.goal, name, coordinates, q0, bounds, free)
            wanted = via_differences(reached, coordinates, bounds)
            if isinstance(each, Seam):
                wanted, goal = reached.differences, reached.state
                fixed, (q, v) = ~goal.free_on(coordinates, "via"), goal.on(coordinates, "via")
                fixed[1] |= turning(q, fixed[0], coordinates, bounds)
                turns = turns_to(goal, last, coordinates, q0, q)
                last, q0 = keeping_turns(last, coordinates, q0, q, turns), q
                holds.append(Hold(node, each.time, q, v, fixed, goal, turns, last, each.higher))
            equations += [equation(each, node, float(grid.t[node])) for each in wanted]
            reason = reason or getattr(each, "unreachable", "") or reached.reason
        return cls(tuple(equations), tuple(holds), reason)


def holding(path: DiscretePath, grid: Grid, holds: Sequence[Hold], on: Coordinates) -> DiscretePath:
    """The path with what is fixed at its nodes."""
    q, rates, k = path.q.copy(), path.rates.copy(), grid.order
    for each in holds:
        q[each.node] = each.configuration(path.q[each.node], on)
        rates[each.node, 0] = np.where(each.fixed[1], each.v, rates[each.node, 0])
        if each.higher is not None:
            rates[each.node, 1:] = each.higher
    change = np.concatenate([on.difference(path.q, q)[:, None], rates - path.rates], axis=1)
    if not change.any():
        return path
    z = path.z + regularized_nodes(change, grid.steps)
    held = path_of_order(k, q, rates, z, path.inner, grid.steps, on.curved_space)
    return with_ends_of_nodes(held, grid, on) if k == 2 else held


def curve_through(
    name: str,
    coordinates: Coordinates,
    ends: Ends,
    duration: float,
    holds: Sequence[Hold],
    turns: Array,
) -> Curve:
    """The initial guess with a name between all neighbouring seams and ends.

    A free velocity at a seam is the mean one of the motion between its neighbours, and zero where
    it would reverse. For orders other than 2 the Hermite polynomials between them.
    duration: T, in [s]. turns: full turns after the last seam, as `Hold.turns` before it.
    """
    times = np.array([0.0, *(each.time for each in holds), duration])
    q = np.stack([ends[0][0], *(each.q for each in holds), ends[0][1]])
    rates = np.zeros((len(q), len(ends) - 1, coordinates.nv))
    rates[[0, -1]] = np.stack(ends[1:], axis=1)
    rates[1:-1, 0] = [each.v for each in holds]
    for number, each in enumerate(holds, start=1):
        rates[number, 1:] = 0.0 if each.higher is None else each.higher
    around = np.stack([*(each.turns for each in holds), turns])
    way = coordinates.difference(q[:-1], q[1:]) + 2 * np.pi * around
    slopes = way / np.diff(times)[:, None]
    mean = (way[1:] + way[:-1]) / (times[2:] - times[:-2])[:, None]
    mean[slopes[1:] * slopes[:-1] <= 0] = 0.0
    free = ~np.array([each.fixed[1] for each in holds])
    rates[1:-1, 0][free] = mean[free]
    pieces = []
    for i, T in enumerate(np.diff(times)):
        both = slice(i, i + 2)
        jets = [q[both], *np.moveaxis(rates[both], 1, 0)]
        pieces.append(named_curve(name, coordinates, jets, T, around[i]))
    return joined(pieces, times[:-1])
