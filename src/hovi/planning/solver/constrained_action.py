"""The discrete action under the equations of a problem, as an objective of Newton's method."""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.optimize.ended import Outputs
from hovi.optimize.kkt_model import ConstraintRows, EqualityObjective, KktModel
from hovi.optimize.quadratic_model import IntervalSum
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.equations import Equations
from hovi.planning.solver.first_multipliers import CONDITION_PENALTY
from hovi.planning.solver.missed_equations import CONDITION_TOLERANCE, TORQUE_TOLERANCE, within
from hovi.planning.solver.multipliers import Multipliers
from hovi.scene.lagrangian import PointTerms

Array = npt.NDArray[np.float64]

PENALTY = 3e5
"""Penalty of |c|^2 in the model, relative to the mean weight of the other joints' torques."""
LEAST_PENALTY = 1e-6
"""Least penalty of conditions, per [rad^2] or [m^2]."""

# called at each step
_expand = without_checks(DiscreteLagrangian.expand)


class ConstrainedAction(EqualityObjective[DiscretePath]):
    """The discrete action in nodal coordinates, and the equations.

    problem: the trajectory problem. path: a guess, whose action scales the conditions.
    penalty: weight of |c|^2, with which torques and conditions count alike.
    """

    def __init__(self, problem: TrajectoryProblem, path: DiscretePath) -> None:
        self.problem = problem
        self.action = ActionObjective(problem, "band")
        self.penalty = PENALTY * problem.mean_output_weight
        self.scale = float(np.sqrt(self._condition_penalty(path) / self.penalty))
        self.equations = Equations(problem, self.scale)

    def _condition_penalty(self, path: DiscretePath) -> float:
        """The penalty of conditions, from the cost of a path or the curvature there."""
        if not (self.problem.equations or self.problem.along):
            return self.penalty
        cost = abs(self.problem.ld.action(path))
        expansion = _expand(self.problem.ld, path, "nodal", None, None, self.action.jets(path))
        largest = float(np.max(np.abs(expansion.hessian)))
        return max(CONDITION_PENALTY * cost, largest, LEAST_PENALTY)

    @cached_property
    def negligible(self) -> float:
        """See EqualityObjective.negligible."""
        return self.problem.negligible_cost

    def motion(self, x: DiscretePath) -> tuple[TrajectoryProblem, DiscretePath]:
        """The problem and the motion at a point."""
        return self.problem, x

    def evaluate(self, x: DiscretePath) -> Outputs:
        """The action, and c."""
        outputs = self.action.outputs(x)
        residual = self.equations.residual(x, outputs, self.action.jets(x))
        return Outputs(self.action.value_of(x, outputs), residual)

    def feasible(self, x: DiscretePath) -> bool:
        """Whether passive torques and conditions are within their tolerances."""
        return within(self.action.residuals(x), TORQUE_TOLERANCE, CONDITION_TOLERANCE)

    def model(self, x: DiscretePath, multipliers: Array) -> KktModel:
        """See EqualityObjective.model."""
        ld, outputs = self.problem.ld, self.action.outputs(x)
        slopes = [L.output_slope(y) for L, y in zip(ld.lagrangians, outputs, strict=True)]
        torque, others = self.equations.split(multipliers)
        for slope, force in zip(slopes, torque, strict=False):  # none without passive joints
            slope[:, self.problem.passive] += force
        jets, terms = self.action.jets(x), None
        if ld.chart is not None or self.problem.along:
            terms = self.forces(multipliers, x)
        expansion = _expand(ld, x, "nodal", slopes, terms, jets)
        rows = self.equations.rows(x, expansion, jets)
        if terms is not None:
            _take_out(self.equations.in_intervals(rows), multipliers, expansion)
        self.equations.add_curvature(x, others, expansion.hessian)
        structure = self.problem.structure
        metric = structure.metric["nodal"]
        intervals = IntervalSum(expansion.gradient, expansion.hessian, metric)
        layout, wide = self.equations.layout(rows)
        return KktModel(intervals, rows, multipliers, layout, structure.metric_band, wide)

    def retract(self, x: DiscretePath, step: Array, model: KktModel) -> DiscretePath:
        """The path moved by a step."""
        return self.action.retract(x, step, model.plain)

    def relative_size(self, x: DiscretePath, step: Array, model: KktModel) -> float:
        """See EqualityObjective.relative_size."""
        return self.action.relative_size(x, step, model.plain)

    def multipliers(self, y: Array) -> Multipliers:
        """The multipliers of the equations as lambda at points, and those of conditions."""
        torque, others = self.equations.split(y)
        zero = Multipliers.zero(self.equations)
        for force, passive in zip(zero.torque, torque, strict=False):  # none without passive joints
            force[:, self.problem.passive] = passive
        return dataclasses.replace(zero, conditions=others)

    def forces(self, y: Array, x: DiscretePath) -> list[PointTerms]:
        """The multipliers as terms at the quadrature points of a path."""
        known = self.multipliers(y)
        terms = known.forces
        self.equations.add_forces(terms, known.conditions, self.action.jets(x))
        return terms


def _take_out(rows: list[ConstraintRows], multipliers: Array, expansion: Expansion) -> None:
    """Take the multipliers' part A^T y out of the gradient of an expansion."""
    first = 0
    for each in rows:
        own = each.weighted(multipliers[first : first + each.size])
        expansion.gradient[each.index, : own.shape[1]] -= own
        first += each.size
