"""Where pairs of shapes come near each other along a motion."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import InstantBatch
from hovi.discrete.state import State
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.clearance.clearance_violation import wanted_values
from hovi.planning.clearance.distances import Distances
from hovi.planning.clearance.fast_obstacles import FastPairs
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

SAMPLES = 32
"""Samples per interval at which distances are looked at."""
SPREAD = 4
"""Positions per interval that a near pair has rows at."""
CLOSER, PASSES = 9, 4
"""Samples around a least distance, and how many times they are taken, each time more closely."""
CLOSE = 2e-3
"""Distance beyond the least one below which a pair has a row where it is nearest, in [m]."""
SPACING, WIDE_SPACING = 0.01, 0.1
"""Distance of positions up to which one row is enough, relative to the interval, and the same while
the motion moves from step to step."""
LEAST_SPACING = 1e-4
"""Distance of positions up to which one row is enough, relative to the interval, where a pair is
too close by more than the extra clearance leaves."""
EXTRA_CLEARANCE = 5e-4
"""Clearance in rows beyond the margin, in DISTANCE_SCALE: 0.05 mm for the motion between."""
USED = 0.7 * EXTRA_CLEARANCE * DISTANCE_SCALE
"""What a motion may use up of the extra clearance between rows, in [m]."""
TOUCHING, AROUND, SHALLOW = 3e-4, 0.3, 0.01
"""Distance beyond the least one, in [m], below which a least distance gets rows around it, which
then hold a motion that slides along an obstacle; how far from it, relative to the interval, and the
largest distance beyond the least one of these rows, in [m]."""
DIP = 0.8 * USED
"""How far a motion may dip between rows around a least distance, in [m]."""
CLOSEST, WIDEST = 0.02, 0.25
"""The least and the largest distance between rows around a least distance, relative to the
interval."""
BEND_SAMPLES, LEAST_BEND = SAMPLES // 8, 1e-9
"""Number of samples between those from which the curvature of a distance is taken, and its least
value, in [m] per interval squared."""


@dataclass(frozen=True, eq=False)
class Approaches:
    """Pairs near each other at positions of a motion.

    at: number of the interval plus the position in it. pairs: their numbers. too_close: whether
    they are by more than the extra clearance of rows leaves. All of shape (C,).
    nearest: the least distance of any pair, in [m]; infinite if it is not known.
    spacing: distance of positions up to which one row is enough, relative to the interval.
    """

    at: Array
    pairs: Index
    too_close: Mask
    nearest: float = np.inf
    spacing: float = SPACING

    def other_than(self, at: Array, pairs: Index) -> Approaches:
        """Those that are not at given positions of the same pairs, (E,) each."""
        kept = np.ones(len(self.at), dtype=bool)
        enough = np.where(self.too_close, LEAST_SPACING, self.spacing)
        for pair in np.intersect1d(self.pairs, pairs):
            own = np.flatnonzero(self.pairs == pair)
            known = at[pairs == pair]
            apart = np.abs(self.at[own, None] - known).min(axis=1)
            kept[own] = apart > enough[own]
        some = self.at[kept], self.pairs[kept], self.too_close[kept]
        return Approaches(*some, self.nearest, self.spacing)


def configurations(problem: TrajectoryProblem, path: DiscretePath, batch: InstantBatch) -> Array:
    """q at instants, (M, nq)."""
    q, x = path.q[batch.numbers], batch.displacements(path)
    coordinates = problem.coordinates
    if coordinates.vector_joints:  # several times in every step, so without checks of shapes
        return q + x
    return np.asarray(coordinates.integrate(q, x))


def spread(problem: TrajectoryProblem, number: int) -> InstantBatch:
    """A number of instants spread evenly over every interval, and the end of the motion."""
    N = problem.grid.intervals
    k, s = np.repeat(np.arange(N), number), np.tile(np.arange(number) / number, N)
    k, s = np.append(k, N - 1), np.append(s, 1.0)
    return InstantBatch(problem.grid, k, s, np.ones(len(k)))


def free_ones(problem: TrajectoryProblem, number: int) -> Mask:
    """Which of so many instants along a motion are not at an end, or a seam, that is given.

    number: of as many in every interval, and one at the end.
    """
    free = np.ones(number, dtype=bool)
    each = (number - 1) // problem.grid.intervals
    free[[hold.node * each for hold in problem.holds if hold.fixed[0].all()]] = False
    free[0], free[-1] = (not isinstance(end, State) for end in (problem.start, problem.goal))
    return free


def approaches_along(
    problem: TrajectoryProblem,
    path: DiscretePath,
    distances: Distances,
    least: float,
    ahead: float,
) -> Approaches:
    """Where rows are needed: spread over the times at which pairs are near, and least distances.

    least: bound of the rows, in [m]. ahead: distance beyond it up to which pairs are near.
    """
    batch = spread(problem, SAMPLES)
    q = distances.at(configurations(problem, path, batch), batch.t)
    reach = least + max(ahead, 0.0) + 0.5 * DISTANCE_SCALE
    d = distances.values(q, reach)  # (M, K)
    pairs = np.flatnonzero(d.min(axis=0) < least + max(ahead, CLOSE))  # nearer between samples
    d = d[:, pairs]
    chosen = (np.arange(len(d)) % (SAMPLES // SPREAD) == 0) & free_ones(problem, len(d))
    rows, columns = np.nonzero(chosen[:, None] & (d < least + ahead) & ~_allowed(d, least))
    lowest = _refined(problem, path, distances.restricted(pairs.tolist()), d, least + CLOSE)
    fast = _fast(problem, path, distances, batch, q, least + CLOSE)
    wanted = ~_allowed(lowest[2], least)
    at = np.concatenate([rows / SAMPLES, lowest[0][wanted]])
    too_close = np.append(np.zeros(len(rows), dtype=bool), lowest[2][wanted] < least)
    nearest = float(d[free_ones(problem, len(d))].min(initial=np.inf))
    touching = wanted & (lowest[2] < least + TOUCHING)
    more = _around(lowest[0][touching], lowest[1][touching], d, least + SHALLOW)
    at, too_close = np.append(at, more[0]), np.append(too_close, np.zeros(len(more[0]), dtype=bool))
    columns = np.concatenate([columns, lowest[1][wanted], more[1]])
    at, numbers = np.append(at, fast[0]), np.append(pairs[columns], fast[1])
    return Approaches(at, numbers, np.append(too_close, fast[2] < least), nearest)


def _fast(
    problem: TrajectoryProblem,
    path: DiscretePath,
    distances: Distances,
    batch: InstantBatch,
    q: Array,
    below: float,
) -> tuple[Array, Index, Array]:
    """Where obstacles that move fast come near between samples: positions, pairs and distances.

    q: configurations at the samples, with times.
    """
    nq = problem.coordinates.nq
    fast = FastPairs.of(distances, batch.t, q[:, :nq])
    if fast is None:
        return np.zeros(0), np.zeros(0, dtype=np.intp), np.zeros(0)
    some, grid = distances.restricted(fast.numbers.tolist()), problem.grid

    def measure(t: Array, column: Index) -> Array:
        k = np.clip(np.searchsorted(grid.t, t, side="right") - 1, 0, grid.intervals - 1)
        s = np.clip((t - grid.t[k]) / grid.steps[k], 0.0, 1.0)
        at = configurations(problem, path, InstantBatch(grid, k, s, np.ones(len(k))))
        return wanted_values(some, some.at(at, t), column)

    found = fast.between(some.values(q), below, measure).apart(below)
    k = np.clip(np.searchsorted(grid.t, found.t, side="right") - 1, 0, grid.intervals - 1)
    return k + (found.t - grid.t[k]) / grid.steps[k], fast.numbers[found.column], found.value


def _around(at: Array, columns: Index, d: Array, below: float) -> tuple[Array, Index]:
    """Positions around least distances, between which the motion dips by no more than DIP.

    By the curvature of sampled distances. at, columns: where these are, and of which pairs.
    d: sampled distances, (M, K). below: the largest distance there, in [m].
    """
    positions, numbers = [np.zeros(0)], [np.zeros(0, dtype=np.intp)]
    samples, apart = np.arange(len(d)) / SAMPLES, BEND_SAMPLES
    for t, column in zip(at, columns, strict=True):
        j = int(np.clip(np.rint(t * SAMPLES), apart, len(d) - 1 - apart))
        before, here, after = d[j - apart, column], d[j, column], d[j + apart, column]
        bend = max((before - 2.0 * here + after) * (SAMPLES / apart) ** 2, LEAST_BEND)
        step = float(np.clip(np.sqrt(8.0 * DIP / bend), CLOSEST, WIDEST))
        steps = step * np.arange(1, int(AROUND / step) + 1)
        around = np.concatenate([t - steps, t + steps])
        inside = (around > CLOSEST) & (around < samples[-1] - CLOSEST)
        around = around[inside & (np.interp(around, samples, d[:, column]) < below)]
        positions.append(around)
        numbers.append(np.full(len(around), column))
    return np.concatenate(positions), np.concatenate(numbers)


def _allowed(d: Array, least: float) -> Mask:
    """Where distances are below the least one of rows, but by no more than USED; shape of d.

    A row there would begin outside its bound without need.
    """
    return (d < least) & (d >= least - USED)


def _refined(
    problem: TrajectoryProblem, path: DiscretePath, distances: Distances, d: Array, below: float
) -> tuple[Array, Index, Array]:
    """As `_minima`, by closer samples around each: distances may have kinks there."""
    at, column, value = _minima(d, below)
    width, chosen = 1.0 / SAMPLES, np.arange(len(at))
    for _ in range(PASSES if len(at) else 0):
        around = at[:, None] + width * np.linspace(-1.0, 1.0, CLOSER)
        around = np.clip(around, 0.0, float(problem.grid.intervals))
        k = np.minimum(around.astype(np.intp), problem.grid.intervals - 1).ravel()
        batch = InstantBatch(problem.grid, k, around.ravel() - k, np.ones(len(k)))
        wanted = np.zeros((len(k), len(distances.pairs)), dtype=bool)
        own = np.repeat(column, CLOSER)
        wanted[np.arange(len(k)), own] = True
        q = distances.at(configurations(problem, path, batch), batch.t)
        near = distances.values(q, np.inf, wanted)[np.arange(len(k)), own].reshape(-1, CLOSER)
        best = near.argmin(axis=1)
        at, value = around[chosen, best], near[chosen, best]
        width *= 2.0 / (CLOSER - 1)
    return at, column, value


def spread_approaches(d: Array, watched: Mask, least: float, guard: float) -> Approaches:
    """Where pairs are near by their distances at spread positions, (M, K).

    watched: of these, those without rows. guard: distance beyond the least one, in [m].
    """
    rows, columns = np.nonzero(watched & (d < least + guard) & ~_allowed(d, least))
    at, pairs, value = _minima(d, least + CLOSE, SPREAD)
    wanted = ~_allowed(value, least)
    at, pairs = at[wanted], pairs[wanted]
    at, pairs = np.append(rows / SPREAD, at), np.append(columns, pairs)
    return Approaches(at, pairs, np.zeros(len(at), dtype=bool), spacing=WIDE_SPACING)


def _minima(d: Array, below: float, samples: int = SAMPLES) -> tuple[Array, Index, Array]:
    """Local minima of sampled distances (M, K) below a bound, by parabolas through three samples.

    Returns where they are, of which columns, and the distances. samples: per interval.
    """
    before, here, after = d[:-2], d[1:-1], d[2:]
    some = (here <= before) & (here <= after)
    bend = before - 2.0 * here + after
    shift = np.where(bend > 0, 0.5 * (before - after) / np.where(bend > 0, bend, 1.0), 0.0)
    value = here - 0.25 * (before - after) * shift
    j, column = np.nonzero(some & (value < below))
    return (j + 1 + shift[j, column]) / samples, column, value[j, column]
