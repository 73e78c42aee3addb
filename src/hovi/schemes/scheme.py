"""A scheme is a table of numbers: (q, v, a) at quadrature points as functions of the end data.

It depends neither on the step h, nor on the robot, nor on the number of joints. It is the
higher-order counterpart of a Butcher tableau.
"""

from __future__ import annotations

from functools import cache, cached_property
from math import factorial

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.schemes.interval_curve import jet_rows, require_positions
from hovi.schemes.polynomials import interval_rows, legendre, orthonormal_legendre
from hovi.system.dataclass import dataclass
from hovi.system.summary import Summarized, Summary

Array = npt.NDArray[np.float64]


@check_arguments
@dataclass(frozen=True, eq=False, repr=False)
class Scheme(Summarized):
    """The discrete Lagrangian L_d = h sum_j w_j L(q_j, v_j, a_j) as numbers.

    In scaled variables the j-th point is (q_j - q0, h v_j, h^2 a_j) = table[j] @ (h v0, Z0, Z1, c),
    with Z0 = q1 - q0 - h v0 and Z1 = h v1 - h v0 (h^2 and h^2 times the regularized coordinates
    z0, z1) and c the interval's inner modes. [ColomboFerraroMartin2016, sections 2 and 5]

    name: in files and on the command line.
    order: of accuracy at the nodes; 0 for a table that does not define a method.
    points: quadrature points in [0, 1], shape (Q,).
    weights: quadrature weights, shape (Q,), with sum 1.
    table: shape (Q, 3, 3 + r) with r inner modes.
    """

    name: str
    order: int
    points: Array
    weights: Array
    table: Array

    def _summary(self) -> Summary:
        kind = f"order {self.order}" if self.order else "no order"
        points = f"{len(self.points)} points, {self.inner_modes} inner modes"
        return Summary(f"Scheme {self.name!r}: {kind}, {points}")

    @property
    def inner_modes(self) -> int:
        """Number r of inner modes of an interval."""
        return int(self.table.shape[2]) - 2 * int(self.table.shape[1]) + 3

    @property
    def derivatives(self) -> int:
        """Order k of the Lagrangians that the table discretizes: 2 except for `galerkin(r, k)`.

        For any k the table has shape (Q, k + 1, 2 k - 1 + r), with the columns of `jet_rows`.
        """
        return int(self.table.shape[1]) - 1

    @property
    def key(self) -> bytes:
        """The numbers of the scheme as bytes; equal schemes have equal keys."""
        return b"".join(x.tobytes() for x in (self.points, self.weights, self.table))

    @cached_property
    def regular_table(self) -> Array:
        """The table for (q0, h v0, Z0, Z1, c), with a column for q0.

        Shape (Q, 3, 4 + r), for any k (Q, k + 1, 2 k + r).
        """
        base = np.zeros((*self.table.shape[:2], 1))
        base[:, 0] = 1.0
        return np.concatenate([base, self.table], axis=2)

    @cached_property
    def nodal_table(self) -> Array:
        """The table for (q0, h v0, q1, h v1, c), shape (Q, 3, 4 + r).

        For any k the columns are (q0, h q0', ..., q1, h q1', ..., c), and the shape is
        (Q, k + 1, 2 k + r).
        """
        return self.regular_table @ regular_from_nodal(self.inner_modes, self.derivatives)

    @cached_property
    def series(self) -> Array:
        """Legendre coefficients of the polynomial through values at the points, (Q, Q).

        Rows are degrees, columns are values; points may coincide.
        """
        return np.asarray(np.linalg.pinv(legendre(2 * self.points - 1, len(self.points) - 1).T))

    @cached_property
    def moments(self) -> Array | None:
        """Test functions P_j of equations along the motion, sum_q w_q P_j(s_q) f(s_q) = 0.

        P_0 .. P_{r+k-1}, orthonormal shifted Legendre polynomials, at the points, shape (r + k, Q):
        a curve with r inner modes has r + k coefficients in an interval, and would be locked by
        equations at more points than that. None if equations hold at every point instead: there are
        at most r + k of them, or they are not on the curve of the interval (Taylor schemes).
        """
        count = self.inner_modes + self.derivatives
        if len(self.points) <= count or not np.array_equal(self.table, self.rows(self.points)):
            return None
        return orthonormal_legendre(self.points, count)

    def rows(self, s: Array) -> Array:
        """The interpolant at s in [0, 1]: (q - q0, h v, h^2 a) over (h v0, Z0, Z1, c).

        s: shape (M,). Returns shape (M, 3, 3 + r). Cubic Hermite for r = 0.
        Raises InputError for positions beyond MAX_POSITION.
        """
        require_positions(s)
        if self.derivatives != 2:
            return jet_rows(s, self.derivatives, self.inner_modes)
        return interval_rows(s, self.inner_modes)

    def __reduce__(self) -> tuple[type[Scheme], tuple[object, ...]]:
        return Scheme, (self.name, self.order, self.points, self.weights, self.table)


@cache
def regular_from_nodal(inner_modes: int, k: int = 2) -> Array:
    """R of (q0, h v0, Z0, Z1, c) = R (q0, h v0, q1, h v1, c), shape (4 + r, 4 + r).

    For any k: Z_j = h^j q1^(j) - sum_{i >= j} h^i q0^(i) / (i - j)!, shape (2 k + r, 2 k + r).
    """
    R = np.eye(2 * k + inner_modes)
    for j in range(k):
        for i in range(j, k):
            R[k + j, i] = -1.0 / factorial(i - j)
    R.setflags(write=False)
    return R
