"""Subproblems: a motion in segments, divided at the seams at which q and v are given.

For Lagrangians of order 2 the action and all bounds are sums over these subproblems, which are
independent of each other. For order 3 the accelerations at the seams couple them, and so do the
configurations at goals of frames, for which a subproblem takes those of the guess.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import Periodic, State
from hovi.planning.conditions.asked import times_of
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.seams import Hold
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.segmented_lagrangian import SegmentedLagrangian
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Subproblem:
    """The part of a motion between two nodes, as a problem of its own.

    first, last: its nodes in the whole. problem: with its time from 0.
    """

    first: int
    last: int
    problem: TrajectoryProblem

    def path(self, whole: DiscretePath) -> DiscretePath:
        """The part of a path of the whole, with its ends as they are given."""
        nodes, own = slice(self.first, self.last + 1), slice(self.first, self.last)
        inner = whole.inner[own, : self.problem.grid.inner_modes]
        higher = whole.higher[nodes] if whole.higher.size else whole.higher
        part = DiscretePath(whole.q[nodes], whole.v[nodes], whole.z[own], inner, higher)
        return self.problem.moved(part)


def subproblems_of(problem: TrajectoryProblem) -> list[Subproblem]:
    """The subproblems between seams whose velocities are given; none where there are no such seams.

    From one seam's configuration, or that of the guess where a frame has a goal, to the next one's;
    for order 3 without acceleration there.
    """
    distances, of = problem.distances, problem.ld.lagrangian
    held = {each.node: each for each in problem.holds if each.fixed[1].all()}
    asked = problem.conditions
    timed = any(each.timed for each in _segments_of(of)) or any(each.timed for each in asked)
    timed = timed or bool(times_of(asked))
    moving = distances is not None and bool(distances.paths)
    if not held or timed or moving or isinstance(problem.goal, Periodic):
        return []
    nodes = [0, *sorted(held), problem.grid.intervals]
    return [Subproblem(a, b, _between(problem, held, a, b)) for a, b in pairwise(nodes)]


def joined(subproblems: Sequence[Subproblem], paths: Sequence[DiscretePath]) -> DiscretePath:
    """The paths of all subproblems, one after the other."""
    modes = max(path.inner.shape[1] for path in paths)
    inner = [np.pad(x.inner, ((0, 0), (0, modes - x.inner.shape[1]), (0, 0))) for x in paths]

    def at_nodes(name: str) -> Array:
        parts = [getattr(path, name) for path in paths]
        return np.concatenate([*(part[:-1] for part in parts[:-1]), parts[-1]])

    higher = at_nodes("higher") if paths[0].higher.size else paths[0].higher
    z = np.concatenate([path.z for path in paths])
    return DiscretePath(at_nodes("q"), at_nodes("v"), z, np.concatenate(inner), higher)


def _between(
    problem: TrajectoryProblem, held: dict[int, Hold], first: int, last: int
) -> TrajectoryProblem:
    """The problem between two nodes."""
    whole = problem.grid
    grid = Grid(whole.steps[first:last], whole.schemes[first:last])
    begin, end = float(whole.t[first]), float(whole.t[last])
    ld = DiscreteLagrangian(problem.ld.lagrangian.within(begin, end), grid)
    start = problem.start
    if first in held:
        start = dataclasses.replace(held[first].start, v=held[first].v)
    goal = State(held[last].q, held[last].v) if last in held else problem.goal
    via = tuple(
        dataclasses.replace(each, time=each.time - begin)
        for each in problem.via
        if first < whole.node_at(each.time) < last
    )
    limits = None if problem.limits is None else problem.limits.within(begin, end)
    asked = problem.conditions
    return TrajectoryProblem(ld, start, goal, limits, via, problem.clearance, conditions=asked)


def _segments_of(of: Lagrangian) -> Sequence[Lagrangian]:
    return of.lagrangians if isinstance(of, SegmentedLagrangian) else (of,)
