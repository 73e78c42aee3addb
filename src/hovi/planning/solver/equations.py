"""The equations c = 0 of a problem: moments of passive torques, then conditions.

Those of passive torques are sqrt(h) m_j, see TorqueMoments; conditions, along the motion and at
nodes, are scaled such that one weight of |c|^2 suits both.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.grid import DiscretePath
from hovi.discrete.interval_batch import Jet
from hovi.optimize.kkt_model import ConstraintRows, KktLayout
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.torque_moments import TorqueMoments
from hovi.planning.solver.along_moments import AlongMoments
from hovi.planning.solver.node_equations import NodeEquations
from hovi.scene.lagrangian import PointTerms

Array = npt.NDArray[np.float64]


class Equations:
    """The equations of a problem as rows of its intervals.

    scale: factor of those that are no moments of torques.
    """

    def __init__(self, problem: TrajectoryProblem, scale: float) -> None:
        self.problem, self.scale = problem, scale
        passive = problem.passive
        self.moments = TorqueMoments.everywhere(problem.ld, passive) if len(passive) > 0 else None
        self.passive_joints = _joints_of(problem) if len(passive) > 0 else passive
        parts = zip(problem.along, problem.along_sizes, strict=True)
        self.along = [AlongMoments(problem, each, size) for each, size in parts]
        self.at_nodes = NodeEquations.of(problem.equations, problem.grid)
        self._known: tuple[KktLayout, Array] | None = None
        self._last: tuple[DiscretePath, list[Array]] | None = None

    @property
    def sizes(self) -> list[int]:
        """The sizes of `conditions`."""
        return [*(each.size for each in self.along), *(each.size for each in self.at_nodes)]

    def residual(self, x: DiscretePath, outputs: list[Array], jets: Sequence[Jet]) -> Array:
        """c at a path, with the Lagrangian's outputs and (q, v, a) at its points."""
        parts = [self.scale * c for c in self.conditions(x, jets)]
        if self.moments is not None:
            scaled = self.moments.scaled
            parts = [*(scaled(tau, i) for i, tau in enumerate(outputs)), *parts]
        return np.concatenate(parts)

    def conditions(self, x: DiscretePath, jets: Sequence[Jet]) -> list[Array]:
        """c of the conditions: of each along the motion in its intervals, then at nodes.

        The last ones are cached: a step asks for them up to five times.
        """
        if self._last is None or self._last[0] is not x:
            along = [each.residual(jets) for each in self.along]
            self._last = x, [*along, *(each.residual(x) for each in self.at_nodes)]
        return self._last[1]

    def rows(
        self, x: DiscretePath, expansion: Expansion, jets: Sequence[Jet]
    ) -> list[ConstraintRows]:
        """Their Jacobian in nodal columns; expansion: of a discrete Lagrangian at the path.

        Those of each passive joint, and those of all conditions, are a family.
        """
        rows = []
        if self.moments is not None:
            for i, batch in enumerate(self.problem.ld.batches):
                slopes = self.moments.scaled_slopes(expansion, i)
                families = np.resize(self.passive_joints, slopes.shape[1])
                rows.append(ConstraintRows(batch.index, slopes, families))
        for each in itertools.chain(*self.condition_rows(x, expansion, jets)):
            rows.append(ConstraintRows(each.index, self.scale * each.slopes))
        return rows

    def condition_rows(
        self, x: DiscretePath, expansion: Expansion, jets: Sequence[Jet]
    ) -> list[list[ConstraintRows]]:
        """The rows of `conditions`, without the scale."""
        along = [each.rows(jets, expansion) for each in self.along]
        return [*along, *([each.rows(x)] for each in self.at_nodes)]

    def layout(self, rows: list[ConstraintRows]) -> tuple[KktLayout, Array]:
        """The layout of the KKT matrix, and the metric in it, which all paths have in common."""
        if self._known is None:
            structure = self.problem.structure
            layout = KktLayout.of(structure.layout, rows)
            self._known = layout, layout.extended(structure.metric_band)
        return self._known

    def split(self, y: Array) -> tuple[list[Array], list[Array]]:
        """Multipliers as lambda of passive joints at the points per batch, and of conditions."""
        torque, first = [], 0
        if self.moments is not None:
            for i in range(len(self.moments.batches)):
                last = first + self.moments.size(i)
                torque.append(self.moments.spread(y[first:last], i))
                first = last
        ends = first + np.cumsum([0, *self.sizes])
        return torque, [self.scale * y[a:b] for a, b in itertools.pairwise(ends)]

    def add_forces(self, terms: list[PointTerms], mu: list[Array], jets: Sequence[Jet]) -> None:
        """Add those of conditions along the motion to terms at the points, in place.

        mu: multipliers of `conditions`.
        """
        for each, multipliers in zip(self.along, mu, strict=False):  # those at nodes come after
            for i, gradient, curvature in each.terms(jets, multipliers):
                terms[i] = terms[i].plus(gradient, curvature)

    def add_at_nodes(self, x: DiscretePath, mu: list[Array], expansion: Expansion) -> None:
        """Add the terms mu c of conditions at nodes to an expansion, in place.

        mu: multipliers of `conditions`.
        """
        for each, multipliers in zip(self.at_nodes, mu[len(self.along) :], strict=True):
            rows = each.rows(x)
            expansion.gradient[rows.index, : rows.slopes.shape[2]] += rows.weighted(multipliers)
        self.add_curvature(x, mu, expansion.hessian)

    def in_intervals(self, rows: list[ConstraintRows]) -> list[ConstraintRows]:
        """Of `rows`, those whose forces act at the points: all but those at nodes."""
        return rows[: len(rows) - len(self.at_nodes)]

    def add_curvature(self, x: DiscretePath, mu: list[Array], hessian: Array) -> None:
        """Add the curvature of conditions at nodes to Hessians of the intervals, in place."""
        for each, multipliers in zip(self.at_nodes, mu[len(self.along) :], strict=True):
            each.add_curvature(x, multipliers, hessian)


def _joints_of(problem: TrajectoryProblem) -> npt.NDArray[np.intp]:
    """The number of the joint of every passive coordinate, from 1."""
    firsts = [joint.idx_v for joint in problem.scene.model.joints[1:]]
    return np.searchsorted(firsts, problem.passive, side="right")
