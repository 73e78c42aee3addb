"""The KKT system at a solution, factored: its inertia, and how the motion follows what is given.

With the unknowns x of a motion, the equations and the active bounds c(x) = 0 and their multipliers
z, a change of what is given moves a solution to first order by

    [H, A^T; A, 0] [dx; dz] = -[d(gradient); dc],

H the Hessian of action + z.c and A the slopes of c, without a barrier. Bounds are active where
their multiplier outweighs the gap to them by far. Where both are small (`strictness`) the motion
touches a bound that does not hold it, and may follow a change in one direction otherwise than in
the other; at a limit that holds for a while, such touches are next to where it begins and ends.
[Fiacco1983]
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.errors import InputError
from hovi.optimize.banded_model import BandModel
from hovi.optimize.barrier import Barrier
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Reason
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.kkt_model import ConstraintRows, KktFactor, KktModel
from hovi.optimize.start import Start
from hovi.planning.problem.limits import no_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.first_multipliers import least_squares_multipliers
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]
EndName = Literal["start", "goal"]

SHARP_BARRIER, MAX_STEPS = 1e-12, 50
"""Last barrier parameter, relative to the mean density of the cost, which separates
bounds that hold the motion from those that it touches, and the maximum number of steps to it."""
STATIONARY = 1e-6
"""Decrease of the cost that a Newton step predicts, relative to it, above which a motion is none of
which there is a factor."""
FREEDOM = 1e-6
"""What a motion that follows a change may miss of the active bounds, relative to their slopes."""
TOUCHED = 1e3
"""Ratio of a multiplier, relative to the mean density of the cost, and its gap, relative to the
range, up to which a bound is touched without a force."""


@dataclass(frozen=True, eq=False)
class SolvedBounds:
    """Where a solve within limits ended: its objective, and slacks and multipliers of the bounds.

    They stay in the process: what is loaded from a pickle is None.
    """

    objective: BoundedAction
    barrier: Barrier

    def sharpened(self, path: DiscretePath) -> tuple[DiscretePath, SolvedBounds]:
        """The solution with next to no barrier, with the same rows; as it is if that fails."""
        objective = self.objective.with_fixed_rows()
        criteria = Criteria(barrier=SHARP_BARRIER, max_iterations=MAX_STEPS)
        ended = minimize_bounded(objective, Start(path, self.barrier), criteria)
        if ended.why is not Reason.STATIONARY:
            return path, self
        return ended.x, SolvedBounds(objective, ended.z)

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        return type(None), ()


@dataclass(frozen=True, eq=False)
class SolutionFactor:
    """The factored KKT system of a solution, in the columns of its intervals and their unknowns.

    problem, path: solved, the path with next to no barrier, and a duration that stays.
    system: the matrix and its right-hand sides. active: number of bounds that are taken as
        equations.
    strictness: the least, over all bounds, of the larger one of the multiplier, relative to the
        mean density of the cost, and the gap, relative to the range; infinite without bounds, and
        small at limits that hold for a while, where one row after the other begins to act.
    bound_slopes: d cost / d(lower, upper) of the bounds of every condition, by its name, of shape
        (2, size of y), in the unit of y: with multipliers z >= 0 of y, the sums of w z and of -w z.
    """

    problem: TrajectoryProblem
    path: DiscretePath
    system: KktModel
    active: int
    strictness: float
    bound_slopes: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def of(
        cls, problem: TrajectoryProblem, path: DiscretePath, known: SolvedBounds | None = None
    ) -> Self:
        """The system at a solution; known: where a solve within limits ended.

        Raises InputError for a limited problem of which that is not known, as after a solve that
        found no minimum, for a periodic one, whose ends move together, and for grids of more than
        1,000 intervals, whose matrix is no band.
        """
        if problem.periodic:
            raise InputError(
                "the factor of a periodic motion is not available, since its ends move together; "
                "plan between states."
            )
        if known is None and problem.limited:
            raise InputError(
                "the factor of a limited motion, also by distances alone, is that of a minimum as "
                "it was solved for, and there is none; see the solution's message."
            )
        if known is not None:
            path, known = known.sharpened(path)
        objective = known.objective if known else _unlimited(problem, path)
        outputs = objective.outputs(path)
        barrier = known.barrier if known else Barrier.inactive(objective.bounds, outputs.y)
        model = _exact_model(objective, path, barrier.multipliers)
        active, strictness = _active(barrier, outputs.density(objective.bounds.measure))
        rows = _rows_of(objective, model, np.flatnonzero(active))
        system = objective.action.kkt(path, model, rows)
        bounds = _bound_slopes(objective, barrier)
        found = cls(problem, path, system, int(active.sum()), strictness, bounds)
        found._require_stationary(abs(outputs.value))
        return found

    @cached_property
    def factor(self) -> KktFactor:
        """The factor of the system, whatever its inertia; `solve` refines it."""
        return self.system.exact_factor()

    @cached_property
    def negative_eigenvalues(self) -> int:
        """Number of negative eigenvalues of H where A dx = 0; -1 if it is not decided."""
        return self.system.negative_eigenvalues()

    def slopes(self, end: EndName) -> Array:
        """d(q, v, ...) at the nodes / d(q, v, ...) at an end, shape (N + 1, k, nv, k, nv).

        Columns of components that are free at that end are zero, and NaN where the active bounds
        leave the motion no freedom to follow. On groups q is moved in the tangent space.
        """
        problem, h = self.problem, self.problem.grid.steps
        k, n = problem.ld.k, problem.coordinates.nv
        powers = h[:, None] ** np.arange(k)
        slopes = np.zeros((len(h) + 1, k, n, k, n))
        for j, i in np.argwhere(~problem.free_ends[self._number(end)]):
            columns = self._moved_columns(end, j, i)[0]
            slopes[:-1, :, :, j, i] = columns[:, :k] / powers[:, :, None]
            slopes[-1, :, :, j, i] = columns[-1, k : 2 * k] / powers[-1][:, None]
        return slopes

    def cost_slopes(self, end: EndName) -> Array:
        """d cost / d(q, v, ...) at an end, shape (k, nv); zero in free components."""
        free = self.problem.free_ends[self._number(end)]
        return np.where(free, 0.0, self._at_end(end, self.system.plain.intervals.gradient))

    def cost_curvature(self, end: EndName) -> Array:
        """d2 cost / d(q, v, ...)^2 at an end, shape (k nv, k nv), symmetric.

        It is the Hessian of the least cost in the start, or in the goal; zero in free components,
        and NaN where the motion has no freedom to follow.
        """
        free = self.problem.free_ends[self._number(end)]
        curvature = np.zeros((*free.shape, *free.shape))
        hessian = self.system.plain.intervals.hessian
        for j, i in np.argwhere(~free):
            columns, z = self._moved_columns(end, j, i)
            force = np.einsum("kcdab,kdb->kca", hessian, columns) + self.system.pulled_columns(z)
            curvature[:, :, j, i] = np.where(free, 0.0, self._at_end(end, force))
        flat = curvature.reshape(free.size, free.size)
        return np.asarray(0.5 * (flat + flat.T))

    def _require_stationary(self, cost: float) -> None:
        """Raise InputError unless a Newton step leads to next to no decrease."""
        s, _ = self.factor.solve(-self.system.gradient, np.zeros(self.system.equations))
        decrease = 0.5 * abs(float(s @ self.system.gradient))
        if not decrease <= STATIONARY * cost + np.finfo(float).tiny:
            raise InputError(
                "the factor is that of a motion at which the cost is stationary, and this one is "
                "not: see the solution's message, and plan with more time or steps."
            )

    def _number(self, end: EndName) -> int:
        if not isinstance(end, str) or end not in ("start", "goal"):
            raise InputError(f"end must be 'start' or 'goal', got {end!r:.60}.")
        limits = self.problem.limits
        if end == "start" and limits is not None and limits.excused:
            raise InputError(
                "the start is outside of its limits, which are wider until it is led back: they "
                "move with the start, and slopes in it are not available."
            )
        return int(end == "goal")

    def _at_end(self, end: EndName, force: Array) -> Array:
        """A covector of the intervals' columns, (N, m, n), as one of (q, v, ...) at an end."""
        k, h = self.problem.ld.k, self.problem.grid.steps
        mine, step = (force[0, :k], h[0]) if end == "start" else (force[-1, k : 2 * k], h[-1])
        return np.asarray(mine * step ** np.arange(k)[:, None])

    def _end_columns(self, end: EndName, order: int, joint: int) -> Array:
        """The intervals' columns where one component of an end moves by one, (N, m, n)."""
        k, h = self.problem.ld.k, self.problem.grid.steps
        columns = np.zeros_like(self.system.plain.intervals.gradient)
        if end == "start":
            columns[0, order, joint] = h[0] ** order
        else:
            columns[-1, k + order, joint] = h[-1] ** order
        return columns

    def _moved_columns(self, end: EndName, order: int, joint: int) -> tuple[Array, Array]:
        """Those of the whole motion then, and the change of the multipliers."""
        system, given = self.system, self._end_columns(end, order, joint)
        force = np.einsum("kcdab,kdb->kca", system.plain.intervals.hessian, given)
        s, z = self.factor.solve(-system.plain.scatter(force), -system.pushed_columns(given))
        columns = given + system.plain.gather(s)
        missed = np.abs(system.pushed_columns(columns)).max(initial=0.0)
        if missed > FREEDOM * system.largest_slope * np.abs(given).max():
            return np.full_like(columns, np.nan), np.full_like(z, np.nan)
        return columns, z


def _unlimited(problem: TrajectoryProblem, path: DiscretePath) -> BoundedAction:
    """The objective of a problem without limits, with multipliers of equations at a motion."""
    known = least_squares_multipliers(problem, path) if problem.constrained else None
    return BoundedAction(problem, no_limits(problem.coordinates), multipliers=known)


def _exact_model(objective: BoundedAction, path: DiscretePath, multipliers: Array) -> BandModel:
    """The Hessian of the Lagrangian and its gradient at a path, without equations and barrier."""
    objective.predict([])
    none = np.zeros_like(multipliers)
    model = objective.model(path, none, multipliers, multipliers)
    plain = model.inner if isinstance(model, EquationModel) else model
    if not isinstance(plain, BandModel):
        raise InputError("the factor needs a grid of at most 1,000 intervals; use fewer.")
    return plain


def _bound_slopes(objective: BoundedAction, barrier: Barrier) -> dict[str, Array]:
    """See SolutionFactor."""
    if objective.more is None:
        return {}
    weights = objective.bounds.weights
    lower, upper = (
        objective.at_points(weights * z)[:, len(objective.columns) :].sum(axis=0)
        for z in (barrier.zl, -barrier.zu)
    )
    return objective.more.by_name(np.stack([lower, upper]))


def _active(barrier: Barrier, density: float) -> tuple[npt.NDArray[np.bool_], float]:
    """Which bounds are active, (R,), and the strictness of that. density: mean one of the cost.

    Towards mu = 0 forces stay, and z / gap grows as 1 / mu; it stays near 1 where a bound is
    touched without a force.
    """
    z = np.stack([barrier.zl, barrier.zu]) / max(density, np.finfo(float).tiny)
    gap = np.stack([barrier.s - barrier.bounds.lower, barrier.bounds.upper - barrier.s])
    active = np.any(z > TOUCHED * gap, axis=0)
    return active, float(np.min(np.maximum(z, gap), initial=np.inf))


def _rows_of(objective: BoundedAction, model: BandModel, outputs: Index) -> list[ConstraintRows]:
    """The slopes of some outputs in the columns of their intervals, those of as many together."""
    N, m, n = shape = model.intervals.gradient.shape
    slopes = objective.output_slopes(shape)[outputs]
    of = objective.output_intervals[outputs]
    counts, rows = np.bincount(of, minlength=N), []
    for count in np.unique(counts[counts > 0]):
        numbers = np.flatnonzero(counts == count)
        own = np.concatenate([slopes[of == number] for number in numbers])
        family = np.full(count, n + 1)  # those of passive joints are up to n
        rows.append(ConstraintRows(numbers, own.reshape(len(numbers), count, m, n), family))
    return rows
