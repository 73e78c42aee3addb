"""A motion moved out of obstacles: a guess that keeps its distances, found without its dynamics.

The motion is changed by few smooth functions of time, such that the change of its acceleration is
small. Each pair that comes too close is moved where it is closest, in
small steps: there its shortest way out is across the motion, and not along it. Where all of a
motion inside an obstacle were moved at once, it would leave it forwards and backwards as well.
"""

from __future__ import annotations

import contextlib
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import linear_at
from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import Curve, stretched
from hovi.discrete.state import State
from hovi.errors import ChartError
from hovi.planning.clearance.distances import Distances
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.segmented_lagrangian import NODE_TOLERANCE
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

WAVES, MOST_WAVES = 12, 60
"""Number of functions of time, without one for each free end, and the largest one with seams."""
FURTHER_POINTS = 8
"""Number of Gauss points beyond two per wave, by which prices are integrated."""
SAMPLES = 64, 256
"""Least and largest number of times at which distances are looked at."""
STEP = 0.02
"""Distance by which a pair is moved in one iteration, in [m]."""
BEYOND = 0.005
"""Distance beyond the least one that is aimed at, in [m]."""
LOOKED_AT = 0.06
"""Distance beyond the least one up to which pairs are kept from coming closer, in [m]."""
MAX_ITERATIONS = 30
"""Maximum number of iterations from each change to begin with."""
STIFFNESS = 1e6
"""Price of a violation, per [m^2], relative to that of a change of the acceleration."""
RIDGE = 1e-6
"""Price of a change, relative to that of its acceleration."""
CONDITION_STIFFNESS = 1e8
"""Price of a violation of conditions at nodes, relative to that of a change of the acceleration."""
LONGEST = 0.2
"""Largest change of a coordinate in one iteration, in [rad] or [m]."""
TRIES = 9
"""Number of changes to begin with: none, and then random ones, which may lead past an obstacle on
another side."""
BUMPS, BUMP = 3, 0.7
"""Number of waves of a random change, and the size of the first one, in [rad] or [m]."""
NEARLY = 0.005
"""How much shorter than the least one distances may be in the end, in [m]."""
PASSES = 4
"""Passes in which the pairs that an iteration would move too close are found."""


def pushed_out(
    problem: TrajectoryProblem, path: DiscretePath, distances: Distances, least: float
) -> DiscretePath | None:
    """The path moved such that all distances are at least `least`, in [m]; None if that fails.

    Where they stay shorter by at most NEARLY, that will do: a solve from there does the rest.
    """
    deformation = _Deformation(problem, path, distances, least)
    for seed in range(TRIES):
        found = deformation.solved(deformation.bumps(seed))
        if found is not None:
            with contextlib.suppress(ChartError):  # it turns too far for the intervals
                return problem.path(deformation.curve(found))
    return None


@dataclass(frozen=True, eq=False)
class _Deformation:
    """Changes x(t) = sum_j c_j w_j(t / T) of a motion, c of shape (J, nv)."""

    problem: TrajectoryProblem
    path: DiscretePath
    distances: Distances
    least: float

    def bumps(self, seed: int) -> Array:
        """The coefficients with which a try begins: none, and then random ones."""
        c = np.zeros((self._number + sum(self._free), self.problem.coordinates.nv))
        if seed > 0:
            sizes = BUMP / np.arange(1, BUMPS + 1)[:, None] / np.sqrt(self._prices)
            first = sum(self._free)
            c[first : first + BUMPS] = np.random.default_rng(seed).normal(0.0, sizes)
        return c

    def solved(self, c: Array) -> Array | None:
        """The coefficients of a change that keeps all distances, or nearly; None for none.

        c: those it begins with.
        """
        nearly = None
        aim = self.least + BEYOND
        for _ in range(MAX_ITERATIONS):
            q = self.problem.coordinates.integrate(self._q, self._values @ c)
            placed = self.distances.at(q, self._t)
            d, J = self.distances.expand(placed, self.least + LOOKED_AT)
            d[self._given] = np.inf
            lowest = d.min(axis=0)
            if float(lowest.min()) >= self.least:
                return c
            if float(lowest.min()) >= self.least - NEARLY:
                nearly = c
            target = np.minimum(aim, np.where(lowest < self.least, lowest + STEP, aim))
            change = self._moved(c, d, J, target) - c
            largest = float(np.abs(self._values @ change).max())
            c = c + min(1.0, LONGEST / max(largest, 1e-300)) * change
        return nearly

    def _moved(self, c: Array, d: Array, J: Array, target: Array) -> Array:
        """The coefficients after one iteration. d, J: distances and their derivatives."""
        i, pair = np.nonzero(d < self.least + LOOKED_AT)
        rows = (self._values[i][:, :, None] * J[i, pair][:, None]).reshape(len(i), -1)
        wanted = target[pair] - d[i, pair] + rows @ c.ravel()
        H, g = self._elastic(c)
        step: Array = c.ravel()
        active = wanted > rows @ step
        for _ in range(PASSES):
            some = rows[active]
            A, b = H + STIFFNESS * some.T @ some, g + STIFFNESS * some.T @ wanted[active]
            step = np.asarray(np.linalg.solve(A, b), dtype=np.float64)
            now = active | (wanted > rows @ step)
            if np.array_equal(now, active):
                break
            active = now
        return step.reshape(c.shape)

    def _elastic(self, c: Array) -> tuple[Array, Array]:
        """Matrix and right-hand side of the acceleration's change and of what holds at nodes."""
        H, g = self._stiffness.copy(), np.zeros(c.size)
        grid, path = self.problem.grid, self.path
        for each in self.problem.equations:
            k, T = each.where.node, grid.duration
            w, dw, _, _ = (x[0] for x in self.waves(grid.t[[k]] / T))
            q, v = self.problem.coordinates.integrate(path.q[k], w @ c), path.v[k] + dw @ c / T
            value, slope = linear_at(each, q, v)
            row = w[:, None] * slope[:, :1] + dw[:, None] / T * slope[:, 1:]
            row = row.reshape(len(value), -1)
            H += CONDITION_STIFFNESS * row.T @ row
            g += CONDITION_STIFFNESS * row.T @ (row @ c.ravel() - value)
        return H, g

    def waves(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """w_j and their first three derivatives at s in [0, 1], (M, J) each."""
        return _waves(s, self._free, self._number)

    def curve(self, c: Array) -> Curve:
        """The changed motion."""
        T, problem = self.problem.grid.duration, self.problem
        base = stretched(problem.trajectory(self.path), T, problem.ld.k)

        def curve(t: Array) -> tuple[Array, ...]:
            q, v, a, *jerk = base(t)
            w, dw, ddw, dddw = self.waves(np.asarray(t) / T)
            x, dx, ddx = w @ c, dw @ c / T, ddw @ c / T**2
            moved = problem.coordinates.chart.composed((q, v, a), x, dx, ddx)
            return (*moved, *(each + dddw @ c / T**3 for each in jerk))

        return curve

    @property
    def _number(self) -> int:
        """Number of waves: as many for every part between seams, up to a largest number."""
        return min(WAVES * (1 + len(self.problem.holds)), MOST_WAVES)

    @cached_property
    def _given(self) -> Mask:
        """At which times the configuration is given."""
        given, T = np.zeros(len(self._t), dtype=bool), self.problem.grid.duration
        given[[0, -1]] = [not free for free in self._free]
        for each in self.problem.holds:
            given |= (np.abs(self._t - each.time) < NODE_TOLERANCE * T) & each.fixed[0].all()
        return given

    @property
    def _free(self) -> tuple[bool, bool]:
        """Whether the start and the goal may move."""
        problem = self.problem
        return not isinstance(problem.start, State), not isinstance(problem.goal, State)

    @cached_property
    def _t(self) -> Array:
        grid = self.problem.grid
        return np.linspace(0.0, grid.duration, int(np.clip(4 * grid.intervals, *SAMPLES)) + 1)

    @cached_property
    def _q(self) -> Array:
        return self.problem.trajectory(self.path).configurations(self._t)

    @cached_property
    def _values(self) -> Array:
        return self.waves(self._t / self._t[-1])[0]

    @cached_property
    def _prices(self) -> Array:
        """Prices of changes of the coordinates, (nv,): what is slow by its limits costs more."""
        limits = self.problem.limits
        prices = np.ones(self.problem.coordinates.nv)
        if limits is not None:
            speed = np.minimum(limits.upper[1], -limits.lower[1])
            known = np.isfinite(speed) & (speed > 0.0)
            prices[known] = (speed[known].max(initial=0.0) / speed[known]) ** 2
        return prices

    @cached_property
    def _stiffness(self) -> Array:
        """The matrix of the integral of 1/2 |x''|^2 in normalized time."""
        x, weights = np.polynomial.legendre.leggauss(2 * self._number + FURTHER_POINTS)
        ddw = self.waves((x + 1) / 2)[2]
        gram = ddw.T @ (0.5 * weights[:, None] * ddw)
        gram += RIDGE * np.eye(len(gram))  # both ends may move without an acceleration
        H = np.kron(gram, np.diag(self._prices))
        T = self.problem.grid.duration
        for each in self.problem.holds:  # what is given at seams does not change
            for x, fixed in zip(self.waves(np.array([each.time / T])), each.fixed, strict=False):
                price = CONDITION_STIFFNESS * np.diag(fixed.astype(np.float64))
                H += np.kron(np.outer(x[0], x[0]), price)
        return np.asarray(H, dtype=np.float64)


def _waves(s: Array, free: tuple[bool, bool], number: int) -> tuple[Array, Array, Array, Array]:
    """w_j and their first three derivatives at s in [0, 1], (M, J) each.

    sin(pi s) sin(j pi s), which vanish with their rates at both ends; and for each end that is
    free the cubic that moves it.
    number: of the sines.
    """
    low, high = (np.pi * np.arange(start, start + number) for start in (0, 2))
    a, b = np.outer(s, low), np.outer(s, high)
    parts = (
        np.cos(a) - np.cos(b),
        -low * np.sin(a) + high * np.sin(b),
        -(low**2) * np.cos(a) + high**2 * np.cos(b),
        low**3 * np.sin(a) - high**3 * np.sin(b),
    )
    ends = []
    rise = s**2 * (3 - 2 * s), 6 * s * (1 - s), 6 - 12 * s, np.full_like(s, -12.0)
    if free[1]:
        ends.append(rise)
    if free[0]:
        ends.append((1 - rise[0], -rise[1], -rise[2], -rise[3]))
    columns = [[end[k] for end in ends] + list(0.5 * parts[k].T) for k in range(4)]
    return tuple(np.stack(each, axis=1) for each in columns)  # type: ignore[return-value]
