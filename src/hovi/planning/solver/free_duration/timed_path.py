"""A path with the lengths of its free parts, and steps of both."""

from __future__ import annotations

import copy

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.interval_paths import regularized_nodes
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

# called at each step
_new_grid = without_checks(Grid)
_new_lagrangian = without_checks(DiscreteLagrangian)
_new_path = without_checks(DiscretePath)


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A path and the lengths L of its free parts, in [s], whose steps keep their proportions."""

    path: DiscretePath
    lengths: Array


def stretched_problem(
    problem: TrajectoryProblem, clock: Clock, now: Array, lengths: Array
) -> TrajectoryProblem:
    """The problem for other lengths of its free parts, for the steps of solvers: it is not checked.

    Only the discrete Lagrangian is that of the new lengths, and the parts in which limits and
    conditions hold: times of via points and seams stay those of the old ones, and no solver reads
    them. The structure of the Hessian depends on the proportions of the steps alone.
    """
    if np.array_equal(lengths, now):
        return problem
    steps = problem.grid.steps * clock.ratios(problem.grid, now, lengths)
    lagrangian = clock.lagrangian(problem.ld.lagrangian, now, lengths)
    ld = _new_lagrangian(lagrangian, _new_grid(steps, problem.grid.schemes))
    stretched = copy.copy(problem)
    object.__setattr__(stretched, "ld", ld)
    if problem.limits is not None and problem.limits.parts:
        moved_limits = clock.limits(problem.limits, now, lengths)
        object.__setattr__(stretched, "limits", moved_limits)
    if any(each.during for each in problem.conditions):
        for name in ("conditions", "along"):
            moved = clock.conditions(getattr(problem, name), now, lengths)
            object.__setattr__(stretched, name, moved)
    for name in ("torque_moments", "finer", "inertial_torque", "structure"):
        stretched.__dict__.pop(name, None)
    if clock.whole:  # the proportions stay
        object.__setattr__(stretched, "structure", problem.structure)
    return stretched


def stretched_path(
    path: DiscretePath, grid: Grid, clock: Clock, now: Array, lengths: Array
) -> DiscretePath:
    """The same curve, its free parts run through in other times.

    Velocities at the ends of the motion change, too; those at nodes where a part begins or ends
    between others stay, which changes the curve next to them. grid: of the path. now: the lengths
    of its parts, in [s].
    """
    k, ratios = path.order, clock.ratios(grid, now, lengths)
    nodes = clock.nodes(grid, now)
    powers = ratios[:, None] ** np.arange(1.0, max(k, 2))
    at_nodes = np.concatenate([powers, powers[-1:]])
    inner = nodes[(nodes > 0) & (nodes < grid.intervals)]
    at_nodes[inner] = 1.0
    rates = path.v[:, None] if k == 1 else path.rates
    z = path.z / (ratios**k)[:, None, None]
    for first, last in nodes:
        kept = np.zeros((last - first + 1, k, rates.shape[2]))
        for node, interval in ((first, first), (last, last - 1)):
            if node in inner:
                kept[node - first, 1:] = rates[node] * (1.0 - 1.0 / powers[interval, :, None])
        if kept.any():
            part = slice(first, last)
            z[part] += regularized_nodes(kept, (grid.steps * ratios)[part])
    rates = rates / at_nodes[:, :, None]
    modes = path.inner / (ratios**k)[:, None, None]
    return _new_path(path.q, rates[:, 0], z, modes, rates[:, 1:] if k > 2 else path.higher)


def kept_columns(
    problem: TrajectoryProblem, path: DiscretePath, clock: Clock, lengths: Array
) -> tuple[Array, Array]:
    """What is kept of q, q', ... where free parts begin and end as their lengths L change.

    With the columns h^j q^(j) of an interval fixed, q^(j) changes with log L as h does; what is
    kept has columns with the derivative j h^j q^(j) instead. That is all at a node between others,
    and what is fixed at an end of the motion.
    Returns j h^j q^(j) where it is kept, else 0, and j of those that are unknowns, else 0, shape
    (N, m, n) each.
    """
    grid, k, j = problem.grid, problem.ld.k, np.arange(problem.ld.k)
    kept = np.zeros((grid.intervals, problem.ld.columns, path.v.shape[1]))
    unknown = np.zeros_like(kept)
    for ends in clock.nodes(grid, lengths):
        for side, node in enumerate(ends):
            interval, columns = node - side, slice(side * k, side * k + k)
            held = np.zeros((k, kept.shape[2]))
            held[1:] = path.rates[node]
            held *= (j * grid.steps[interval] ** j)[:, None]
            if 0 < node < grid.intervals:
                unknown[interval, columns] = j[:, None]
            else:
                held[problem.free_ends[side]] = 0.0
            kept[interval, columns] = held
    return kept, unknown
