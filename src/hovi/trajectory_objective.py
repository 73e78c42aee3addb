"""The discrete action of a trajectory problem as an objective of the trust region."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from hovi.action_structure import ActionStructure
from hovi.discrete_lagrangian import Coordinates, Expansion, Jet
from hovi.grid import DiscretePath
from hovi.guess import moved
from hovi.lagrangian import PointTerms
from hovi.optimize.band import BandModel
from hovi.optimize.merge_tree import MergeTreeModel
from hovi.optimize.quadratic_model import IntervalSum, QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]
LinearAlgebra = Literal["band", "tree"]

BAND_INTERVALS = 1000
"""Up to this many intervals the nodal band matrix, whose condition grows like N^4, is factored."""


class ActionObjective(Objective[DiscretePath]):
    """The discrete action between fixed ends, in nodal or in regularised coordinates.

    problem: what to minimise.
    structure: what depends on the grid alone, from an earlier objective on the same grid.
    algebra: "band" (LAPACK's banded Cholesky in nodal coordinates, the faster one) or "tree"
        (merging intervals in regularised coordinates, right at every step length).
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        algebra: LinearAlgebra | None = None,
        structure: ActionStructure | None = None,
    ) -> None:
        self.problem = problem
        self.ld = problem.ld
        self.structure = structure or ActionStructure(problem.grid, problem.robot.nv)
        small = problem.grid.intervals <= BAND_INTERVALS
        self.algebra: LinearAlgebra = algebra or ("band" if small else "tree")
        self._expansion: Expansion | None = None
        self._last: tuple[DiscretePath, list[Jet]] | None = None

    @property
    def expansion(self) -> Expansion:
        """The expansion behind the last model."""
        if self._expansion is None:
            raise RuntimeError("no model has been asked for yet")
        return self._expansion

    @property
    def coordinates(self) -> Coordinates:
        """Columns in which the intervals are expanded."""
        return "nodal" if self.algebra == "band" else "regular"

    def value(self, x: DiscretePath) -> float:
        """The discrete action."""
        return self.ld.action(x, self.jets(x))

    def jets(self, x: DiscretePath) -> list[Jet]:
        """(q, v, a) at the quadrature points, remembered for the last path."""
        if self._last is None or self._last[0] is not x:
            self._last = x, self.ld.jets(x)
        return self._last[1]

    def model(
        self, x: DiscretePath, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        """The quadratic model at x, its curvature weighted by the predicted torque."""
        multipliers = None
        if previous is not None and step is not None and self._expansion is not None:
            local = previous.gather(step)
            multipliers = self.ld.predict(self._expansion, local, self.coordinates)
        return self.model_with(x, multipliers, None)

    def model_with(
        self,
        x: DiscretePath,
        multipliers: list[Array] | None,
        terms: list[PointTerms] | None,
    ) -> QuadraticModel:
        """The model at x with given curvature weights and with what limits add at the points."""
        self._expansion = self.ld.expand(x, self.coordinates, multipliers, terms, self.jets(x))
        intervals = IntervalSum(
            self._expansion.gradient,
            self._expansion.hessian,
            self.structure.metric[self.coordinates],
        )
        if self.algebra == "band":
            return BandModel(intervals, self.structure.layout, self.structure.metric_band)
        return MergeTreeModel(intervals, self.structure.tree)

    def merge_model(self, x: DiscretePath) -> MergeTreeModel:
        """The exact model at x in regularised coordinates, for the inertia."""
        expansion = self.ld.expand(x, "regular")
        metric = self.structure.metric["regular"]
        intervals = IntervalSum(expansion.gradient, expansion.hessian, metric)
        return MergeTreeModel(intervals, self.structure.tree)

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step: nodes by `integrate`, everything else added."""
        h = self._h
        local = model.gather(step)  # (N, m, n)
        dq = np.concatenate([local[:, 0], np.zeros((1, local.shape[2]))])
        dv = np.concatenate([local[:, 1] / h, np.zeros((1, local.shape[2]))])
        dZ = local[:, 2:4]
        if self.algebra == "band":
            dZ = np.stack([dZ[:, 0] - local[:, 0] - local[:, 1], dZ[:, 1] - local[:, 1]], axis=1)
        q = self.problem.robot.integrate(x.q, dq)
        hh = h[:, None] ** 2
        return DiscretePath(q, x.v + dv, x.z + dZ / hh, x.inner + local[:, 4:] / hh)

    def relative_size(self, x: DiscretePath, step: Array, model: QuadraticModel) -> float:
        """The largest change of q, T v or h^2 c, relative to that of q and T v (at least one)."""
        local = model.gather(step)
        m = local.shape[1]
        T = self.problem.grid.duration
        size = max(1.0, float(np.max(np.abs(x.q))), T * float(np.max(np.abs(x.v))))
        dq = max(float(np.max(np.abs(local[:, k]), initial=0.0)) for k in (0, *range(4, m)))
        dv = float(np.max(np.abs(local[:, 1] / self._h)))
        return max(dq, T * dv) / size

    @property
    def _h(self) -> Array:
        return self.problem.grid.steps[:, None]


def follow(solved: DiscretePath, problem: TrajectoryProblem) -> DiscretePath:
    """Where a stationary path goes, to first order, when its boundary data move.

    dx = cubic - H^-1 H cubic, with the cubic that carries the old ends to the new ones and H the
    action's Hessian at the old path: one Newton step of the equations linearised there. Just the
    cubic where H is not positive definite.

    solved: a stationary path on the problem's grid, between other ends.
    """
    path = moved(solved, problem.grid, problem.boundary, problem.robot)
    objective = ActionObjective(problem, "tree", problem.structure)
    model = objective.model(solved, None, None)
    factor = model.factor(0.0)
    if factor is None:
        return path
    h = problem.grid.steps[:, None]
    shift = np.zeros_like(model.intervals.gradient)
    shift[:, 0] = problem.robot.difference(solved.q, path.q)[:-1]
    shift[:, 1] = h * (path.v - solved.v)[:-1]
    shift[:, 2:4] = h[:, None] ** 2 * (path.z - solved.z)
    residual = np.einsum("kijab,kjb->kia", model.intervals.hessian, shift)
    step = factor.solve(-model.scatter(residual) - model.gradient)
    return objective.retract(path, step, model)
