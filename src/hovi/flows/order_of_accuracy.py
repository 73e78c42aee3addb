"""The order of a discrete Lagrangian by its definition: the rate at which L_d tends to L_d^e.

[ColomboFerraroMartin2016, section 4.1; MarsdenWest2001, section 2.3]
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.errors import InputError
from hovi.flows.exact_lagrangian import ExactDiscreteLagrangian, approximation
from hovi.flows.legendre_transforms import legendre
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import Scheme
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

SLOPE_BAND = 0.08
"""Largest range of the slopes of a reliable order, relative to the largest slope."""
INTEGER_BAND = 0.25
"""Largest distance of a reliable order from an integer."""
ROUNDING = 100 * float(np.finfo(float).eps)
"""Error relative to the action below which it may be rounding."""


@dataclass(frozen=True, eq=False)
class VariationalOrder:
    """max |L_d - L_d^e| over solutions, for several steps.

    steps: h, shape (H,), in [s]. errors: shape (H,), in the units of the action.
    mean_errors: the mean of |L_d - L_d^e| over solutions, shape (H,). actions: the largest
        |L_d^e|, shape (H,).
    """

    steps: Array
    errors: Array
    mean_errors: Array
    actions: Array

    @property
    def slopes(self) -> Array:
        """d log(error) / d log(h) between consecutive steps, shape (H - 1,)."""
        return _slopes(self.steps, self.errors)

    @property
    def order(self) -> float:
        """r of |L_d - L_d^e| <= C h^(r+1), by a least-squares fit."""
        return float(np.polyfit(np.log(self.steps), np.log(self.errors), 1)[0]) - 1.0

    @property
    def reliable(self) -> bool:
        """Whether the errors fall as a power of h does, so that `order` means something."""
        return not self.reason

    @property
    def reason(self) -> str:
        """Why `order` is not reliable, in one sentence; "" if it is.

        The slopes between consecutive steps, those of the largest and of the mean error alike,
        must agree to `SLOPE_BAND`, and the order lie within `INTEGER_BAND` of an integer. The
        largest error alone may be that of one solution, whose slopes agree before they are right.
        """
        if not 3 <= len(self.steps) == np.unique(self.steps).size:
            return "it takes three different steps or more, for slopes that can be compared."
        lost = self.errors <= ROUNDING * self.actions
        if lost.any():
            return (
                f"the error is {self.errors[lost][0]:.1g} at h = {self.steps[lost][0]:g} s, which "
                "may be rounding; take larger steps."
            )
        slopes = np.append(self.slopes, _slopes(self.steps, self.mean_errors))
        apart = np.ptp(slopes) > SLOPE_BAND * np.abs(slopes).max()
        if apart or abs(self.order - round(self.order)) > INTEGER_BAND:
            return (
                f"between consecutive steps the order is {slopes.min() - 1:.2f} to "
                f"{slopes.max() - 1:.2f}, not one integer: the errors do not fall as a power of h "
                "yet; take smaller steps."
            )
        return ""

    def __str__(self) -> str:
        """The order, and why it is not reliable if so."""
        order = f"order {self.order:.2f}" if (self.errors > 0).all() else "no order"
        return f"{order}, not reliable: {self.reason}" if self.reason else order


@check_arguments
def variational_order(
    lagrangian: Lagrangian, scheme: Scheme, steps: Sequence[float], *jet: npt.ArrayLike
) -> VariationalOrder:
    """Measure |L_d - L_d^e| on the solutions that start at given jets, for every step.

    The difference may change sign along a motion, so the maximum over all solutions is taken. If
    the steps are too large for their errors to have an order, or so small that these are rounding,
    `reliable` of the result is false and `reason` says so.
    steps: h, in [s], three or more. jet: (q, q', ..., q^(2k-1)), 2 k arrays of shape (S, n), one
        row per solution.
    Raises InputError if a step is too long for L_d^e.
    """
    if not len(steps):
        raise InputError("steps must hold three steps or more, got none.")
    x, p = legendre(lagrangian, *map(np.atleast_2d, jet))
    found = []
    for h in steps:
        exact = ExactDiscreteLagrangian(lagrangian, h).from_start(x, p)
        approximate = approximation(lagrangian, scheme, h).between(x, exact.w)
        error = np.abs(approximate.values - exact.values)
        found.append((h, error.max(), error.mean(), np.abs(exact.values).max()))
    return VariationalOrder(*np.array(found, dtype=np.float64).T)


def _slopes(steps: Array, errors: Array) -> Array:
    return np.asarray(np.diff(np.log(errors)) / np.diff(np.log(steps)))
