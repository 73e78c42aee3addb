"""The discrete action of a trajectory problem as an objective of the trust-region method.

With equality constraints it is their Lagrangian, see hovi.planning.solver.multipliers.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import with_ends_of_nodes
from hovi.discrete.interval_batch import Coordinates, Jet
from hovi.discrete.interval_paths import move, move_any
from hovi.errors import InputError
from hovi.optimize.banded_model import BandModel
from hovi.optimize.equation_model import EquationModel, PenaltyModel
from hovi.optimize.kkt_model import ConstraintRows, KktLayout, KktModel
from hovi.optimize.merge_tree import MergeTreeModel
from hovi.optimize.quadratic_model import IntervalSum, QuadraticModel
from hovi.optimize.trust_region import Objective
from hovi.planning.problem.hessian_structure import ActionStructure
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.equations import Equations
from hovi.planning.solver.multipliers import Multipliers, Residuals
from hovi.scene.lagrangian import Lagrangian, PointTerms

Array = npt.NDArray[np.float64]
LinearAlgebra = Literal["band", "tree"]

MAX_CHART_TURN = 1.4 * np.pi
"""Turn of an orientation within an interval, in [rad], above which the value is infinite."""
TORQUE_FLOOR = 1e-4
"""Lower bound of the torque scale for residuals, as a fraction of the inertial torque M / T^2."""
ROUNDING_FLOOR = 2e-5
"""Lower bound of the torque scale for residuals, as a fraction of |d tau/dq| |q|, and with charts
of M |q| / h^2: rounding moves torques by 5e-16 of it, and the equations of passive joints are
solved to 1e-10 of the torque scale."""
MAX_BAND_INTERVALS = 1000
"""Maximum number of intervals for the nodal band matrix; its condition number grows like N^4."""

# called at each step
_expand = without_checks(DiscreteLagrangian.expand)
_jets = without_checks(DiscreteLagrangian.jets)
_predict = without_checks(DiscreteLagrangian.predict)
_new_path = without_checks(DiscretePath)


class ActionObjective(Objective[DiscretePath]):
    """The discrete action between fixed ends, in nodal or in regularized coordinates.

    problem: the trajectory problem.
    algebra: "band" (banded Cholesky in nodal coordinates, faster) or "tree" (merging intervals in
        regularized coordinates, accurate for every step length; for fixed ends without
        constraints).
    structure: of an earlier objective on the same grid, to be reused.
    multipliers: of the equality constraints, if any.
    keep_points: whether expansions keep those at the points, from which `duration_border` follows.
    """

    def __init__(
        self,
        problem: TrajectoryProblem,
        algebra: LinearAlgebra | None = None,
        structure: ActionStructure | None = None,
        multipliers: Multipliers | None = None,
        keep_points: bool = False,
    ) -> None:
        self.problem = problem
        self.multipliers = multipliers
        self.keep_points = keep_points
        self.moments = problem.torque_moments
        on = problem.coordinates
        integrate = partial(without_checks(type(on).integrate), on)
        self._integrate = np.add if on.vector_joints else integrate
        self.ld = problem.ld
        self.structure = structure or problem.structure
        small = problem.grid.intervals <= MAX_BAND_INTERVALS
        mergeable = problem.plain and problem.ld.k == 2
        tree = mergeable and problem.ld.chart is None and not small
        if algebra == "tree" and not mergeable:
            raise InputError(
                "algebra 'tree' needs order 2 and fixed ends without conditions; use 'band'."
            )
        self.algebra: LinearAlgebra = algebra or ("tree" if tree else "band")
        self._expansion: Expansion | None = None
        self._last: tuple[DiscretePath, list[Jet]] | None = None
        self._outputs: tuple[DiscretePath, list[Array]] | None = None
        self._residual: tuple[DiscretePath, Array] | None = None

    @cached_property
    def negligible(self) -> float:
        """See Objective.negligible."""
        return self.problem.negligible_cost

    @property
    def expansion(self) -> Expansion:
        """The expansion of the last model."""
        if self._expansion is None:
            raise RuntimeError("there is no expansion before the first model")
        return self._expansion

    @property
    def coordinates(self) -> Coordinates:
        """Coordinates in which the intervals are expanded."""
        return "nodal" if self.algebra == "band" else "regular"

    def motion(self, x: DiscretePath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem and the motion at a point."""
        return self.problem, x

    def value(self, x: DiscretePath) -> float:
        """The discrete action, with the terms of multipliers."""
        return self.value_of(x, self.outputs(x))

    def outputs(self, x: DiscretePath) -> list[Array]:
        """The Lagrangian's outputs at the quadrature points, per batch; the last are cached."""
        if self._outputs is None or self._outputs[0] is not x:
            parts = zip(self.ld.lagrangians, self.jets(x), self.ld.point_times, strict=True)
            self._outputs = x, [L.output(*jet, t=t) for L, jet, t in parts]
        return self._outputs[1]

    def _outside_chart(self, x: DiscretePath) -> bool:
        """Whether an orientation leaves the chart of an interval, which is singular at 2 pi."""
        return self.ld.chart is not None and bool(self.ld.turns(x).max() > MAX_CHART_TURN)

    def value_of(self, x: DiscretePath, outputs: list[Array]) -> float:
        """The value from given outputs at the quadrature points."""
        if self._outside_chart(x):
            return float("inf")
        value = 0.0
        for i, (jet, t, weights) in enumerate(
            zip(self.jets(x), self.ld.point_times, self.ld.point_weights, strict=True)
        ):
            value += self.ld.lagrangians[i].integral(outputs[i], jet, t, weights)
            if self.multipliers is not None:
                value += float(weights @ np.vecdot(self.multipliers.torque[i], outputs[i]))
        if self.multipliers is not None:
            residuals = self.equations.conditions(x, self.jets(x))
            for mu, c in zip(self.multipliers.conditions, residuals, strict=True):
                value += float(mu @ c)
        return value

    def output_slope(self, outputs: Array, batch: int) -> Array:
        """d value / dy at the points of a batch: R y plus the multipliers."""
        slope = self.ld.lagrangians[batch].output_slope(outputs)
        return slope if self.multipliers is None else slope + self.multipliers.torque[batch]

    def residuals(self, x: DiscretePath) -> Residuals:
        """Residuals of the equality constraints."""
        torques = self.outputs(x)
        largest = max(self._least_torque(x), *(np.abs(tau).max(initial=0.0) for tau in torques))
        if self.moments is None:
            passive = [tau[:, self.problem.passive] for tau in torques]
        else:
            passive = [self.moments.projected(tau, i) for i, tau in enumerate(torques)]
        return Residuals(passive, self.equations.conditions(x, self.jets(x)), largest)

    def _least_torque(self, x: DiscretePath) -> float:
        """Lower bound of the torque scale for residuals, in [N m]."""
        inertial, grid = self.problem.inertial_torque, self.problem.grid
        size = max(1.0, float(np.abs(x.q).max()))
        rounded = size * self.problem.stiffness
        if self.ld.chart is not None:  # else z is stored: rounding of nodes moves no acceleration
            shortest = float(grid.steps.min()) / grid.duration
            rounded = max(rounded, size / shortest**2 * inertial)
        return max(TORQUE_FLOOR * inertial, ROUNDING_FLOOR * rounded)

    @property
    def lagrangian(self) -> Lagrangian:
        """The Lagrangian."""
        return self.ld.lagrangian

    def jets(self, x: DiscretePath) -> list[Jet]:
        """(q, v, a) at the quadrature points; cached for the last path."""
        if self._last is None or self._last[0] is not x:
            self._last = x, _jets(self.ld, x)
        return self._last[1]

    def model(
        self, x: DiscretePath, previous: QuadraticModel | None, step: Array | None
    ) -> QuadraticModel:
        """The quadratic model at x, its curvature weighted by the predicted outputs."""
        if previous is not None and step is not None and self._expansion is not None:
            curvatures = self.predicted_slopes(previous.gather(step))
        else:
            curvatures = [self.output_slope(y, i) for i, y in enumerate(self.outputs(x))]
        return self.model_with(x, curvatures, None)

    def predicted_slopes(self, step: Array) -> list[Array]:
        """R y of the outputs that a step of the last model predicts, per batch.

        step: in the columns of the intervals, shape (N, m, n).
        """
        return _predict(self.ld, self.expansion, step, self.coordinates)

    def model_with(
        self,
        x: DiscretePath,
        curvatures: list[Array] | None,
        terms: list[PointTerms] | None,
        add: Callable[[Expansion], None] | None = None,
    ) -> QuadraticModel:
        """The model at x with given weights of the outputs' curvature and with terms of limits.

        curvatures: weights per batch, multipliers of constraints included. terms: at the points.
        add: adds further terms to the expansion.
        """
        multipliers = self.multipliers
        jets = self.jets(x)
        if multipliers is not None:
            terms = multipliers.added_to(terms)
            self.equations.add_forces(terms, multipliers.conditions, jets)
        self._expansion = _expand(
            self.ld, x, self.coordinates, curvatures, terms, jets, self.keep_points
        )
        if add is not None:
            add(self._expansion)
        if multipliers is not None:
            self.equations.add_at_nodes(x, multipliers.conditions, self._expansion)
        return self.model_of_expansion()

    def without_nodes(self, x: DiscretePath) -> Expansion:
        """The last expansion, at x, without the terms of equations at nodes."""
        every, known = self.expansion, self.multipliers
        if known is None or not self.equations.at_nodes:
            return every
        none = np.zeros_like(every.gradient), np.zeros_like(every.hessian)
        nodes = dataclasses.replace(every, gradient=none[0], hessian=none[1])
        self.equations.add_at_nodes(x, known.conditions, nodes)
        left = every.gradient - nodes.gradient, every.hessian - nodes.hessian
        return dataclasses.replace(every, gradient=left[0], hessian=left[1])

    def model_of_expansion(self) -> QuadraticModel:
        """The model of the last expansion, to which more may have been added since."""
        intervals = IntervalSum(
            self.expansion.gradient,
            self.expansion.hessian,
            self.structure.metric[self.coordinates],
        )
        if self.algebra == "band":
            return BandModel(intervals, self.structure.layout, self.structure.metric_band)
        return MergeTreeModel(intervals, self.structure.tree)

    def gradient(self, x: DiscretePath, model: QuadraticModel) -> Array:
        """The gradient at x in the unknowns of a model at another path, without equations."""
        assert self.multipliers is None
        return model.scatter(self.ld.gradient(x, self.coordinates, self.jets(x)))

    def negative_eigenvalues(self, x: DiscretePath) -> int:
        """n_neg of the exact Hessian at x."""
        if not self.problem.plain or self.ld.chart is not None or self.ld.k != 2:
            model = self.model(x, None, None)
            assert isinstance(model, BandModel)
            return model.negative_eigenvalues()
        return self.merge_model(x).negative_eigenvalues()

    def merge_model(self, x: DiscretePath) -> MergeTreeModel:
        """The exact model at x in regularized coordinates, between fixed ends."""
        expansion = self.ld.expand(x, "regular")
        metric = self.structure.metric["regular"]
        intervals = IntervalSum(expansion.gradient, expansion.hessian, metric)
        return MergeTreeModel(intervals, self.structure.tree)

    def under_equations(self, x: DiscretePath, model: BandModel) -> EquationModel:
        """The last model, at x, whose steps satisfy the equations to first order."""
        return EquationModel(model, self.kkt(x, model), self.residual(x))

    def with_penalty(self, x: DiscretePath, model: BandModel, weight: float) -> PenaltyModel:
        """The last model, at x and the multipliers weight c, with weight |c|^2 / 2 added."""
        return PenaltyModel(model, self.kkt(x, model), weight)

    def kkt(
        self, x: DiscretePath, model: BandModel, bounds: Sequence[ConstraintRows] = ()
    ) -> KktModel:
        """The last model, at x, with the rows of equations, and those of bounds if there are any.

        Equations are those of which multipliers are known.
        """
        rows: list[ConstraintRows] = []
        if self.multipliers is not None:
            rows = self.equations.rows(x, self.expansion, self.jets(x))
        metric = self.structure.metric_band
        if rows and not bounds:
            layout, wide = self.equations.layout(rows)
        else:
            rows = [*rows, *bounds] or [ConstraintRows.none(*model.intervals.gradient.shape[1:])]
            layout = KktLayout.of(self.structure.layout, rows)
            wide = layout.extended(metric)
        return KktModel(model.intervals, rows, layout, metric, wide)

    def residual(self, x: DiscretePath) -> Array:
        """c of the equations at x, (E,), none without multipliers; the last one is cached."""
        if self.multipliers is None:
            return np.zeros(0)
        if self._residual is None or self._residual[0] is not x:
            self._residual = x, self.equations.residual(x, self.outputs(x), self.jets(x))
        return self._residual[1]

    @cached_property
    def equations(self) -> Equations:
        """The equations, scaled as the multipliers are."""
        return Equations(self.problem, 1.0 if self.multipliers is None else self.multipliers.scale)

    def hold(self, change: Array) -> None:
        """Add a change to the multipliers of equations, shape (E,)."""
        known = self.multipliers
        assert known is not None
        passive, (torque, others) = self.problem.passive, self.equations.split(change)
        forces = [force.copy() for force in known.torque]
        for force, more in zip(forces, torque, strict=False):  # none without passive joints
            force[:, passive] += more
        added = [mu + more for mu, more in zip(known.conditions, others, strict=True)]
        self.multipliers = dataclasses.replace(known, torque=forces, conditions=added)

    def retract(self, x: DiscretePath, step: Array, model: QuadraticModel) -> DiscretePath:
        """The path moved by a step: nodes by `integrate`, everything else added."""
        return self.moved(x, model.gather(step))

    def moved(self, x: DiscretePath, columns: Array) -> DiscretePath:
        """The path moved by a step in the columns of the intervals, shape (N, m, n)."""
        if self.ld.k != 2:
            on = self.problem.coordinates
            return move_any(x, columns, self.problem.grid.steps, on.curved_space)
        nodal = self.coordinates == "nodal"
        dq, *moved = move(x.arrays, columns, self.problem.grid.steps, nodal)
        path = _new_path(self._integrate(x.q, dq), *moved)
        if self.ld.chart is None:
            return path
        return with_ends_of_nodes(path, self.problem.grid, self.problem.coordinates)

    def relative_size(self, x: DiscretePath, step: Array, model: QuadraticModel) -> float:
        """The largest change of q, T v or h^2 c, relative to that of q and T v (at least one)."""
        changes = self.structure.sizes[self.coordinates] * model.gather(step)
        T = self.problem.grid.duration
        size = max(1.0, np.abs(x.q).max(), T * np.abs(x.v).max())
        return float(np.abs(changes).max() / size)
