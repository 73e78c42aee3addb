"""The order of a discrete Lagrangian by its definition: the rate at which L_d tends to L_d^e.

[ColomboFerraroMartin2016, section 4.1; MarsdenWest2001, section 2.3]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian
from hovi.flows.legendre_transforms import legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VariationalOrder:
    """max |L_d - L_d^e| over solutions, for several steps.

    steps: h, shape (H,), in [s]. errors: shape (H,), in the units of the action.
    """

    steps: Array
    errors: Array

    @property
    def slopes(self) -> Array:
        """d log(error) / d log(h) between consecutive steps, shape (H - 1,)."""
        return np.asarray(np.diff(np.log(self.errors)) / np.diff(np.log(self.steps)))

    @property
    def order(self) -> float:
        """r of |L_d - L_d^e| <= C h^(r+1), by a least-squares fit."""
        return float(np.polyfit(np.log(self.steps), np.log(self.errors), 1)[0]) - 1.0


def variational_order(
    lagrangian: Lagrangian, scheme: Scheme, steps: Sequence[float], *jet: npt.ArrayLike
) -> VariationalOrder:
    """Measure |L_d - L_d^e| on the solutions that start at given jets, for every step.

    The difference may change sign along a motion, so the maximum over all solutions is taken.
    steps: h, in [s]. jet: (q, q', ..., q^(2k-1)), 2 k arrays of shape (S, n), one row per solution.
    Raises InputError if a step is too long for L_d^e.
    """
    x, p = legendre(lagrangian, *jet)
    errors = []
    for h in steps:
        exact = ExactDiscreteLagrangian(lagrangian, h).from_start(x, p)
        approximate = SchemeLagrangian(lagrangian, scheme, h).between(x, exact.w)
        errors.append(np.max(np.abs(approximate.values - exact.values)))
    return VariationalOrder(np.asarray(steps, dtype=np.float64), np.array(errors))
