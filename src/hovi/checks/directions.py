"""Directions from vectors of any length."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def unit_vector(x: Array) -> Array:
    """x / |x| of a vector of finite numbers that are not all zero.

    Squares neither overflow nor underflow, as x is scaled by a power of two first.
    """
    _, exponent = math.frexp(float(np.max(np.abs(x))))
    scaled = np.ldexp(x, -exponent)
    return np.asarray(scaled / np.linalg.norm(scaled))
