"""The Lie groups of joints, SO(2), SE(2), SO(3) and SE(3): exp and log over batches.

Elements and tangent vectors are those of Pinocchio: (cos, sin); (x, y, cos, sin) with (v, w); a
unit quaternion (x, y, z, w) with w in the body frame; (p, quaternion) with (v, w). Tangent
vectors are left-invariant: g (+) d = g exp(d).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import groups as native
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Layout = npt.NDArray[np.int64]
"""Rows (kind, index in q, index in v, size in v) for the parts of a configuration."""


@dataclass(frozen=True)
class Group:
    """A Lie group.

    name: in files. kind: in layouts. nq: length of an element. nv: length of a tangent vector.
    angular: indices of the rotation in a tangent vector.
    se3_indices: indices of a tangent vector's entries in those of SE(3), (linear, angular); planes
        are normal to z.
    unit: indices of the entries of an element that have unit norm.
    parts: names of the entries of an element.
    """

    name: str
    kind: int
    nq: int
    nv: int
    angular: tuple[int, ...]
    se3_indices: tuple[int, ...]
    unit: tuple[int, ...]
    parts: tuple[str, ...]

    def integrate(self, g: Array, d: Array) -> Array:
        """g exp(d): elements (..., nq) and tangent vectors (..., nv) -> (..., nq)."""
        return integrated(self._layout, g, d)

    def difference(self, g0: Array, g1: Array) -> Array:
        """log(g0^-1 g1), with the smallest angle: elements (..., nq) -> (..., nv)."""
        return differenced(self._layout, g0, g1)

    def difference_near(self, g0: Array, g1: Array, expected: Array) -> Array:
        """As `difference`, plus the full turns that bring it closest to `expected`."""
        return differenced(self._layout, g0, g1, expected)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the entries of a position and a rotation vector, (nv,), for reports."""
        return tuple(_COORDINATES[index] for index in self.se3_indices)

    @property
    def _layout(self) -> Layout:
        return np.array([[self.kind, 0, 0, self.nv]])

    def normalized(self, g: Array) -> Array:
        """Elements (..., nq) with their unit entries normalized."""
        result = np.array(g, dtype=np.float64)
        part = result[..., list(self.unit)]
        size = np.sqrt(np.sum(part * part, axis=-1, keepdims=True))
        result[..., list(self.unit)] = part / size
        return result


def integrated(layout: Layout, q: Array, dq: Array) -> Array:
    """q (+) dq for configurations (..., nq) and tangent vectors (..., nv) -> (..., nq).

    Raises InputError for vectors of the wrong length.
    """
    nq, nv = _totals(layout)
    _check_length("configuration", nq, q)
    _check_length("tangent vector", nv, dq)
    lead = _common_rows(q, dq)
    result = np.empty((*lead, nq))
    native.integrate(layout, _rows(q, lead), _rows(dq, lead), result.reshape(-1, nq))
    return result


def differenced(layout: Layout, q0: Array, q1: Array, expected: Array | None = None) -> Array:
    """q1 (-) q0 for configurations (..., nq) -> tangent vectors (..., nv): see Group.

    Raises InputError for vectors of the wrong length.
    """
    nq, nv = _totals(layout)
    _check_length("configuration", nq, q0, q1)
    if expected is not None:
        _check_length("tangent vector", nv, expected)
    lead = _common_rows(q0, q1)
    result = np.empty((*lead, nv))
    if expected is not None and _common_rows(q0, q1, expected) != lead:
        raise InputError(
            f"the expected tangent vectors must broadcast to shape {(*lead, nv)}, got an array of "
            f"shape {expected.shape}."
        )
    near = None if expected is None else _rows(expected, lead)
    native.difference(layout, _rows(q0, lead), _rows(q1, lead), near, result.reshape(-1, nv))
    return result


def _totals(layout: Layout) -> tuple[int, int]:
    """(nq, nv) of a layout."""
    kind, q, v, size = layout[-1].tolist()
    return q + next((g.nq for g in GROUPS.values() if g.kind == kind), size), v + size


def _check_length(what: str, count: int, *arrays: Array) -> None:
    """Raise InputError for arrays of the wrong length, which compiled code does not check."""
    for array in arrays:
        came = array.shape[-1] if array.ndim else 0
        if came != count:
            raise InputError(
                f"a {what} has {count} numbers here, got {came} in an array of shape "
                f"{array.shape}: give (..., {count})."
            )


def _common_rows(*arrays: Array) -> tuple[int, ...]:
    """The shape to which rows (..., n) broadcast. Raises InputError."""
    leads = [array.shape[:-1] for array in arrays]
    try:
        return np.broadcast_shapes(*leads)
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise InputError(
            f"arrays of shape {shapes} must have the same number of rows, or one of them one row."
        ) from None


def _rows(x: Array, lead: tuple[int, ...]) -> Array:
    """(..., n) as contiguous rows (P, n)."""
    full = x if x.shape[:-1] == lead else np.broadcast_to(x, (*lead, x.shape[-1]))
    return numbers_of("rows", full).reshape(-1, x.shape[-1])


_COORDINATES = ("x", "y", "z", "rx", "ry", "rz")
_TURN = ("qx", "qy", "qz", "qw")
SO2 = Group("SO(2)", 1, 2, 1, (0,), (5,), (0, 1), ("cos", "sin"))
SE2 = Group("SE(2)", 2, 4, 3, (2,), (0, 1, 5), (2, 3), ("x", "y", "cos", "sin"))
SO3 = Group("SO(3)", 3, 4, 3, (0, 1, 2), (3, 4, 5), (0, 1, 2, 3), _TURN)
SE3 = Group("SE(3)", 4, 7, 6, (3, 4, 5), (0, 1, 2, 3, 4, 5), (3, 4, 5, 6), ("x", "y", "z", *_TURN))
GROUPS = {group.name: group for group in (SO2, SE2, SO3, SE3)}
