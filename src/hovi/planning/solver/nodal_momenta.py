"""Momenta of a stationary motion, accumulated along the nodes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native

Array = npt.NDArray[np.float64]

ROUNDING = 1e-13
"""Relative rounding error, times h/T, of a momentum evaluated at a node."""


def accumulated_momenta(derivatives: Array) -> Array:
    """Momenta (p, p~) at the nodes, shape (N + 1, 2, nv), p by its increments.

    p_k = -D1 L_d and p~_k = -D2 L_d of the interval that starts at node k, and D3 L_d, D4 L_d of
    the last. Evaluated directly, p has an error like eps/h. If the discrete Euler-Lagrange
    equations hold, p_{k+1} - p_k = D1 L_d + D3 L_d without cancellation: the prefix sums of these
    increments plus the mean of the evaluated p are accurate to eps.
    [ColomboFerraroMartin2016, corollary to theorem 2]

    derivatives: D1 .. D4 of every L_d, shape (N, 4, nv); for another order k than 2, of shape
        (N, 2 k, nv), the momenta are returned as evaluated, (N + 1, k, nv). If p jumps at
        nodes, or the motion is not stationary to rounding, the evaluated p is returned.
    """
    N, k = len(derivatives), derivatives.shape[1] // 2
    momenta = np.ascontiguousarray(np.concatenate([-derivatives[:, :k], derivatives[-1:, k:]]))
    if k != 2:
        return momenta
    increments = np.ascontiguousarray(derivatives[:, 0] + derivatives[:, 2])
    native.replace_by_prefix_sums(increments, ROUNDING * N, momenta)
    return momenta
