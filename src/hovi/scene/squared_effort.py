"""Weighted squares of residuals at points, and their gradients."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native

Array = npt.NDArray[np.float64]


def weighted_square(residuals: Array, metric: Array, weights: Array) -> float:
    """sum_p w_p 1/2 r^T diag(R) r.

    residuals: r at the points, shape (P, n). metric: R, shape (n,). weights: w, shape (P,).
    """
    return native.weighted_square(np.ascontiguousarray(residuals), metric, weights)


def expand_squares(
    residuals: Array, metric: Array, jacobian: Array, force: Array | None = None
) -> tuple[Array, Array]:
    """1/2 r^T diag(R) r at each point, (P,), and J^T (diag(R) r + force), (P, k).

    residuals: r, shape (P, n). metric: R, shape (n,). jacobian: J = dr/dx, shape (P, n, k).
    force: added to diag(R) r, shape (P, n); none when None.
    """
    points, _, k = jacobian.shape
    values, gradient = np.empty(points), np.empty((points, k))
    r, J = np.ascontiguousarray(residuals), np.ascontiguousarray(jacobian)
    added = None if force is None else np.ascontiguousarray(force)
    native.expand_squares(r, metric, J, added, values, gradient)
    return values, gradient


def predict(residuals: Array, metric: Array, jacobian: Array, change: Array) -> Array:
    """diag(R) (r + J dx), shape (P, n).

    change: dx, shape (P, k); the others as for `expand_squares`.
    """
    predicted = np.empty(residuals.shape)
    r, J = np.ascontiguousarray(residuals), np.ascontiguousarray(jacobian)
    native.predict(r, metric, J, np.ascontiguousarray(change), predicted)
    return predicted
