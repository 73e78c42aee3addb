"""Quadratic programs of a program's model, as sparse matrices, and their solution by CasADi.

min g.s + 1/2 s.H s  with  lower <= y + J s <= upper,  c + A s = 0
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from hovi.optimize.banded_model import BandLayout, BandModel
from hovi.optimize.barrier import Bounds
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.kkt_model import ConstraintRows
from hovi.optimize.quadratic_model import QuadraticModel
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

OPTIONS: dict[str, dict[str, Any]] = {
    "piqp": {"piqp": {"eps_abs": 1e-9, "eps_rel": 1e-10, "max_iter": 250}},
    "osqp": {"osqp": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20000, "verbose": False}},
    "proxqp": {"proxqp": {"eps_abs": 1e-9, "max_iter": 2000, "backend": "sparse"}},
    "highs": {"highs": {"output_flag": False}},
}
"""Tolerances and numbers of iterations of the solvers, by their names in CasADi."""


class QuadraticStep(NamedTuple):
    """A solution: the step s, the forces z of the bounds, (R,), the change of the multipliers of
    equations, (E,), and by how much bounds are exceeded after it, (R,)."""

    step: Array
    forces: Array
    reaction: Array
    excess: Array


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """The sparse matrices at a point, for n unknowns, R outputs and E equations.

    model: whose unknowns they have. gradient: g, (n,). hessian: H, (n, n), of the Lagrangian.
    metric: D, (n, n). y, bounds: of the outputs, in units of their ranges. slopes: J, (R, n).
    residual: c, (E,). equation_slopes: A, (E, n).
    """

    model: QuadraticModel
    gradient: Array
    hessian: csc_matrix
    metric: csc_matrix
    y: Array
    bounds: Bounds
    slopes: csc_matrix
    residual: Array
    equation_slopes: csc_matrix

    @classmethod
    def of(
        cls,
        model: BandModel | EquationModel,
        bounds: Bounds,
        y: Array,
        rows: tuple[Index, Array],
    ) -> Self:
        """From a model with equations or without.

        rows: intervals of the outputs, (R,), and their slopes in the columns of these, (R, m, n).
        """
        inner = model.inner if isinstance(model, EquationModel) else model
        layout, local = inner.layout, inner.intervals
        D = local.metric[..., None, None] * np.eye(layout.unknowns.shape[2])
        empty = [ConstraintRows.none(*layout.unknowns.shape[1:])]
        equations = model.kkt.rows if isinstance(model, EquationModel) else empty
        return cls(
            model,
            model.gradient,
            sparse_sum(layout, local.hessian),
            sparse_sum(layout, D),
            y,
            bounds,
            _sparse_rows(layout, *rows),
            model.residual if isinstance(model, EquationModel) else np.zeros(0),
            _stacked(layout, equations),
        )

    def convex(self, shift: float) -> QuadraticProgram:
        """The same with H + shift D."""
        return dataclasses.replace(self, hessian=self.hessian + shift * self.metric)

    def definite(self, shift: float) -> bool:
        """Whether H + shift D is positive definite."""
        model = self.model
        inner = model.inner if isinstance(model, EquationModel) else model
        return inner.factor(shift) is not None

    def solved(self, solver: str, scale: float, penalty: float = np.inf) -> QuadraticStep | None:
        """The solution for a convex H by a solver of CasADi; None where it finds none.

        solver: one of OPTIONS. scale: magnitude of the objective. penalty: of w times the excess of
        y + J s, per scale; bounds may not be exceeded at all for an infinite one.
        """
        import casadi  # slow to import, and only needed here
        from scipy.sparse import block_diag, csc_matrix, hstack, identity, vstack

        n, R, E = len(self.gradient), len(self.y), len(self.residual)
        soft = np.isfinite(penalty)
        H, g = self.hessian / scale, self.gradient / scale
        J, A = self.slopes, self.equation_slopes
        if soft:  # y + J s + e - e' within bounds, with e, e' >= 0
            H = block_diag([H, csc_matrix((2 * R, 2 * R))])
            g = np.concatenate([g, np.tile(penalty * self.bounds.weights, 2)])
            J = hstack([J, identity(R), -identity(R)])
            A = hstack([A, csc_matrix((E, 2 * R))])
        H, rows = csc_matrix(H), csc_matrix(vstack([J, A]))
        lower = np.append(self.bounds.lower - self.y, -self.residual)
        upper = np.append(self.bounds.upper - self.y, -self.residual)
        least = np.append(np.full(n, -np.inf), np.zeros(2 * R if soft else 0))
        patterns = {"h": _pattern(H), "a": _pattern(rows)}
        quiet = {"error_on_fail": False, "print_time": False}
        conic = casadi.conic("qp", solver, patterns, OPTIONS[solver] | quiet)
        found = conic(
            h=casadi.DM(patterns["h"], H.data),
            a=casadi.DM(patterns["a"], rows.data),
            **{"g": g, "lba": lower, "uba": upper, "lbx": least},
        )
        s = found["x"].full().ravel()[:n]
        z = found["lam_a"].full().ravel() * scale
        if not conic.stats()["success"] or not np.isfinite(s).all():
            return None
        weights = np.maximum(self.bounds.weights, np.finfo(float).tiny)
        excess = self.bounds.excess(self.y + self.slopes @ s)
        return QuadraticStep(s, z[:R] / weights, z[R:], excess)


def sparse_sum(layout: BandLayout, hessian: Array) -> csc_matrix:
    """A sum over intervals as a sparse matrix of the unknowns. hessian: (N, m, m, n, n)."""
    from scipy.sparse import csc_matrix  # as in `solved`

    N, m, n = layout.unknowns.shape
    blocks = hessian.transpose(0, 1, 3, 2, 4).reshape(N, m * n, m * n)
    if layout.scales is not None:
        columns = np.repeat(layout.scales, n, axis=1)
        blocks = blocks * columns[:, :, None] * columns[:, None, :]
    flat = layout.unknowns.reshape(N, m * n)
    i, j = np.broadcast_arrays(flat[:, :, None], flat[:, None, :])
    free = (i >= 0) & (j >= 0)
    return csc_matrix((blocks[free], (i[free], j[free])), shape=(layout.size, layout.size))


def _sparse_rows(layout: BandLayout, intervals: Index, slopes: Array) -> csc_matrix:
    """Rows of slopes in the first columns of their intervals, (R, m, n), in the unknowns."""
    from scipy.sparse import csc_matrix  # as in `solved`

    R, m, n = slopes.shape
    at = layout.unknowns[intervals, :m].reshape(R, m * n)
    values = slopes.reshape(R, m * n)
    if layout.scales is not None:
        values = values * np.repeat(layout.scales, n, axis=1)[intervals, : m * n]
    number = np.broadcast_to(np.arange(R)[:, None], at.shape)
    free = at >= 0
    return csc_matrix((values[free], (number[free], at[free])), shape=(R, layout.size))


def _stacked(layout: BandLayout, rows: Sequence[ConstraintRows]) -> csc_matrix:
    """The rows of equations, one below the other."""
    from scipy.sparse import csc_matrix, vstack  # as in `solved`

    parts = []
    for each in rows:
        B, E, m, n = each.slopes.shape
        index = np.repeat(np.arange(len(layout.unknowns))[each.index], E)
        parts.append(_sparse_rows(layout, index, each.slopes.reshape(B * E, m, n)))
    return csc_matrix(vstack(parts))


def _pattern(matrix: csc_matrix) -> Any:
    """The pattern of a sparse matrix in CasADi, whose numbers are in ascending rows."""
    import casadi  # as in `solved`

    matrix.sort_indices()
    rows, width = (int(size) for size in matrix.shape)
    return casadi.Sparsity(rows, width, matrix.indptr.tolist(), matrix.indices.tolist())
