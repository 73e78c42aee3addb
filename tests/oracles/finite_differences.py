"""Derivatives of any function by central differences of fourth order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_STENCIL = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))


def derivative(f: Callable[[Array], Array], x: Array, step: float = 1e-3) -> Array:
    """df/dx by (f(x-2h) - 8 f(x-h) + 8 f(x+h) - f(x+2h)) / 12h, shape f.shape + x.shape.

    The error is h^4/30 of the fifth derivative, and rounding of about eps |f| / h.
    """
    columns = []
    for i in range(x.size):
        direction = np.zeros(x.size)
        direction[i] = step
        moved = [w * np.asarray(f(x + k * direction.reshape(x.shape))) for k, w in _STENCIL]
        columns.append(sum(moved) / step)
    return np.stack(columns, axis=-1).reshape(*np.shape(columns[0]), *x.shape)


def derivative_per_point(f: Callable[[Array], Array], x: Array, step: float = 1e-3) -> Array:
    """As `derivative` for a batch: f maps (P, m) to (P, ...) point by point; (P, ..., m)."""
    columns = []
    for i in range(x.shape[1]):
        direction = step * np.eye(x.shape[1])[i]
        columns.append(sum(w * np.asarray(f(x + k * direction)) for k, w in _STENCIL) / step)
    return np.stack(columns, axis=-1)
