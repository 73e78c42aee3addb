"""Viscous joint friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect
from hovi.effects.expressions.joint_values import (
    JointValues,
    in_words,
    joint_values,
    of_urdf,
    require_one_source,
)
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """tau_i += d_i v_i. [SicilianoKhatib2016, sec. 7.2]

    coefficient: d, 0 or more, in [N m s/rad] or [N s/m].
    from_urdf: use the `damping` of the URDF instead.
    """

    coefficient: JointValues | None = None
    from_urdf: bool = False
    key: ClassVar[str] = "viscous_friction"

    def check(self, robot: Robot) -> None:
        """Raise SceneError for negative values, unknown joints, or a URDF without damping."""
        self.values(robot)

    def values(self, robot: Robot) -> npt.NDArray[np.float64]:
        """d of every joint coordinate, shape (nv,)."""
        require_one_source(self.key, "coefficient", self.coefficient, self.from_urdf)
        if self.coefficient is None:
            return of_urdf(robot, self.key, "damping", robot.damping)
        return joint_values(robot, "effect 'viscous_friction': coefficient", self.coefficient, 0)

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """d v."""
        return ca.SX(ca.DM(self.values(robot))) * symbols.v

    def describe(self) -> str:
        """One line for the description of a scene."""
        return f"viscous_friction: {in_words(self.coefficient, 'N m s/rad (N s/m)')}"
