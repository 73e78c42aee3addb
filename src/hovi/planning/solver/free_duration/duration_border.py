"""The derivatives of a discrete action in the logarithm of its duration.

The unknowns are the columns (q, h q', ..., c) of the intervals and s = log T. With the columns
fixed, the jet at a point is y = (q, q', ..., q^(k)) with y_j proportional to T^-j, so that
y' = dy/ds has the parts -j y_j and y'' the parts j^2 y_j, and the weights h w grow like T. With the
gradient g and the Hessian H of L at the points, all sums over the points,

    dS/ds = h w (L + g.y'),   d2S/ds2 = h w (L + 2 g.y' + y'.H y' + g.y''),

and the derivative of the gradient in the columns is that of h w with (1 - j) g_j + (H y')_j for g.
The columns of fixed ends, such as h v0, change with T themselves: by the chain rule.
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


@dataclass(frozen=True, eq=False)
class DurationBorder:
    """Derivatives of the action in s = log T.

    slope: dS/ds. column: d2S/ds dx of the columns x of every interval, shape (N, m, n).
    corner: d2S/ds2.
    """

    slope: float
    column: Array
    corner: float

    def with_ends(self, expansion: Expansion, change: Array, order: int) -> DurationBorder:
        """The derivatives if columns of fixed ends change with s, too.

        change: u_j = j x_j = dx_j/ds of the columns x_j = h^j q^(j), zero elsewhere, shape
        (N, m, n); the second derivative is j u_j. order: k.
        """
        g, j = expansion.gradient, np.arange(order)
        bend = np.zeros_like(change)
        bend[:, : 2 * order] = np.tile(j, 2)[:, None] * change[:, : 2 * order]
        moved = np.zeros_like(change)
        for i in {0, len(change) - 1}:
            moved[i] = np.einsum("abij,bj->ai", expansion.hessian[i], change[i])
        twice = float(np.vdot(2 * self.column + moved, change)) + float(np.vdot(g, bend))
        slope = self.slope + float(np.vdot(g, change))
        return DurationBorder(slope, self.column + moved, self.corner + twice)


@dataclass(frozen=True, eq=False)
class Forces:
    """Terms of limits at the points of a batch, whose weights do not grow with T.

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
    forces: Sequence[Forces | None] | None = None,
) -> DurationBorder:
    """The derivatives with all columns fixed.

    expansion: in nodal columns, with those at the points. jets: of the same path.
    forces: of limits, per batch; none if None.
    """
    assert expansion.points is not None
    column = np.zeros_like(expansion.gradient)
    slope = corner = 0.0
    for i, (batch, jet, point) in enumerate(zip(ld.batches, jets, expansion.points, strict=True)):
        weights = ld.point_weights[i]
        at_points = _at_points(point, jet, None if forces is None else forces[i])
        slope += float(weights @ at_points[0])
        corner += float(weights @ at_points[2])
        gradient = at_points[1].reshape(len(weights), ld.k + 1, -1)
        if expansion.charts is not None:
            part = expansion.charts[i].nodal_gradient(gradient)
        else:
            part = batch.contracted(gradient, "nodal")
        column[batch.index, : part.shape[1]] = part
    return DurationBorder(slope, column, corner)


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


def _pulled(terms: PointTerms, point: PointExpansion) -> Array:
    """The gradient of terms in the jet, shape (P, (k + 1) n)."""
    pulled = np.matmul(terms.output_gradient[:, None], point.jacobian)[:, 0]
    return np.asarray(terms.jet_gradient + pulled)
