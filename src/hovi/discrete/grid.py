"""The grid of a discrete motion, and the discrete path on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, unchecked
from hovi.checks.shapes import require_shape
from hovi.errors import InputError
from hovi.schemes import Scheme, galerkin
from hovi.schemes.galerkin_table import MAX_INNER_MODES
from hovi.system.dataclass import dataclass
from hovi.system.summary import Summarized, Summary

Array = npt.NDArray[np.float64]

MAX_INTERVALS = 10**7
"""Maximum number of intervals, also of a trajectory file."""
MORE_MODES = 2
"""Additional inner modes of the finer grid that error estimates compare with. With one more, both
costs may have nearly the same error, which their difference would not show."""
MIN_STEP, MAX_STEP = 1e-12, 1e9
"""Steps, in [s], whose powers do not overflow or underflow in double precision."""


@check_arguments
@dataclass(frozen=True, eq=False, repr=False)
class Grid(Summarized):
    """Intervals of time, each with its own length and scheme.

    steps: lengths of the intervals, shape (N,), in [s].
    schemes: one per interval.
    groups: each scheme with the numbers of its intervals.
    """

    steps: Array
    schemes: tuple[Scheme, ...] = field(repr=False)
    groups: tuple[tuple[Scheme, npt.NDArray[np.intp]], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        steps = np.array(self.steps, dtype=np.float64)
        if steps.ndim != 1 or len(steps) == 0 or len(steps) != len(self.schemes):
            raise InputError(
                f"a grid needs one step and one scheme per interval and at least one interval, "
                f"got {steps.size} steps and {len(self.schemes)} schemes."
            )
        if not (np.isfinite(steps).all() and (steps > 0).all()):
            raise InputError("every step of a grid must be positive and finite.")
        if steps.min() < MIN_STEP or steps.max() > MAX_STEP:
            raise InputError(
                f"the steps of a grid must lie between {MIN_STEP:g} and {MAX_STEP:g} s, but these "
                f"range from {steps.min():.3g} to {steps.max():.3g} s: change the duration or the "
                "number of intervals."
            )
        steps.setflags(write=False)
        object.__setattr__(self, "steps", steps)
        object.__setattr__(self, "groups", _groups(self.schemes))
        orders = sorted({scheme.derivatives for scheme, _ in self.groups})
        if len(orders) > 1:
            raise InputError(
                f"the schemes of a grid must be for Lagrangians of one order, got {orders}."
            )

    @classmethod
    def uniform(cls, duration: float, intervals: int, scheme: Scheme) -> Grid:
        """N intervals of equal length T/N with one scheme.

        duration: T > 0 in [s]. intervals: N >= 1. Raises InputError otherwise.
        """
        if not (np.isfinite(duration) and duration > 0):
            raise InputError(f"the duration must be positive and finite, got {duration} s.")
        if not 1 <= intervals <= MAX_INTERVALS:
            raise InputError(
                f"the number of intervals must be from 1 to {MAX_INTERVALS:,}, got {intervals}."
            )
        return cls(np.full(intervals, duration / intervals), (scheme,) * intervals)

    @classmethod
    def joined(cls, grids: Sequence[Grid]) -> Grid:
        """The intervals of several grids, one after the other.

        Raises InputError for no grid, and for schemes for Lagrangians of different orders.
        """
        if len(grids) == 0:
            raise InputError("there is nothing to join: give one or more grids.")
        schemes = tuple(scheme for grid in grids for scheme in grid.schemes)
        return cls(np.concatenate([grid.steps for grid in grids]), schemes)

    def equals(self, other: Grid) -> bool:
        """Whether another grid has the same steps and the same schemes."""
        return np.array_equal(self.steps, other.steps) and self.schemes == other.schemes

    def stretched(self, duration: float) -> Grid:
        """The grid with all steps scaled to another duration.

        duration: T > 0 in [s]. Raises InputError for steps that are too short or too long.
        """
        return Grid(self.steps * (duration / self.duration), self.schemes)

    def halved(self, chosen: npt.NDArray[np.bool_] | None = None) -> Grid:
        """The grid with the chosen intervals bisected.

        chosen: shape (N,); all of them if None.
        """
        if chosen is None:
            chosen = np.ones(self.intervals, dtype=bool)
        require_shape("chosen", chosen, self.intervals)
        parts = np.where(chosen, 2, 1)
        schemes = [s for s, count in zip(self.schemes, parts, strict=True) for _ in range(count)]
        return Grid(np.repeat(self.steps / parts, parts), tuple(schemes))

    def split_at(self, nodes: Array) -> Grid:
        """The grid with further nodes inside its intervals.

        nodes: those of this grid and others, ascending, in [s].
        """
        if len(nodes) == len(self.t):
            return self
        middle = 0.5 * (nodes[:-1] + nodes[1:])
        of = np.clip(np.searchsorted(self.t, middle) - 1, 0, self.intervals - 1)
        return Grid(np.diff(nodes), tuple(self.schemes[k] for k in of))

    def enriched(self, modes: int) -> Grid:
        """The same intervals with `modes` additional inner modes and points each.

        Raises InputError if an interval would have too many.
        """
        if self.inner_modes + modes > MAX_INNER_MODES:
            raise InputError(
                f"errors are estimated for schemes of up to {MAX_INNER_MODES - modes} inner "
                f"modes, not {self.inner_modes}; use more intervals instead."
            )
        tables = {id(s): _enriched(s, modes) for s in set(self.schemes)}
        return Grid(self.steps, tuple(tables[id(s)] for s in self.schemes))

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.steps)

    @cached_property
    def t(self) -> Array:
        """Times of the nodes, shape (N + 1,), in [s]."""
        t: Array = np.arange(self.intervals + 1) * self.steps[0]
        if np.ptp(self.steps) > 0:
            t = np.concatenate([[0.0], np.cumsum(self.steps)])
        t.setflags(write=False)
        return t

    @cached_property
    def duration(self) -> float:
        """T, in [s]."""
        return float(self.t[-1])

    def _summary(self) -> Summary:
        return Summary(f"Grid: {self.duration:g} s, {self.in_words}")

    @property
    def in_words(self) -> str:
        """The number of intervals, and the schemes."""
        names = ", ".join(dict.fromkeys(scheme.name for scheme, _ in self.groups))
        return f"{self.intervals} {'interval' if self.intervals == 1 else 'intervals'} of {names}"

    @unchecked
    def require_path(self, path: DiscretePath, nq: int, nv: int) -> None:
        """Raise InputError unless a path has the order, intervals and inner modes of this grid.

        More inner modes are accepted, too. nq, nv: lengths of its configurations and velocities.
        """
        N, r, k = len(self.steps), self.inner_modes, self.order
        inner = path.inner.shape
        modes = max(r, inner[1]) if len(inner) == 3 else r
        shapes = (N + 1, nq), (N + 1, nv), (N, k, nv), (N, modes, nv)
        known = path.q.shape, path.v.shape, path.z.shape, inner
        if known == shapes and (k <= 2 or path.higher.shape == (N + 1, k - 2, nv)):
            return
        for name, shape, array in zip(("q", "v", "z", "inner"), shapes, path.arrays, strict=True):
            if array.shape != shape:
                raise InputError(
                    f"the path's {name} must have shape {shape} on this grid of {N} intervals with "
                    f"{r} inner modes, got {array.shape}."
                )
        raise InputError(
            f"the path's higher derivatives must have shape {(N + 1, k - 2, nv)} for schemes of "
            f"order {k}, got {path.higher.shape}."
        )

    def node_at(self, time: float) -> int:
        """The index of the inner node at a time, in [s]. Raises InputError if there is none."""
        k = int(np.argmin(np.abs(self.t - time)))
        if not 0 < k < self.intervals or abs(self.t[k] - time) > 1e-9 * self.duration:
            raise InputError(
                f"there is no node inside the motion at {time:g} s, as a via point needs; the "
                f"nearest is at {self.t[k]:g} s of {self.duration:g} s."
            )
        return k

    def with_nodes(self, times: Sequence[float], halved: bool = False) -> Grid:
        """The grid with the nearest inner nodes moved to given times, in [s], ascending.

        The intervals between two moved nodes keep the proportions of their lengths.
        halved: whether intervals are halved until there are enough of them.
        Raises InputError if the grid has too few nodes.
        """
        nodes, times = self.t, list(dict.fromkeys(times))
        if not times:
            return self
        if len(times) >= self.intervals:
            if halved:
                return self.halved().with_nodes(times, halved)
            raise InputError(
                f"{len(times)} times between the ends of a motion need {len(times) + 1} intervals "
                f"or more, got {self.intervals}."
            )
        fixed = [0]
        for rest, time in zip(range(len(times), 0, -1), times, strict=True):
            if not 0 < time < self.duration:
                raise InputError(outside_motion(time, self.duration))
            nearest = np.argmin(np.abs(nodes - time))
            fixed.append(int(np.clip(nearest, fixed[-1] + 1, self.intervals - rest)))
        targets = [0.0, *times, self.duration]
        t = np.interp(nodes, nodes[[*fixed, self.intervals]], targets)
        return Grid(np.diff(t), self.schemes)

    @cached_property
    def order(self) -> int:
        """k, the order of the Lagrangians that the schemes discretise."""
        return self.groups[0][0].derivatives

    @cached_property
    def inner_modes(self) -> int:
        """The largest number of inner modes of an interval."""
        return max(scheme.inner_modes for scheme, _ in self.groups)

    @property
    def scheme_range(self) -> str:
        """Name of the scheme, or of those with the fewest and the most inner modes."""
        schemes = sorted((scheme.inner_modes, scheme.name) for scheme, _ in self.groups)
        return " to ".join(dict.fromkeys((schemes[0][1], schemes[-1][1])))


def _enriched(scheme: Scheme, modes: int) -> Scheme:
    """The Galerkin table with more modes, and as many points besides as the scheme has."""
    r, k = scheme.inner_modes + modes, scheme.derivatives
    return galerkin(r, k, points=max(r + k, len(scheme.points) + modes))


def _groups(schemes: tuple[Scheme, ...]) -> tuple[tuple[Scheme, npt.NDArray[np.intp]], ...]:
    """The intervals of each scheme, for evaluation in batches."""
    members: dict[bytes, list[int]] = {}
    tables: dict[bytes, Scheme] = {}
    keys: dict[int, bytes] = {}
    for i, scheme in enumerate(schemes):
        key = keys.get(id(scheme))
        if key is None:
            key = keys[id(scheme)] = scheme.key
            tables.setdefault(key, scheme)
            members.setdefault(key, [])
        members[key].append(i)
    return tuple((tables[key], np.array(index)) for key, index in members.items())


@check_arguments
@dataclass(frozen=True, eq=False, repr=False)
class DiscretePath(Summarized):
    """The coordinates of a discrete motion on a grid, for a Lagrangian of order k.

    The regularized coordinates, for k = 2 z0 = (q1 - q0 - h v0)/h^2 and z1 = (v1 - v0)/h, are
    stored, since recomputing them from q and v loses 12 eps q/h^2 or more. For any k
    z_j = (q1^(j) - sum_{i >= j} h^(i-j) q0^(i) / (i-j)!) / h^(k-j), j < k.
    [ColomboFerraroMartin2016, section 2]

    q: nodes, shape (N + 1, nq), in [rad] or [m].
    v: velocities at the nodes, shape (N + 1, nv), per [s]. For k = 1, where they are no unknowns
        and may jump, limits from the right, and at the end from the left.
    z: regularized coordinates of the intervals, shape (N, k, nv), per [s^k].
    inner: inner modes c/h^k, shape (N, r, nv), per [s^k]; 0 where an interval has fewer.
    higher: derivatives q'', ..., q^(k-1) at the nodes, shape (N + 1, k - 2, nv); none for k <= 2.
    Compiled code reads them as contiguous arrays; `Grid.require_path` checks their shapes.
    """

    q: Array
    v: Array
    z: Array
    inner: Array
    higher: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def __post_init__(self) -> None:
        for name in ("q", "v", "z", "inner", "higher"):
            array = getattr(self, name)
            if not array.flags.c_contiguous:
                object.__setattr__(self, name, np.ascontiguousarray(array))

    def _summary(self) -> Summary:
        (nodes, nq), nv = self.q.shape, self.v.shape[1]
        return Summary(f"DiscretePath: {nodes} nodes, nq = {nq}, nv = {nv}, order {self.order}")

    @property
    def order(self) -> int:
        """k."""
        return int(self.z.shape[1])

    @property
    def rates(self) -> Array:
        """q', ..., q^(k-1) at the nodes, shape (N + 1, k - 1, nv)."""
        if self.order <= 2:
            return self.v[:, None][:, : self.order - 1]
        return np.concatenate([self.v[:, None], self.higher], axis=1)

    @property
    def nodes(self) -> Array:
        """(q, q', ..., q^(k-1)) at the nodes, on a vector space, shape (N + 1, k, nv)."""
        return np.concatenate([self.q[:, None], self.rates], axis=1)

    @property
    def intervals(self) -> int:
        """Number N of intervals."""
        return len(self.z)

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """q, v, z and the inner modes."""
        return self.q, self.v, self.z, self.inner


def outside_motion(time: float, duration: float) -> str:
    """The message about a via point or condition outside of the motion. time, duration: in [s]."""
    return (
        f"a via point or condition at {time:g} s is not inside the motion of {duration:g} s: "
        "choose a time within it."
    )
