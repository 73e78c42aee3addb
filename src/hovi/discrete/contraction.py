"""Contracts derivatives at quadrature points with a scheme's table to those of intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native
from hovi.checks.kinds import compact
from hovi.discrete.instants import InstantBatch
from hovi.discrete.interval_batch import IntervalBatch
from hovi.discrete.interval_charts import Charts
from hovi.scene.lagrangian import PointExpansion
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Expansion:
    """Second-order expansion of every L_d of a path, in scaled coordinates of the intervals.

    The m = 2 k + r columns are (q0, h v0, q1, h v1, c) if nodal, (q0, h v0, Z0, Z1, c) if
    regularized, and for any order k (q0, h q0', ..., q1, h q1', ..., c); inner modes that an
    interval does not have are zero.

    values: L_d, shape (N,). gradient: shape (N, m, n). hessian: shape (N, m, m, n, n).
    outputs: y and its Jacobian at the quadrature points, one pair per batch, for lifted Newton
        steps and for compiled code, which needs them C-contiguous; they have no rows if the
        Lagrangian has no outputs.
    charts: of the intervals, one per batch; None if the chart is the identity.
    points: of the Lagrangian at the quadrature points, one per batch; None if they were not kept.
    """

    values: Array
    gradient: Array
    hessian: Array
    outputs: list[tuple[Array, Array]]
    charts: list[Charts] | None = None
    points: list[PointExpansion] | None = None

    def __post_init__(self) -> None:
        outputs = [(compact(y), compact(J)) for y, J in self.outputs]
        object.__setattr__(self, "outputs", outputs)

    @property
    def action(self) -> float:
        """The discrete action, the sum of all L_d."""
        return float(np.sum(self.values))

    def charts_of(self, batch: int) -> Charts | None:
        """The charts of a batch of intervals; None if they are the identity."""
        return None if self.charts is None else self.charts[batch]


def joined(
    batches: Sequence[IntervalBatch | InstantBatch], parts: list[Expansion], N: int, m: int
) -> Expansion:
    """The expansion of all N intervals, with m columns, from those of their batches."""
    n = parts[0].gradient.shape[2]
    values, gradient, hessian = np.zeros(N), np.zeros((N, m, n)), np.zeros((N, m, m, n, n))
    for batch, part in zip(batches, parts, strict=True):
        own = part.gradient.shape[1]
        batch.add(part.values, values)
        batch.add(part.gradient, gradient[:, :own])
        batch.add(part.hessian, hessian[:, :own, :own])
    outputs = [pair for part in parts for pair in part.outputs]
    charts = [each for part in parts for each in part.charts or ()] or None
    points = [point for part in parts for point in part.points or ()] or None
    return Expansion(values, gradient, hessian, outputs, charts, points)


def contract(
    table: Array, weights: Array, steps: Array, gradient: Array, hessian: Array
) -> tuple[Array, Array]:
    """Gradient and Hessian of sum_q h w_q L(A_q x) in the m columns x of every interval.

    A_q = table_q / (1, h, h^2, ...) maps the columns to (q, v, ...) at a point, so these are the
    sums of h w_q A_q^T g_q and h w_q A_q^T H_q A_q with the derivatives g_q, H_q of L there. Tables
    of order k have R = k + 1 rows at each point.

    table: shape (Q, R, m), or for intervals with tables of their own (B Q, R, m). weights: w, shape
        (Q,) or (B Q,). steps: h of the intervals, shape (B,).
    gradient: of L at the B Q points, R n entries each. hessian: symmetric, (R n)^2 entries each.
    Returns gradient (B, m, n) and hessian (B, m, m, n, n).
    """
    rows, m = table.shape[1:]
    P = len(hessian)
    g = np.ascontiguousarray(gradient.reshape(P, -1))
    n = g.shape[1] // rows
    H = np.ascontiguousarray(hessian.reshape(P, rows * n, rows * n))
    columns_gradient = np.empty((len(steps), m, n))
    columns_hessian = np.empty((len(steps), m, m, n, n))
    h = np.ascontiguousarray(steps)
    native.contract(
        np.ascontiguousarray(table), weights, h, g, H, columns_gradient, columns_hessian
    )
    return columns_gradient, columns_hessian
