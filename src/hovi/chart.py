"""The chart of an interval, q(t) = q0 (+) x(t), and its derivatives to second order.

Velocities and accelerations are v = J(x) x' and a = J(x) x'' + J' x'; the far end enters by
x1 = q1 (-) q0 and x1' = J(x1)^-1 v1. The chart moves with the interval's first node, so that L_d is
a function on TQ x TQ that keeps the left symmetries of L. For plain coordinates and continuous
joints x is what is added, and none of this is needed.

Second derivatives are those along `integrate`. With z = log(exp(-x) exp(x + dx)) a varied curve is
q exp(z), its velocity v - [z, v] + [z, [z, v]] / 2 + z' - [z, z'] / 2 to second order, and
z = J dx + (dJ . dx) dx / 2, so that the structure constants and the time derivatives of J are all
that is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.chart_functions import chart_functions
from hovi.configuration_space import ConfigurationSpace, Factor

Array = npt.NDArray[np.float64]
Jet = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Bend:
    """A map of one factor of Q, to second order.

    factor: the group. first: its Jacobian. second: the Hessian of its weighted outputs.
    """

    factor: Factor
    first: Array
    second: Array


@dataclass(frozen=True)
class Chart:
    """Curves q0 (+) x(t) on a configuration space; rows of arrays are points.

    space: the configuration space.
    """

    space: ConfigurationSpace

    def jet(self, q0: Array, x: Array, dx: Array, ddx: Array) -> Jet:
        """(q, v, a) of q0 (+) x(t): q0 (P, nq), x and its derivatives (P, nv)."""
        v, a = dx.copy(), ddx.copy()
        for factor in self.space.curved:
            i = factor.v
            J, J1, _ = chart_functions(factor.group).jacobians(x[:, i], dx[:, i], ddx[:, i])
            v[:, i] = _times(J, dx[:, i])
            a[:, i] = _times(J, ddx[:, i]) + _times(J1, dx[:, i])
        return self.space.integrate(q0, x), v, a

    def rates(self, x: Array, v: Array, a: Array | None = None) -> tuple[Array, Array]:
        """(x', x'') of a curve that is at x with velocity v and acceleration a (zero if None)."""
        dx = np.array(v)
        ddx = np.zeros_like(dx) if a is None else np.array(a)
        for factor in self.space.curved:
            i, functions = factor.v, chart_functions(factor.group)
            J = functions.jacobians(x[:, i], dx[:, i], dx[:, i])[0]
            dx[:, i] = np.linalg.solve(J, dx[:, i, None])[..., 0]
            J1 = functions.jacobians(x[:, i], dx[:, i], dx[:, i])[1]
            force = ddx[:, i] - _times(J1, dx[:, i])
            ddx[:, i] = np.linalg.solve(J, force[..., None])[..., 0]
        return dx, ddx

    def carried(self, jet: Jet, x: Array, dx: Array, ddx: Array) -> Jet:
        """(q, v, a) of q(t) (+) x(t) for a curve q(t) with the jet (q, v, a)."""
        q, v, a = jet
        moved, w, b = self.jet(q, x, dx, ddx)
        seen, turned = v + w, a + b
        for factor in self.space.curved:
            i, functions = factor.v, chart_functions(factor.group)
            J = functions.jacobians(x[:, i], dx[:, i], ddx[:, i])[0]
            back = _carried_back(functions.structure, x[:, i], J)
            seen[:, i] = _times(back, v[:, i]) + w[:, i]
            bracket = _times(_ad(functions.structure, w[:, i]), _times(back, v[:, i]))
            turned[:, i] = _times(back, a[:, i]) + b[:, i] - bracket
        return moved, seen, turned

    def points(self, x: Array, dx: Array, ddx: Array, weight: Array) -> list[Bend]:
        """How (q, v, a) depends on (q0, x, x', x''), q and q0 in the tangent, per curved factor.

        weight: of (q, v, a), shape (P, 3, nv). First (P, 3 k, 4 k), second (P, 4 k, 4 k).
        """
        return [
            Bend(f, *_point(f, x[:, f.v], dx[:, f.v], ddx[:, f.v], weight[:, :, f.v]))
            for f in self.space.curved
        ]

    def linear_points(self, x: Array, dx: Array, ddx: Array) -> list[tuple[Factor, Array]]:
        """The Jacobians of `points` alone."""
        return [
            (f, _variation(f, x[:, f.v], dx[:, f.v], ddx[:, f.v]).first) for f in self.space.curved
        ]

    def ends(self, x: Array, dx: Array, weight: Array) -> list[Bend]:
        """How (x1, x1') depends on (q0, q1, v1), in the tangent, per curved factor.

        weight: of (x1, x1'), shape (N, 2, nv). First (N, 2 k, 3 k), second (N, 3 k, 3 k).
        """
        return [
            Bend(f, *_end(f, x[:, f.v], dx[:, f.v], weight[:, :, f.v])) for f in self.space.curved
        ]


class _Variation:
    """First variations of (q, v, a) of q0 exp(x(t)); all arrays (P, k) or (P, k, k)."""

    def __init__(
        self, structure: Array, x: Array, dx: Array, ddx: Array, jacobians: list[Array]
    ) -> None:
        self.J, self.J1, self.J2 = J, J1, J2 = jacobians
        self.ad_v = _ad(structure, _times(J, dx))
        self.ad_a = _ad(structure, _times(J1, dx) + _times(J, ddx))
        self.back = _carried_back(structure, x, J)
        zero = np.zeros_like(J)
        # (z, z', z'') by (dx, dx', dx'')
        self.z = np.block([[J, zero, zero], [J1, J, zero], [J2, 2 * J1, J]])

    @property
    def first(self) -> Array:
        """(q, v, a) by (q0, x, x', x''), shape (P, 3 k, 4 k)."""
        P, k = self.J.shape[:2]
        D = np.zeros((P, 3 * k, 4 * k))
        z = self.z
        D[:, :, k:] = z
        D[:, k : 2 * k, k:] += self.ad_v @ z[:, :k]
        D[:, 2 * k :, k:] += self.ad_v @ z[:, k : 2 * k] + self.ad_a @ z[:, :k]
        D[:, :k, :k] = self.back
        return D


def _point(factor: Factor, x: Array, dx: Array, ddx: Array, weight: Array) -> tuple[Array, Array]:
    """First and second derivatives of one factor: see Chart.points."""
    functions = chart_functions(factor.group)
    structure, k = functions.structure, factor.group.nv
    variation = _variation(factor, x, dx, ddx)
    ad_v, ad_a = variation.ad_v, variation.ad_a
    n_q, n_v, n_a = weight[:, 0], weight[:, 1], weight[:, 2]
    # what weighs z, z' and z'' where they are of second order
    force0 = n_q + _times(_T(ad_v), n_v) + _times(_T(ad_a), n_a)
    force1 = n_v + _times(_T(ad_v), n_a)
    M2, M1, M0 = functions.curvature(x, dx, ddx, 2 * n_a, force1, force0)
    N_v, N_a = _pairing(structure, n_v), _pairing(structure, n_a)
    bent = _quadratic(-0.5 * _both(N_v @ ad_v + N_a @ ad_a), N_v + _both(N_a @ ad_v), N_a)
    H = np.zeros((len(x), 4 * k, 4 * k))
    H[:, k:, k:] = _T(variation.z) @ bent @ variation.z
    a, b, c = slice(k, 2 * k), slice(2 * k, 3 * k), slice(3 * k, 4 * k)
    H[:, a, a] += M0
    H[:, b, b] += M2
    for row, column, block in (
        (a, b, M1),
        (a, c, 0.5 * M2),
        (slice(0, k), a, 0.5 * _T(variation.back) @ _pairing(structure, n_q) @ variation.J),
    ):
        H[:, row, column] += block
        H[:, column, row] += _T(block)
    return variation.first, H


def _variation(factor: Factor, x: Array, dx: Array, ddx: Array) -> _Variation:
    functions = chart_functions(factor.group)
    return _Variation(functions.structure, x, dx, ddx, functions.jacobians(x, dx, ddx))


def _quadratic(zz: Array, zdz: Array, zddz: Array) -> Array:
    """The Hessian in (z, z', z'') with blocks zz, -zdz / 2 and -zddz / 2, (P, 3 k, 3 k)."""
    zero = np.zeros_like(zz)
    first, second = -0.5 * zdz, -0.5 * zddz
    return np.block([[zz, first, second], [_T(first), zero, zero], [_T(second), zero, zero]])


def _end(factor: Factor, x: Array, dx: Array, weight: Array) -> tuple[Array, Array]:
    """First and second derivatives of one factor: see Chart.ends.

    From q1 = q0 (+) x1 and v1 = J(x1) x1', which are differentiated implicitly.
    """
    structure, k = chart_functions(factor.group).structure, factor.group.nv
    still = np.zeros_like(x)
    variation = _variation(factor, x, dx, still)
    inverse: Array = np.asarray(np.linalg.inv(variation.J))
    slope = variation.J1 + variation.ad_v @ variation.J  # dv/dx
    force_v = _times(_T(inverse), weight[:, 1])
    force_q = _times(_T(inverse), weight[:, 0] - _times(_T(slope), force_v))
    D = np.zeros((len(x), 2 * k, 3 * k))
    D[:, :k, :k], D[:, :k, k : 2 * k] = -inverse @ variation.back, inverse
    D[:, k:, : 2 * k] = -inverse @ slope @ D[:, :k, : 2 * k]
    D[:, k:, 2 * k :] = inverse
    forces = np.stack([force_q, force_v, still], axis=1)
    bent = _point(factor, x, dx, still, forces)[1][:, k : 3 * k, k : 3 * k]
    H = -_T(D) @ bent @ D
    cross = -0.5 * _T(variation.back) @ _pairing(structure, force_q)
    H[:, :k, k : 2 * k] += cross
    H[:, k : 2 * k, :k] += _T(cross)
    return D, H


def _times(matrix: Array, vector: Array) -> Array:
    """Matrices (P, r, c) on vectors (P, c)."""
    return np.asarray(np.matmul(matrix, vector[..., None])[..., 0])


def _T(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def _both(matrix: Array) -> Array:
    return matrix + _T(matrix)


def _ad(structure: Array, x: Array) -> Array:
    """The matrices of y -> [x, y], (P, k, k)."""
    k = x.shape[1]
    return (x @ structure.transpose(1, 0, 2).reshape(k, -1)).reshape(-1, k, k)


def _pairing(structure: Array, n: Array) -> Array:
    """The matrices of x, y -> n . [x, y], (P, k, k)."""
    k = n.shape[1]
    return (n @ structure.reshape(k, -1)).reshape(-1, k, k)


def _carried_back(structure: Array, x: Array, J: Array) -> Array:
    """Ad of exp(-x), 1 - ad_x J(x), (P, k, k)."""
    return np.eye(x.shape[1]) - _ad(structure, x) @ J
