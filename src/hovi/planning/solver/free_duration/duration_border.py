"""The derivatives of a discrete action in the logarithms of lengths of free parts.

The unknowns are the columns (q, h q', ..., c) of the intervals and s = log L of every part, L its
length. With the columns fixed, the jet at a point of the part is y = (q, q', ..., q^(k)) with y_j
proportional to L^-j, so that y' = dy/ds has the parts -j y_j and y'' the parts j^2 y_j, and the
weights h w grow like L. With the gradient g and the Hessian H of the Lagrangian l at the points,
all sums over the points of the part,

    dS/ds = h w (l + g.y'),   d2S/ds2 = h w (l + 2 g.y' + y'.H y' + g.y''),

and the derivative of the gradient in the columns is that of h w with (1 - j) g_j + (H y')_j for g.
What is kept where parts begin and end, such as v0 in h v0, has columns that change with L
themselves: by the chain rule. No point depends on two lengths.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.contraction import Expansion
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.interval_batch import Jet
from hovi.scene.lagrangian import PointExpansion, PointTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class DurationBorder:
    """Derivatives of the action in s = log L of the part of every interval.

    slope: dS/ds, what every interval adds, shape (N,). column: d2S/ds dx of its columns x, shape
    (N, m, n). corner: d2S/ds2, what it adds, (N,). All are zero where no part is.
    """

    slope: Array
    column: Array
    corner: Array

    def with_ends(
        self, expansion: Expansion, kept: Array, unknown: Array, order: int
    ) -> DurationBorder:
        """The derivatives if columns of what is kept change with s, too: see `kept_columns`.

        kept: u_j = j x_j = dx_j/ds of the columns x_j = h^j q^(j), zero elsewhere, shape (N, m, n);
        the second derivative is j u_j. unknown: j where q^(j) is an unknown, zero elsewhere: the
        step of its column grows alike. order: k.
        """
        g, j = expansion.gradient, np.arange(order)
        bend = np.zeros_like(kept)
        bend[:, : 2 * order] = np.tile(j, 2)[:, None] * kept[:, : 2 * order]
        moved = np.zeros_like(kept)
        for i in np.flatnonzero(kept.any(axis=(1, 2))):
            moved[i] = np.einsum("abij,bj->ai", expansion.hessian[i], kept[i])
        twice = _sums((2 * self.column + moved) * kept + g * bend)
        column = self.column + moved + unknown * g
        return DurationBorder(self.slope + _sums(g * kept), column, self.corner + twice)


@dataclass(frozen=True, eq=False)
class Forces:
    """Terms of limits at the points of a batch, whose weights do not grow with L.

    gradient: those in the expansion's gradient. multipliers: those that weight curvatures.
    """

    gradient: PointTerms
    multipliers: PointTerms


def stretch_of(jet: Jet) -> Array:
    """y' = dy/ds at the points, with the columns fixed, shape (P, (k + 1) n)."""
    parts = [np.zeros_like(jet[1]), *(-float(j) * x for j, x in enumerate(jet[1:], 1))]
    return np.concatenate(parts, axis=1)


def duration_border(
    ld: DiscreteLagrangian,
    expansion: Expansion,
    jets: list[Jet],
    inside: Mask,
    forces: Sequence[Forces | None] | None = None,
) -> DurationBorder:
    """The derivatives with all columns fixed.

    expansion: in nodal columns, with those at the points. jets: of the same path.
    inside: which intervals belong to a part, (N,). forces: of limits, per batch; none if None.
    """
    assert expansion.points is not None
    column = np.zeros_like(expansion.gradient)
    slope, corner = np.zeros(len(column)), np.zeros(len(column))
    for i, (batch, jet, point) in enumerate(zip(ld.batches, jets, expansion.points, strict=True)):
        weights, numbers = ld.point_weights[i], ld.point_intervals[i]
        at_points = _at_points(point, jet, None if forces is None else forces[i])
        slope += np.bincount(numbers, weights * at_points[0], len(slope))
        corner += np.bincount(numbers, weights * at_points[2], len(corner))
        gradient = at_points[1].reshape(len(weights), ld.k + 1, -1)
        if expansion.charts is not None:
            part = expansion.charts[i].nodal_gradient(gradient)
        else:
            part = batch.contracted(gradient, "nodal")
        column[batch.index, : part.shape[1]] = part
    column[~inside] = 0.0
    return DurationBorder(inside * slope, column, inside * corner)


def _at_points(
    point: PointExpansion, jet: Jet, forces: Forces | None
) -> tuple[Array, Array, Array]:
    """Slope (P,), gradient's derivative (P, (k + 1) n) and corner (P,) before weighting."""
    n = jet[1].shape[1]
    j = np.repeat(np.arange(float(len(jet))), n)
    first = stretch_of(jet)
    bent = np.matmul(point.hessian, first[:, :, None])[:, :, 0]
    slope = point.value + np.vecdot(point.gradient, first)
    own, force = point.gradient, np.zeros_like(point.gradient)
    if forces is not None:
        own = own - _pulled(forces.gradient, point)
        force = _pulled(forces.multipliers, point)
    column = (1.0 - j) * own - j * force + bent
    corner = point.value + np.vecdot(2.0 * own + bent, first) - np.vecdot(own + force, j * first)
    return slope, column, corner


def _sums(columns: Array) -> Array:
    """The sum over the columns of every interval, shape (N,)."""
    return np.asarray(columns.sum(axis=(1, 2)))


def _pulled(terms: PointTerms, point: PointExpansion) -> Array:
    """The gradient of terms in the jet, shape (P, (k + 1) n)."""
    pulled = np.matmul(terms.output_gradient[:, None], point.jacobian)[:, 0]
    return np.asarray(terms.jet_gradient + pulled)
