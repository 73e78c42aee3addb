"""The difference of joints from a state, as at an end, a seam or a via point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import TOLERANCE
from hovi.conditions.function import Function, Points, Slopes
from hovi.conditions.joint_quantity import DERIVATIVES, QUANTITIES
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class StateDifference(Function):
    """(q, v, ...) (-) jet, in the prescribed components.

    Its curvature vanishes at its root, and is taken as zero.

    jet: a configuration, shape (nq,), and its first rates, shape (nv,) each. held: which components
    are prescribed, shape (len(jet), nv). verb: what a motion does there, in messages.
    """

    coordinates: Coordinates
    jet: Sequence[Array]
    held: npt.NDArray[np.bool_]
    verb: str = ""

    @property
    def needs(self) -> frozenset[str]:
        """q and the rates."""
        return frozenset(self._names)

    @property
    def size(self) -> int:
        """Number of prescribed components."""
        return int(self.held.sum())

    def values(self, at: Points) -> Array:
        """The prescribed components of the differences, shape (P, size)."""
        return self._errors(at)[:, self.held]

    def slopes(self, at: Points) -> Slopes:
        """Derivatives in q and the rates."""
        J = np.stack([self._slope(q)[self.held] for q in at.q])
        return {name: J[:, :, i] for i, name in enumerate(self._names)}

    def describe(self, at: Points, missed: Array) -> str:
        """The joint with the largest error; with a verb, those of q and of each rate."""
        errors, on, found = np.abs(self._errors(at)[0]) * self.held, self.coordinates, []
        for name, error in zip(self._names, errors, strict=True):
            i = int(np.argmax(error))
            kind, joint = QUANTITIES[name], on.coordinate_names[i]
            if not self.verb and error[i] == errors.max():
                return f"the {kind} of joint {joint!r} misses it by {error[i]:.3g}"
            if error[i] > TOLERANCE:
                unit = getattr(on.coordinate_units[i], name)
                found.append(f"{error[i]:.3g} {unit} from the {kind} of {joint!r}")
        return f"{self.verb} {' and '.join(found)}"

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(DERIVATIVES)[: len(self.jet)]

    def _slope(self, q: Array) -> Array:
        """Of all components in q and the rates, shape (m, nv, m, nv)."""
        n, m = self.coordinates.nv, len(self.jet)
        J = np.eye(m * n).reshape(m, n, m, n)
        if not self.coordinates.vector_joints:
            J[0, :, 0] = self.coordinates.chart.end_slope(
                self.coordinates.difference(self.jet[0], q)
            )
        return J

    def _errors(self, at: Points) -> Array:
        """Of all components, shape (P, m, nv)."""
        positions = np.stack([self.coordinates.difference(self.jet[0], q) for q in at.q])
        pairs = zip(self._names[1:], self.jet[1:], strict=True)
        return np.stack([positions, *(at.argument(x) - rate for x, rate in pairs)], axis=1)
