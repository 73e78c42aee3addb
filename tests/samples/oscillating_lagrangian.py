"""A Lagrangian whose stationary motions are saddles of a known index."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from samples.joint_lagrangian import JointLagrangian

Array = npt.NDArray[np.float64]

HORIZONS = {6.2: 0, 6.4: 1, 9.1: 2, 12.7: 3}
"""Durations T and the number of roots of 2 - 2 cos t = t sin t below them: the index of a motion
of a joint with L = (a^2 - v^2)/2 between fixed ends."""
FREE_HORIZONS = {4.4: 0, 4.6: 1, 7.8: 2, 11.0: 3}
"""Durations T and the number of roots of tan t = t below them: with a free velocity at T."""


@dataclass(frozen=True, eq=False)
class OscillatingLagrangian(JointLagrangian):
    """L = 1/2 sum (a_i^2 - bend_i v_i^2): joints that do not interact."""

    bends: tuple[float, ...]

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        return np.asarray(np.sum(jet[2] ** 2 - np.array(self.bends) * jet[1] ** 2, axis=1) / 2)

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        (P, n), bends = jet[2].shape, np.array(self.bends)
        gradient, hessian = np.zeros((P, 3, n)), np.zeros((P, 3, n, 3, n))
        gradient[:, 1], gradient[:, 2] = -bends * jet[1], jet[2]
        for i in range(n):
            hessian[:, 1, i, 1, i] = -bends[i]
            hessian[:, 2, i, 2, i] = 1.0
        return self.value(*jet), gradient, hessian
