"""The groups that joints move on, SO(2), SE(2), SO(3) and SE(3): exp and log over batches.

Elements and tangent vectors are those of Pinocchio: (cos, sin); (x, y, cos, sin) with (v, w); a
unit quaternion (x, y, z, w) with w in the body's axes; (p, quaternion) with (v, w). Tangent
vectors are left-invariant: g (+) d = g exp(d).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.lie_groups import _charts

Array = npt.NDArray[np.float64]
Layout = npt.NDArray[np.int64]
"""Rows (kind, place in q, place in v, size in v) for the parts of a configuration."""

SERIES_BELOW = 1.0
"""Angles squared below which coefficients are summed as series."""
NO_TURN = 1e-9
"""Turn, in [rad], below which its axis says nothing."""


@dataclass(frozen=True)
class Group:
    """One of the groups.

    name: as files name it. kind: as layouts name it. nq: numbers of an element. nv: of a tangent
        vector.
    angular: places of the rotation in a tangent vector.
    unit: places in an element of what has unit norm.
    parts: names of an element's numbers.
    """

    name: str
    kind: int
    nq: int
    nv: int
    angular: tuple[int, ...]
    unit: tuple[int, ...]
    parts: tuple[str, ...]
    _turn: Callable[[Array, Array], Array]
    _log: Callable[[Array, Array, Array], Array]

    def integrate(self, g: Array, d: Array) -> Array:
        """g exp(d): elements (..., nq) and tangent vectors (..., nv) -> (..., nq)."""
        return integrated(np.array([[self.kind, 0, 0, self.nv]]), g, d)

    def difference(self, g0: Array, g1: Array) -> Array:
        """log(g0^-1 g1): elements (..., nq) -> (..., nv), of the least angle."""
        return self._log(g0, g1, self._turn(g0, g1))

    def difference_near(self, g0: Array, g1: Array, expected: Array) -> Array:
        """As `difference`, with the full turns that come nearest to an expected answer."""
        w, wanted = self._turn(g0, g1), expected[..., list(self.angular)]
        size = np.sqrt(np.sum(w * w, axis=-1, keepdims=True))
        reach = np.sqrt(np.sum(wanted * wanted, axis=-1, keepdims=True))
        # where nothing turns, full turns are about the axis that is expected
        still = wanted / np.where(reach > 0, reach, 1.0)
        axis = np.where(size > NO_TURN, w / np.where(size > 0, size, 1.0), still)
        turns = np.round((np.sum(axis * wanted, axis=-1, keepdims=True) - size) / (2 * np.pi))
        return self._log(g0, g1, w + 2 * np.pi * turns * axis)

    def normalized(self, g: Array) -> Array:
        """Elements (..., nq) with their unit part of unit norm."""
        result = np.array(g, dtype=np.float64)
        part = result[..., list(self.unit)]
        size = np.sqrt(np.sum(part * part, axis=-1, keepdims=True))
        result[..., list(self.unit)] = part / size
        return result


def integrated(layout: Layout, q: Array, dq: Array) -> Array:
    """q (+) dq for configurations (..., nq) and tangent vectors (..., nv) -> (..., nq)."""
    lead = np.broadcast_shapes(q.shape[:-1], dq.shape[:-1])
    starts = np.ascontiguousarray(np.broadcast_to(q, (*lead, q.shape[-1])), dtype=np.float64)
    steps = np.ascontiguousarray(np.broadcast_to(dq, (*lead, dq.shape[-1])), dtype=np.float64)
    result = np.empty_like(starts)
    rows = starts.reshape(-1, q.shape[-1]), steps.reshape(-1, dq.shape[-1])
    _charts.integrate(layout, *rows, result.reshape(-1, q.shape[-1]))
    return result


def _rotate(c: Array, p: Array) -> Array:
    """The product of complex numbers (real, imaginary): p turned by c."""
    real = c[..., 0] * p[..., 0] - c[..., 1] * p[..., 1]
    return np.stack([real, c[..., 1] * p[..., 0] + c[..., 0] * p[..., 1]], axis=-1)


def _angle_between(g0: Array, g1: Array) -> Array:
    cosine = np.sum(g0 * g1, axis=-1)
    sine = g0[..., 0] * g1[..., 1] - g0[..., 1] * g1[..., 0]
    return np.asarray(np.arctan2(sine, cosine))


def _so2_turn(g0: Array, g1: Array) -> Array:
    return _angle_between(g0, g1)[..., None]


def _turn_alone(g0: Array, g1: Array, w: Array) -> Array:
    return w


def _se2_turn(g0: Array, g1: Array) -> Array:
    return _so2_turn(g0[..., 2:], g1[..., 2:])


def _se2_log(g0: Array, g1: Array, turn: Array) -> Array:
    w = turn[..., 0]
    back = g0[..., 2:] * np.array([1.0, -1.0])
    p = _rotate(back, g1[..., :2] - g0[..., :2])
    along = 1.0 - w * w * half_cotangent(w * w)  # (w / 2) cot(w / 2)
    v = _rotate(np.stack([along, -0.5 * w], axis=-1), p)
    return np.concatenate([v, turn], axis=-1)


def quaternion_product(a: Array, b: Array) -> Array:
    """a b, shape (..., 4)."""
    vector = a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3] + np.cross(a[..., :3], b[..., :3])
    scalar = a[..., 3:] * b[..., 3:] - np.sum(a[..., :3] * b[..., :3], axis=-1, keepdims=True)
    return np.concatenate([vector, scalar], axis=-1)


def rotated(quaternion: Array, x: Array) -> Array:
    """R x for a unit quaternion, shape (..., 3)."""
    u, w = quaternion[..., :3], quaternion[..., 3:]
    t = 2.0 * np.cross(u, x)
    return np.asarray(x + w * t + np.cross(u, t))


def conjugate(quaternion: Array) -> Array:
    """The quaternion of the inverse rotation."""
    return np.asarray(quaternion * np.array([-1.0, -1.0, -1.0, 1.0]))


def _so3_turn(g0: Array, g1: Array) -> Array:
    product = quaternion_product(conjugate(g0), g1)
    product = np.where(product[..., 3:] < 0, -product, product)
    u, w = product[..., :3], product[..., 3:]
    size = np.sqrt(np.sum(u * u, axis=-1, keepdims=True))
    tiny = size < 1e-150
    angle = 2.0 * np.arctan2(size, w)
    return np.asarray(np.where(tiny, 2.0, angle / np.where(tiny, 1.0, size)) * u)


def _se3_turn(g0: Array, g1: Array) -> Array:
    return _so3_turn(g0[..., 3:], g1[..., 3:])


def _se3_log(g0: Array, g1: Array, w: Array) -> Array:
    p = rotated(conjugate(g0[..., 3:]), g1[..., :3] - g0[..., :3])
    across = np.cross(w, p)
    square = np.sum(w * w, axis=-1, keepdims=True)
    v = p - 0.5 * across + half_cotangent(square) * np.cross(w, across)
    return np.concatenate([v, w], axis=-1)


def half_cotangent(square: Array) -> Array:
    """(1 - (t / 2) cot(t / 2)) / t^2 of t^2, for |t| < 2 pi."""
    # (t / 2) cot(t / 2) = sum_k B_2k (-1)^k t^2k / (2 k)!, with Bernoulli's numbers
    series = np.zeros_like(square)
    for c in reversed(_COTANGENT):
        series = series * square + c
    t = np.sqrt(np.maximum(square, SERIES_BELOW))
    closed = (1.0 - 0.5 * t * np.cos(0.5 * t) / np.sin(0.5 * t)) / t**2
    return np.where(square < SERIES_BELOW, series, closed)


_COTANGENT = (
    1 / 12,
    1 / 720,
    1 / 30240,
    1 / 1209600,
    1 / 47900160,
    691 / 1307674368000,
    1 / 74724249600,
    3617 / 10670622842880000,
    43867 / 5109094217170944000,
    174611 / 802857662698291200000,
    77683 / 14101100039391805440000,
)

_TURN = ("qx", "qy", "qz", "qw")
SO2 = Group("SO(2)", 1, 2, 1, (0,), (0, 1), ("cos", "sin"), _so2_turn, _turn_alone)
SE2 = Group("SE(2)", 2, 4, 3, (2,), (2, 3), ("x", "y", "cos", "sin"), _se2_turn, _se2_log)
SO3 = Group("SO(3)", 3, 4, 3, (0, 1, 2), (0, 1, 2, 3), _TURN, _so3_turn, _turn_alone)
SE3 = Group("SE(3)", 4, 7, 6, (3, 4, 5), (3, 4, 5, 6), ("x", "y", "z", *_TURN), _se3_turn, _se3_log)
GROUPS = {group.name: group for group in (SO2, SE2, SO3, SE3)}
