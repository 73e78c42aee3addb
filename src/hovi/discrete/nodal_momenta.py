"""Momenta of a stationary motion, carried from node to node instead of evaluated at each."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi._native import intervals as native

Array = npt.NDArray[np.float64]

ROUNDING = 1e-13
"""Relative error over h/T of a momentum that is evaluated from a motion."""


def carried_momenta(derivatives: Array) -> Array:
    """Momenta (p, p~) at the nodes, shape (N + 1, 2, nv), p by its increments.

    p_k = -D1 L_d and p~_k = -D2 L_d of the interval that starts at node k, and D3 L_d, D4 L_d of
    the last. Evaluated so, p has an error like eps/h. Where the discrete Euler-Lagrange equations
    hold it is the sum of p_{k+1} - p_k = D1 L_d + D3 L_d as well, in which nothing cancels: the
    mean of what is evaluated, plus that sum, is right to eps.
    [ColomboFerraroMartin2016, corollary to theorem 2]

    derivatives: D1 .. D4 of every L_d, shape (N, 4, nv). Where p jumps at nodes, or the motion is
        not stationary to rounding, the evaluated p is returned.
    """
    N = len(derivatives)
    momenta = np.concatenate([-derivatives[:, :2], derivatives[-1:, 2:]])
    native.replace_by_prefix_sums(derivatives[:, 0] + derivatives[:, 2], ROUNDING * N, momenta)
    return momenta
