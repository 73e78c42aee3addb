"""By how much a motion exceeds the bounds of a condition, between the quadrature points, too."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition, scales
from hovi.conditions.function import Points
from hovi.conditions.joint_quantity import JointQuantity
from hovi.conditions.narrow import (
    NO_BOUND,
    PEAK_FRACTION,
    NarrowCells,
    TorqueCells,
    features_of,
)
from hovi.conditions.sets import Between, TwoSided
from hovi.discrete.cells import INSTANTS, Cells
from hovi.discrete.trajectory import Trajectory
from hovi.dynamics.torque_rate import TorqueRate
from hovi.system.deadline import raise_if_late

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

SAMPLES = 33
"""Samples per interval in the first pass, both ends included."""
POSITIONS = (1.0 - np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))) / 2
"""Their positions, closer at both ends, where polynomials of high degree oscillate faster."""
REFINED_SAMPLES = 25
"""Samples of each further pass, between the neighbours of an extreme sample."""
BATCH = 128
"""Extremes that are refined at once."""
REFINEMENT_FRACTION = 0.05
"""The largest extreme of an entry in an interval is refined if it is closer than this to a bound,
as a fraction of its scale."""
COARSE_MODES = 4
"""Largest number of inner modes of grids on which `excess_of` looks at fewer samples first."""
COARSE = 4, 2
"""Stride of the samples that `excess_of` looks at first: on grids of at most COARSE_MODES inner
modes, and on others."""


Excess = tuple[Array, Array]
"""The largest excess over lower and upper bounds in each interval, and its position there."""


def excess_along(motion: Trajectory, given: Condition[TwoSided, Any]) -> Array:
    """The largest excess over the lower and upper bounds in every interval, (2, N, size).

    As a fraction of the scale; negative inside.
    Every interval is sampled, and again more densely around all extremes that are near a bound, and
    wherever the curvature of the samples allows an excess between them: a motion along a bound has
    several extremes, and the largest one is not always next to the largest sample.
    """
    return largest_excess(motion, given)[0]


def excess_of(motion: Trajectory, given: Condition[TwoSided, Any]) -> Array:
    """As `excess_along` wherever that may be positive.

    Elsewhere that of a few samples, which are further from their bounds than neighbors differ.
    """
    raise_if_late()
    N, grid = motion.grid.intervals, motion.grid
    s = POSITIONS[:: COARSE[int(grid.inner_modes > COARSE_MODES)]]
    over = _over(motion, given, np.repeat(np.arange(N), len(s)), np.tile(s, N))
    over = over.reshape(2, N, len(s), -1)
    sides = over.max(axis=2)
    change = np.abs(np.diff(over, axis=2)).max(axis=2)
    safe = sides + change <= -REFINEMENT_FRACTION  # false where it is no number
    near = np.flatnonzero(~safe.all(axis=(0, 2)))
    if len(near) > 0:
        sides[:, near] = _excess_in(Cells.of(N, 1).chosen(near), motion, given)[0]
    return _with_narrow((sides, np.zeros_like(sides)), motion, given)[0]


def nearest_to_bounds(motion: Trajectory, given: Condition[TwoSided, Any]) -> tuple[float, float]:
    """The least distance of a condition from its bounds, as a fraction of the scale, and when.

    Negative beyond a bound. The time in [s].
    """
    excess, _, k, s, _ = _worst_place(motion, given)
    return -excess, float(motion.t[k] + s * motion.grid.steps[k])


def worst(motion: Trajectory, given: Condition[TwoSided, Any]) -> tuple[float, str]:
    """The largest excess as a fraction of the scale, and the value, time and bound in words."""
    excess, side, k, s, entry = _worst_place(motion, given)
    y, low, high, t = _values(motion, given, np.array([k]), np.array([s]))
    value, bound = given.shown_apart(y[0, entry], (low, high)[side][0, entry])
    named = given.y.named(entry)
    subject, unit = named or (in_words(given, entry), given.unit)
    return excess, (
        f"{subject} reaches {value}{unit and f' {unit}'} at t = {t[0]:.3g} s, its "
        f"{'limit' if named else 'bound'} is {bound}"
    )


def _worst_place(
    motion: Trajectory, given: Condition[TwoSided, Any]
) -> tuple[float, int, int, float, int]:
    """The largest excess, its side, its interval and position there, and its entry."""
    sides, at = largest_excess(motion, given)
    side, k, entry = map(int, np.unravel_index(int(np.argmax(sides)), sides.shape))
    return float(sides[side, k, entry]), side, k, float(at[side, k, entry]), entry


def undecided(motion: Trajectory, given: Condition[Between, Any]) -> str:
    """What of a condition was looked at by samples alone, a sentence; "" if nothing."""
    name, sampled = f"Condition {given.name!r}", features_of(given).sampled
    if _narrow(motion, given).unresolved:
        return (
            f"{name} changes in too many places to look at all: between them its bounds may be "
            "exceeded."
        )
    if not sampled:
        return ""
    return (
        f"{name} was looked at at {INSTANTS:,} instants, as {sampled} cannot be bounded between "
        "them: narrower features may be missed."
    )


def in_words(given: Condition[Any, Any], entry: int) -> str:
    """A condition and the entry of its function, in a sentence."""
    if given.of:
        return f"condition {given.name!r} of {given.of[entry]!r}"
    return f"condition {given.name!r}" + (f" of entry {entry}" if given.y.size > 1 else "")


def _values(
    motion: Trajectory, given: Condition[TwoSided, Any], k: Index, s: Array
) -> tuple[Array, Array, Array, Array]:
    """y and its bounds at relative positions s in intervals k, (M, size) each, and the times."""
    at, t = _points(motion, k, s, given.y.needs), motion.t
    return given.y.values(at), *given.on.at(at.t, given.y.size, t[k + 1] / 2 + t[k] / 2), at.t


def _over(motion: Trajectory, given: Condition[TwoSided, Any], k: Index, s: Array) -> Array:
    """low - y and y - high over the scale at relative positions s in intervals k, (2, M, size)."""
    y, low, high, _ = _values(motion, given, k, s)
    over = np.maximum(np.stack([low - y, y - high]) / scales(given), -NO_BOUND)
    if given.during is not None:
        over[:, ~given.holds_in(motion.grid)[k]] = -NO_BOUND
    return over


def _points(motion: Trajectory, k: Index, s: Array, needs: frozenset[str]) -> Points:
    """What is needed of a motion at relative positions s in intervals k."""
    tau = jerk = rate = None
    if "jerk" in needs or "torque_rate" in needs:
        q, v, a, jerk = motion.jet_intervals(k, s, 3)
    elif "tau" in needs:
        q, v, a, tau = motion.sample_intervals(k, s)
    else:
        q, v, a = motion.jet_intervals(k, s)
    if "torque_rate" in needs:
        rate = np.zeros_like(v)  # as it is not known without a scene
    if "torque_rate" in needs and jerk is not None and motion.scene is not None:
        rate = TorqueRate(motion.scene.torques, q, v, a, jerk, motion.space).value()
    return Points(q, v, motion.t[k] + s * motion.grid.steps[k], a, tau, jerk, rate)


def _narrow(motion: Trajectory, given: Condition[Between, Any]) -> NarrowCells:
    def over(k: Index, s: Array) -> Array:
        return np.concatenate(_over(motion, given, k, s), axis=1)

    def points(k: Index, s: Array) -> Points:
        return _points(motion, k, s, given.y.needs)

    return NarrowCells(given, motion.grid, over, points)


def _torque_cells(motion: Trajectory, given: Condition[TwoSided, Any]) -> Cells:
    def over(k: Index, s: Array) -> Array:
        return np.concatenate(_over(motion, given, k, s), axis=1)

    limited = isinstance(given.y, JointQuantity)
    joints = given.y.joints if isinstance(given.y, JointQuantity) else np.zeros(0, dtype=np.intp)
    return TorqueCells(motion, over, joints, scales(given) if limited else np.ones(0)).cells


def largest_excess(motion: Trajectory, given: Condition[TwoSided, Any]) -> Excess:
    """`excess_along`, and the position of each in its interval, (2, N, size)."""
    cells, here = Cells.of(motion.grid.intervals, 1), given.holds_in(motion.grid)
    if here.all() or not here.any():
        return _with_narrow(_excess_in(cells, motion, given), motion, given)
    sides, at = (
        np.full((2, len(here), given.y.size), -NO_BOUND),
        np.zeros((2, len(here), given.y.size)),
    )
    sides[:, here], at[:, here] = _excess_in(cells.chosen(here), motion, given)
    return _with_narrow((sides, at), motion, given)


def _with_narrow(found: Excess, motion: Trajectory, given: Condition[TwoSided, Any]) -> Excess:
    """The same, and what is exceeded in narrow cells: of torques, and of a user's functions."""
    cells = Cells.of(1, 1).chosen(np.zeros(0, dtype=np.intp))
    if "tau" in given.y.needs:
        cells = _torque_cells(motion, given)
    if isinstance(given.on, Between):
        cells = cells.joined(_narrow(motion, cast(Condition[Between, Any], given)).cells)
    if len(cells) == 0:
        return found
    (inside, s), (sides, at) = _excess_in(cells, motion, given), found
    for side, cell, entry in np.argwhere(inside > sides[:, cells.interval]):
        place, over = (side, cells.interval[cell], entry), inside[side, cell, entry]
        if over > sides[place]:
            sides[place], at[place] = over, cells.position(cell, s[side, cell, entry])
    return sides, at


def _excess_in(cells: Cells, motion: Trajectory, given: Condition[TwoSided, Any]) -> Excess:
    """In cells, with positions in these, (2, P, size) each."""
    raise_if_late()
    P = len(cells)
    k, s = np.repeat(np.arange(P), SAMPLES), np.tile(POSITIONS, P)
    over = _over(motion, given, cells.interval[k], cells.position(k, s))
    over = over.reshape(2, P, SAMPLES, -1)
    index = np.argmax(over, axis=2)
    largest = np.take_along_axis(over, index[:, :, None], axis=2)[:, :, 0]
    at = POSITIONS[index]
    extremes = np.argwhere(_near_extremes(over, largest) | _may_exceed(over, given.tolerance))
    for first in range(0, len(extremes), BATCH):  # in batches, since a deadline may be in force
        raise_if_late()
        side, k, sample, entry = extremes[first : first + BATCH].T
        found, s = _refined(motion, given, cells.chosen(k), side, sample, entry)
        for i in np.argsort(found):  # the largest of each cell and entry comes last
            place = side[i], k[i], entry[i]
            if found[i] >= largest[place]:
                largest[place], at[place] = found[i], s[i]
    return largest, at


def _refined(
    motion: Trajectory,
    given: Condition[TwoSided, Any],
    cells: Cells,
    side: Index,
    sample: Index,
    entry: Index,
) -> tuple[Array, Array]:
    """The excess at M extremes and their positions, from three denser samplings around them.

    cells: of each. side: 0 for lower bounds, 1 for upper ones. sample: the extreme samples.
    entry: of the function. All (M,).
    """
    rows = np.arange(len(cells))
    every = np.repeat(rows, REFINED_SAMPLES)
    begin = POSITIONS[np.maximum(sample - 1, 0)]
    end = POSITIONS[np.minimum(sample + 1, SAMPLES - 1)]
    for _ in range(3):
        step = (end - begin) / (REFINED_SAMPLES - 1)
        around = np.minimum(begin[:, None] + step[:, None] * np.arange(REFINED_SAMPLES), 1.0)
        s = cells.position(every, around.ravel())
        over = _over(motion, given, cells.interval[every], s)
        excess = over.reshape(2, len(rows), REFINED_SAMPLES, -1)[side, rows, :, entry]
        best = np.argmax(excess, axis=1)
        at = around[rows, best]
        begin, end = np.maximum(at - step, 0.0), np.minimum(at + step, 1.0)
    return excess[rows, best], at


def _near_extremes(excess: Array, largest: Array) -> npt.NDArray[np.bool_]:
    """Samples that are local extremes, and are the largest of their entry or next to its bound.

    excess: of the samples, shape (2, P, SAMPLES, K). largest: of each cell, (2, P, K).
    """
    padded = np.pad(excess, ((0, 0), (0, 0), (1, 1), (0, 0)), constant_values=-np.inf)
    with np.errstate(invalid="ignore"):
        peak = (excess >= padded[:, :, :-2]) & (excess >= padded[:, :, 2:])
    highest = (excess == largest[:, :, None]) & (excess > -REFINEMENT_FRACTION)
    return np.asarray(peak & np.isfinite(excess) & (highest | (excess > -PEAK_FRACTION)))


def _may_exceed(excess: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    """Samples next to which a parabola through three of them may exceed a bound.

    excess: of the samples, shape (2, P, SAMPLES, K). tolerance: of an excess.
    """
    with np.errstate(invalid="ignore"):
        bend = np.abs(np.diff(excess, 2, axis=2))
        bend = np.concatenate([bend[:, :, :1], bend, bend[:, :, -1:]], axis=2)
        return np.asarray(excess + 0.5 * bend > tolerance) & np.isfinite(excess)
