"""The equations c = 0 of a problem: moments of passive torques, then conditions at nodes.

Those of passive torques are sqrt(h) m_j, see TorqueMoments; conditions at nodes are scaled such
that one weight of |c|^2 suits both.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.grid import DiscretePath
from hovi.optimize.kkt_model import ConstraintRows, KktLayout
from hovi.planning.conditions.condition import linear_at
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.torque_moments import TorqueMoments
from hovi.planning.solver.multipliers import node_residuals

Array = npt.NDArray[np.float64]


class Equations:
    """The equations of a problem as rows of its intervals.

    node_scale: factor of conditions at nodes.
    """

    def __init__(self, problem: TrajectoryProblem, node_scale: float) -> None:
        self.problem, self.node_scale = problem, node_scale
        passive = problem.passive
        self.moments = TorqueMoments.everywhere(problem.ld, passive) if len(passive) > 0 else None
        self.passive_joints = _joints_of(problem) if len(passive) > 0 else passive
        self._known: tuple[KktLayout, Array] | None = None

    def residual(self, x: DiscretePath, outputs: list[Array]) -> Array:
        """c at a path, with the Lagrangian's outputs at its points."""
        parts = [self.node_scale * c for c in node_residuals(self.problem, x)]
        if self.moments is not None:
            scaled = self.moments.scaled
            parts = [*(scaled(tau, i) for i, tau in enumerate(outputs)), *parts]
        return np.concatenate(parts)

    def rows(self, x: DiscretePath, expansion: Expansion) -> list[ConstraintRows]:
        """Their Jacobian in nodal columns; expansion: of a discrete Lagrangian at the path.

        Those of each passive joint, and those of all conditions, are a family.
        """
        rows = []
        if self.moments is not None:
            for i, batch in enumerate(self.problem.ld.batches):
                slopes = self.moments.scaled_slopes(expansion, i)
                families = np.resize(self.passive_joints, slopes.shape[1])
                rows.append(ConstraintRows(batch.index, slopes, families))
        for each in self.problem.equations:
            k, columns, scale = self.place(each.where.node)
            _, J = linear_at(each, *each.where.state(x))  # (s, 2, n)
            slopes = np.zeros((1, len(J), columns.stop, J.shape[2]))
            slopes[0, :, columns] = self.node_scale * scale[:, None] * J
            rows.append(ConstraintRows(np.array([k]), slopes))
        return rows

    def place(self, node: int) -> tuple[int, slice, Array]:
        """An interval that contains a node, the columns of its (q, h v), and their scales."""
        grid = self.problem.grid
        k = min(node, grid.intervals - 1)
        first = 0 if node == k else grid.order
        return k, slice(first, first + 2), np.array([1.0, 1.0 / grid.steps[k]])

    def layout(self, rows: list[ConstraintRows]) -> tuple[KktLayout, Array]:
        """The layout of the KKT matrix, and the metric in it, which all paths have in common."""
        if self._known is None:
            structure = self.problem.structure
            layout = KktLayout.of(structure.layout, rows)
            self._known = layout, layout.extended(structure.metric_band)
        return self._known

    def split(self, y: Array) -> tuple[list[Array], list[Array]]:
        """Multipliers as lambda of passive joints at the points per batch, and mu of conditions."""
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


def _joints_of(problem: TrajectoryProblem) -> npt.NDArray[np.intp]:
    """The number of the joint of every passive coordinate, from 1."""
    firsts = [joint.idx_v for joint in problem.scene.model.joints[1:]]
    return np.searchsorted(firsts, problem.passive, side="right")
