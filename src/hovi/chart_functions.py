"""The right Jacobian of exp on SE(2), SO(3) and SE(3) along curves, and how it bends.

A curve g exp(x(t)) has the velocity v = J(x) x' and the acceleration a = J(x) x'' + J' x' with J
the right Jacobian and J' its rate. On SO(3), with u = |x|^2,

    J(x) = (1 - u C) - B [x]_x + C x x^T,  B = (1 - cos |x|) / u,  C = (1 - sin |x| / |x|) / u

where B and C are entire functions of u, so that nothing is singular at zero; SE(3) is SO(3) over
dual numbers, SE(2) and SO(3) are parts of SE(3). [Barfoot2024, section 8.1.5]
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from math import factorial

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.lie_groups import GROUPS, SE2, SE3, SO3, Group
from hovi.point_function import PointFunction
from hovi.truncated import Truncated

Array = npt.NDArray[np.float64]

_PLACES = {SE2.name: (0, 1, 5), SO3.name: (3, 4, 5), SE3.name: (0, 1, 2, 3, 4, 5)}
"""Where the tangent vectors of a group stand in those of SE(3), (v, w)."""


@dataclass(frozen=True)
class ChartFunctions:
    """The chart x -> g exp(x) of one group; k is its dimension.

    name: of the group, one of SE(2), SO(3), SE(3).
    """

    name: str

    @property
    def group(self) -> Group:
        """The group."""
        return GROUPS[self.name]

    @cached_property
    def structure(self) -> Array:
        """c of [x, y]_i = sum c_ijk x_j y_k, shape (k, k, k)."""
        full = np.zeros((6, 6, 6))
        for i, j, k, sign in _CROSS:
            full[3 + i, 3 + j, 3 + k] = sign
            full[i, 3 + j, k] = sign  # w1 x v2
            full[i, j, 3 + k] = sign  # v1 x w2
        places = list(_PLACES[self.name])
        return np.ascontiguousarray(full[np.ix_(places, places, places)])

    @cached_property
    def jacobians(self) -> PointFunction:
        """(x, x', x'') -> J and its first and second rate, (k, k) each."""
        x, dx, ddx = self._symbols("x", "dx", "ddx")
        J = self._jacobian(_curve(*(self._motion(y) for y in (x, dx, ddx))))
        return PointFunction(ca.Function("J", [x, dx, ddx], [J[0], J[1], 2 * J[2]]))

    @cached_property
    def curvature(self) -> PointFunction:
        """(x, x', x'', n0, n1, n2) -> the coefficients of 1, t and t^2 of M(x(t); n(t)), (k, k).

        M(x; n) is the symmetric part of the matrix of y, z -> n . (dJ(x) . y) z, and n(t) is
        n0 + n1 t + n2 t^2.
        """
        x, dx, ddx = self._symbols("x", "dx", "ddx")
        n = self._symbols("n0", "n1", "n2")
        motion = _curve(*(self._motion(y) for y in (x, dx, ddx)))
        force = Truncated({})
        for power, part in enumerate(n):
            force = force + _at(power, *self._force(part))
        bent = self._bent(motion, force)
        return PointFunction(ca.Function("M", [x, dx, ddx, *n], bent))

    def _symbols(self, *names: str) -> list[ca.SX]:
        return [ca.SX.sym(name, self.group.nv) for name in names]

    def _full(self, x: ca.SX) -> ca.SX:
        """A vector of the group as one of SE(3)."""
        full = ca.SX.zeros(6)
        full[list(_PLACES[self.name])] = x
        return full

    def _motion(self, x: ca.SX) -> tuple[ca.SX, ca.SX]:
        """The rotation and the translation of a tangent vector."""
        full = self._full(x)
        return full[3:], full[:3]

    def _force(self, n: ca.SX) -> tuple[ca.SX, ca.SX]:
        """A covector's parts: n . y is the part in e of (n_v + e n_w) . (y_w + e y_v)."""
        full = self._full(n)
        return full[:3], full[3:]

    def _jacobian(self, x: Truncated) -> list[ca.SX]:
        """The coefficients of J(x(t)), (k, k) each."""
        u = x.product(x, ca.dot)
        B, C = u.entire(_cosine), u.entire(_sine)
        eye = _constant(ca.SX.eye(3))
        J = eye.product(_constant(ca.SX(1)) - u.product(C)) - B.product(x.map(ca.skew))
        J = J + C.product(x.product(x, _outer))
        return [self._part(J[i, 0], J[i, 1], J[i, 0]) for i in range(3)]

    def _bent(self, x: Truncated, n: Truncated) -> list[ca.SX]:
        """The coefficients of M(x(t); n(t)), (k, k) each."""
        u, xn = x.product(x, ca.dot), x.product(n, ca.dot)
        C, dB, dC = u.entire(_sine), u.entire(_cosine, 1), u.entire(_sine, 1)
        M = (-0.5 * C - u.product(dC)).product(_symmetric(x, n))
        M = M - dB.product(_symmetric(x, n.product(x, ca.cross)))
        M = M + dC.product(xn).product(_symmetric(x, x))
        M = M + C.product(xn).product(_constant(ca.SX.eye(3)))
        zero = ca.SX.zeros(3, 3)
        return [self._part(zero, M[i, 0], M[i, 1], M[i, 0]) for i in range(3)]

    def _part(self, top: ca.SX, right: ca.SX, bottom: ca.SX, left: ca.SX | None = None) -> ca.SX:
        """The rows and columns of the group in a matrix of SE(3) made of four blocks."""
        left = ca.SX.zeros(3, 3) if left is None else left
        full = ca.vertcat(ca.horzcat(top, right), ca.horzcat(left, bottom))
        places = list(_PLACES[self.name])
        return full[places, places]


@cache
def chart_functions(group: Group) -> ChartFunctions:
    """The chart of a group, built once."""
    return ChartFunctions(group.name)


_CROSS = (
    (0, 1, 2, 1.0),
    (1, 2, 0, 1.0),
    (2, 0, 1, 1.0),
    (0, 2, 1, -1.0),
    (2, 1, 0, -1.0),
    (1, 0, 2, -1.0),
)
"""The cross product: its entries (i, j, k) with their signs."""


def _cosine(k: int) -> float:
    """Of (1 - cos t) / t^2 as a series in t^2."""
    return (-1.0) ** k / factorial(2 * k + 2)


def _sine(k: int) -> float:
    """Of (t - sin t) / t^3 as a series in t^2."""
    return (-1.0) ** k / factorial(2 * k + 3)


def _constant(x: ca.SX) -> Truncated:
    return Truncated({(0, 0): x})


def _at(power: int, real: ca.SX, dual: ca.SX) -> Truncated:
    return Truncated({(power, 0): real, (power, 1): dual})


def _curve(x: tuple[ca.SX, ca.SX], dx: tuple[ca.SX, ca.SX], ddx: tuple[ca.SX, ca.SX]) -> Truncated:
    """x + x' t + x'' t^2 / 2."""
    return _at(0, *x) + _at(1, *dx) + 0.5 * _at(2, *ddx)


def _outer(x: ca.SX, y: ca.SX) -> ca.SX:
    return ca.mtimes(x, y.T)


def _symmetric(x: Truncated, y: Truncated) -> Truncated:
    """x y^T + y x^T."""
    return x.product(y, lambda a, b: _outer(a, b) + _outer(b, a))
