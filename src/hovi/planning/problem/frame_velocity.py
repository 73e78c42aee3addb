"""The velocity that a frame has at its goal, as equations of q and v."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.conditions.expression import function_of
from hovi.conditions.function import Curvature, Function, Points, Slopes
from hovi.dynamics.symbolic_dynamics import functions_of
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrameVelocity(Function):
    """p' - velocity, then omega - angular velocity, of those that are asked for.

    frame: its name. of: the function of q and v.
    """

    frame: str
    of: Function

    @classmethod
    def asked(
        cls, robot: Robot, frame: str, linear: Array | None, angular: Array | None
    ) -> FrameVelocity:
        """That of a frame's origin, in [m/s], and of its turn, in [rad/s], along the world's axes.

        linear, angular: (3,), None where it is free.
        """
        placed = functions_of(robot).frame_placement(frame)

        def missed(q: ca.SX, v: ca.SX) -> ca.SX:
            (R, p), rate = placed(q), configuration_rate(robot.model, q, v)
            rows = []
            if linear is not None:
                rows.append(ca.jtimes(p, q, rate) - ca.DM(linear))
            if angular is not None:
                spin = ca.reshape(ca.jtimes(ca.vec(R), q, rate), 3, 3) @ R.T
                rows.append(ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0]) - ca.DM(angular))
            return ca.vertcat(*rows)

        return cls(frame, function_of(missed, f"velocity of {frame}", robot))

    @property
    def needs(self) -> frozenset[str]:
        """See Function."""
        return self.of.needs

    @property
    def size(self) -> int:
        """See Function."""
        return self.of.size

    def values(self, at: Points) -> Array:
        """See Function."""
        return self.of.values(at)

    def slopes(self, at: Points) -> Slopes:
        """See Function."""
        return self.of.slopes(at)

    def curvature(self, at: Points, weights: Array) -> Curvature:
        """See Function."""
        return self.of.curvature(at, weights)

    def describe(self, at: Points, missed: Array) -> str:
        """By how much the frame misses its velocity."""
        return f"frame {self.frame!r} misses its velocity by {np.linalg.norm(missed):.3g}"
