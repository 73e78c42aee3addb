"""The discrete action under a problem's equations, as an objective of the Lagrange-Newton method.

The equations c = 0 are sqrt(h) m_j of the moments of passive torques, see TorqueMoments, and those
of conditions at nodes, scaled such that one penalty suits both.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import without_checks
from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath
from hovi.optimize.constrained_model import ConstrainedModel, ConstraintRows, EqualityObjective
from hovi.optimize.ended import Outputs
from hovi.optimize.quadratic_model import IntervalSum
from hovi.planning.conditions.condition import bend_at, linear_at
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.torque_moments import TorqueMoments
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian_rounds import (
    INITIAL_NODE_PENALTY,
    NODE_TOLERANCE,
    TORQUE_TOLERANCE,
    mean_output_weight,
    within,
)
from hovi.planning.solver.multipliers import Multipliers, node_residuals

Array = npt.NDArray[np.float64]

PENALTY = 3e5
"""The first penalty, relative to the mean weight of the other joints' torques."""

# called at each step
_expand = without_checks(DiscreteLagrangian.expand)


class ConstrainedAction(EqualityObjective[DiscretePath]):
    """The discrete action in nodal coordinates, and the equations.

    problem: the trajectory problem. path: a guess, whose action scales the conditions at nodes.
    penalty: the first one for `minimize_under_equations`.
    """

    def __init__(self, problem: TrajectoryProblem, path: DiscretePath) -> None:
        self.problem = problem
        self.action = ActionObjective(problem, "band")
        self.penalty = PENALTY * mean_output_weight(problem)
        self.node_penalty = self._first_node_penalty(path)
        self.node_scale = float(np.sqrt(self.node_penalty / self.penalty))
        passive = problem.passive
        self.moments = TorqueMoments.everywhere(problem.ld, passive) if len(passive) > 0 else None

    def _first_node_penalty(self, path: DiscretePath) -> float:
        """The penalty of conditions, from the cost of a path or the curvature there."""
        if not self.problem.equations:
            return self.penalty
        cost = abs(self.problem.ld.action(path))
        expansion = _expand(self.problem.ld, path, "nodal", None, None, self.action.jets(path))
        largest = float(np.max(np.abs(expansion.hessian)))
        return max(INITIAL_NODE_PENALTY * cost, largest, 1e-6)

    def evaluate(self, x: DiscretePath) -> Outputs:
        """The action, and c."""
        outputs = self.action.outputs(x)
        parts = [self.node_scale * c for c in node_residuals(self.problem, x)]
        if self.moments is not None:
            scaled = self.moments.scaled
            parts = [*(scaled(tau, i) for i, tau in enumerate(outputs)), *parts]
        return Outputs(self.action.value_of(x, outputs), np.concatenate(parts))

    def feasible(self, x: DiscretePath) -> bool:
        """Whether passive torques and conditions at nodes are within their tolerances."""
        return within(self.action.residuals(x), TORQUE_TOLERANCE, NODE_TOLERANCE)

    def model(self, x: DiscretePath, multipliers: Array) -> ConstrainedModel:
        """See EqualityObjective.model."""
        ld, outputs = self.problem.ld, self.action.outputs(x)
        slopes = [L.output_slope(y) for L, y in zip(ld.lagrangians, outputs, strict=True)]
        rows: list[ConstraintRows] = []
        torque, nodes = self._split(multipliers)
        if self.moments is not None:
            for slope, force in zip(slopes, torque, strict=True):
                slope[:, self.moments.passive] += force
        terms = None if ld.chart is None else self.multipliers(multipliers).forces
        expansion = _expand(ld, x, "nodal", slopes, terms, self.action.jets(x))
        if self.moments is not None:
            for i, batch in enumerate(ld.batches):
                rows.append(ConstraintRows(batch.index, self.moments.scaled_slopes(expansion, i)))
        if terms is not None:
            _take_out(rows, multipliers, expansion)
        rows += self._conditions(x, expansion, nodes)
        structure = self.problem.structure
        metric = structure.metric["nodal"]
        intervals = IntervalSum(expansion.gradient, expansion.hessian, metric)
        return ConstrainedModel(
            intervals, rows, multipliers, structure.layout, structure.metric_band
        )

    def _conditions(
        self, x: DiscretePath, expansion: Expansion, nodes: list[Array]
    ) -> list[ConstraintRows]:
        """The rows of conditions at nodes; adds their terms to the intervals at their nodes."""
        N, rows = self.problem.grid.intervals, []
        for each, mu in zip(self.problem.equations, nodes, strict=True):
            node = each.where.node
            k = min(node, N - 1)
            first = 0 if node < N else self.problem.ld.k
            columns = slice(first, first + 2)
            q, v = each.where.state(x)
            _, J = linear_at(each, q, v)  # (s, 2, n)
            scale = np.array([1.0, 1.0 / self.problem.grid.steps[k]])[:, None]  # of (q, h v)
            J = J * scale
            curvature = bend_at(each, q, v, mu) * scale[:, :, None, None] * scale
            expansion.hessian[k, columns, columns] += curvature.transpose(0, 2, 1, 3)
            slopes = np.zeros((1, len(J), first + 2, J.shape[2]))
            slopes[0, :, columns] = self.node_scale * J
            rows.append(ConstraintRows(np.array([k]), slopes))
        return rows

    def retract(self, x: DiscretePath, step: Array, model: ConstrainedModel) -> DiscretePath:
        """The path moved by a step."""
        return self.action.retract(x, step, model.plain)

    def multipliers(self, y: Array) -> Multipliers:
        """The multipliers of the equations as lambda at points and mu at nodes."""
        torque, nodes = self._split(y)
        zero = Multipliers.zero(self.problem, self.penalty, self.node_penalty)
        for force, passive in zip(zero.torque, torque, strict=False):  # none without passive joints
            force[:, self.problem.passive] = passive
        return dataclasses.replace(zero, nodes=nodes)

    def _split(self, y: Array) -> tuple[list[Array], list[Array]]:
        """lambda of the passive joints at the points per batch, and mu of every condition."""
        torque, nodes, first = [], [], 0
        if self.moments is not None:
            for i in range(len(self.moments.batches)):
                last = first + self.moments.size(i)
                torque.append(self.moments.spread(y[first:last], i))
                first = last
        for each in self.problem.equations:
            last = first + each.y.size
            nodes.append(self.node_scale * y[first:last])
            first = last
        return torque, nodes

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
