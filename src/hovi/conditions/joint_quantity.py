"""One quantity of some joints, of which limits are bounds, and which vanishes at passive joints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.conditions.function import Function, Points, Slopes
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

QUANTITIES = {
    "q": "position",
    "v": "velocity",
    "a": "acceleration",
    "tau": "torque",
    "jerk": "jerk",
    "torque_rate": "torque rate",
}
"""The quantities, in the order of the rows of `Limits`, and their names in messages."""
DERIVATIVES = {"q": 0, "v": 1, "a": 2, "jerk": 3}
"""The quantities that are derivatives of the coordinates, and their order."""


@dataclass(frozen=True, eq=False)
class JointQuantity(Function):
    """The coordinate of some joints, its derivative of some order, their torque or its rate.

    quantity: one of QUANTITIES. joints: indices in v, shape (size,). space: of the configurations;
    None for a vector space. on: has names and units, in messages.
    """

    quantity: str
    joints: npt.NDArray[np.intp]
    space: ConfigurationSpace | None = None
    on: Coordinates | None = None

    @property
    def needs(self) -> frozenset[str]:
        """The quantity."""
        return frozenset({self.quantity})

    @property
    def size(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def values(self, at: Points) -> Array:
        """It, in the unit of each joint, shape (P, size)."""
        if self.quantity == "q" and self.space is not None:
            return self.space.coordinates(at.q)[:, self.joints]
        return at.argument(self.quantity)[:, self.joints]

    def slopes(self, at: Points) -> Slopes:
        """One for each joint, where its coordinate is its tangent."""
        J = np.eye(at.v.shape[1])[self.joints]
        return {self.quantity: np.broadcast_to(J, (len(at.v), *J.shape))}

    def named(self, entry: int) -> tuple[str, str] | None:
        """The quantity and the joint, and its unit."""
        if self.on is None:
            return None
        joint = self.joints[entry]
        name = f"the {QUANTITIES[self.quantity]} of joint {self.on.coordinate_names[joint]!r}"
        return name, getattr(self.on.coordinate_units[joint], self.quantity)
