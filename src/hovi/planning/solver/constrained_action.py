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
from hovi.planning.conditions.condition import bend_at
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import (
    INITIAL_NODE_PENALTY,
    NODE_TOLERANCE,
    TORQUE_TOLERANCE,
    within,
)
from hovi.planning.solver.equations import Equations
from hovi.planning.solver.multipliers import Multipliers

Array = npt.NDArray[np.float64]

PENALTY = 3e5
"""`penalty`, relative to the mean weight of the other joints' torques."""

# called at each step
_expand = without_checks(DiscreteLagrangian.expand)


class ConstrainedAction(EqualityObjective[DiscretePath]):
    """The discrete action in nodal coordinates, and the equations.

    problem: the trajectory problem. path: a guess, whose action scales the conditions at nodes.
    penalty, node_penalty: weights of |c|^2 for which moments and conditions at nodes count alike.
    """

    def __init__(self, problem: TrajectoryProblem, path: DiscretePath) -> None:
        self.problem = problem
        self.action = ActionObjective(problem, "band")
        self.penalty = PENALTY * problem.mean_output_weight
        self.node_penalty = self._first_node_penalty(path)
        self.node_scale = float(np.sqrt(self.node_penalty / self.penalty))
        self.equations = Equations(problem, self.node_scale)

    def _first_node_penalty(self, path: DiscretePath) -> float:
        """The penalty of conditions, from the cost of a path or the curvature there."""
        if not self.problem.equations:
            return self.penalty
        cost = abs(self.problem.ld.action(path))
        expansion = _expand(self.problem.ld, path, "nodal", None, None, self.action.jets(path))
        largest = float(np.max(np.abs(expansion.hessian)))
        return max(INITIAL_NODE_PENALTY * cost, largest, 1e-6)

    @cached_property
    def negligible(self) -> float:
        """See EqualityObjective.negligible."""
        return self.problem.negligible_cost

    def evaluate(self, x: DiscretePath) -> Outputs:
        """The action, and c."""
        outputs = self.action.outputs(x)
        return Outputs(self.action.value_of(x, outputs), self.equations.residual(x, outputs))

    def feasible(self, x: DiscretePath) -> bool:
        """Whether passive torques and conditions at nodes are within their tolerances."""
        return within(self.action.residuals(x), TORQUE_TOLERANCE, NODE_TOLERANCE)

    def model(self, x: DiscretePath, multipliers: Array) -> KktModel:
        """See EqualityObjective.model."""
        ld, outputs = self.problem.ld, self.action.outputs(x)
        slopes = [L.output_slope(y) for L, y in zip(ld.lagrangians, outputs, strict=True)]
        torque, nodes = self.equations.split(multipliers)
        for slope, force in zip(slopes, torque, strict=False):  # none without passive joints
            slope[:, self.problem.passive] += force
        terms = None if ld.chart is None else self.multipliers(multipliers).forces
        expansion = _expand(ld, x, "nodal", slopes, terms, self.action.jets(x))
        rows = self.equations.rows(x, expansion)
        if terms is not None:
            _take_out(rows[: len(torque)], multipliers, expansion)
        self._bend(x, expansion, nodes)
        structure = self.problem.structure
        metric = structure.metric["nodal"]
        intervals = IntervalSum(expansion.gradient, expansion.hessian, metric)
        layout, wide = self.equations.layout(rows)
        return KktModel(intervals, rows, multipliers, layout, structure.metric_band, wide)

    def _bend(self, x: DiscretePath, expansion: Expansion, nodes: list[Array]) -> None:
        """Add the curvature of conditions to the intervals at their nodes."""
        for each, mu in zip(self.problem.equations, nodes, strict=True):
            k, columns, scale = self.equations.place(each.where.node)
            curvature = bend_at(each, *each.where.state(x), mu)
            curvature *= scale[:, None, None, None] * scale[:, None]
            expansion.hessian[k, columns, columns] += curvature.transpose(0, 2, 1, 3)

    def retract(self, x: DiscretePath, step: Array, model: KktModel) -> DiscretePath:
        """The path moved by a step."""
        return self.action.retract(x, step, model.plain)

    def relative_size(self, x: DiscretePath, step: Array, model: KktModel) -> float:
        """See EqualityObjective.relative_size."""
        return self.action.relative_size(x, step, model.plain)

    def multipliers(self, y: Array) -> Multipliers:
        """The multipliers of the equations as lambda at points and mu at nodes."""
        torque, nodes = self.equations.split(y)
        zero = Multipliers.zero(self.problem, self.penalty, self.node_penalty)
        for force, passive in zip(zero.torque, torque, strict=False):  # none without passive joints
            force[:, self.problem.passive] = passive
        return dataclasses.replace(zero, nodes=nodes)

    def of_nodes(self, known: Multipliers) -> Array:
        """The multipliers y with those of conditions at nodes alone."""
        return np.concatenate([mu / self.node_scale for mu in known.nodes])


def _take_out(rows: list[ConstraintRows], multipliers: Array, expansion: Expansion) -> None:
    """Take the multipliers' part A^T y out of the gradient of an expansion."""
    first = 0
    for each in rows:
        own = each.weighted(multipliers[first : first + each.size])
        expansion.gradient[each.index, : own.shape[1]] -= own
        first += each.size
