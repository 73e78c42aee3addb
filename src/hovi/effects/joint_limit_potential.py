"""The paper's penalty potential that keeps a joint in its range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np

from hovi.effects.effect import Effect, Touch, bracketed
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError, nearest
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot


@dataclass(frozen=True)
class JointLimitPotential(Effect):
    """V(q) = slope * sum over joints of r(lower - q) + r(q - upper), a term of the cost.

    With stops = true it is also a mechanical stop: tau_i += dV/dq_i, in planning and simulation.

    r is the ramp max(x, 0), made twice differentiable within `width` of its kink:
    r(x) = (x + w)^3 (3 w - x) / (16 w^3) for |x| < w. [ColomboFerraroMartin2016, section 5: the
    elbow, with slope 1000 between 0 and 170 degrees]

    ranges: (lower, upper) by joint name, in [rad] or [m].
    slope: of the cost, per [rad] or [m]; of stops too, in [N m] or [N].
    width: w > 0, in [rad] or [m].
    stops: whether it acts on the joints as well.
    """

    ranges: Mapping[str, tuple[float, float]]
    slope: float = 1000.0
    width: float = 1e-3
    stops: bool = False
    key: ClassVar[str] = "joint_limit_potential"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST, Touch.TORQUE)

    def check_values(self) -> None:
        """Raise SceneError for empty ranges, and invalid slopes and widths."""
        for name, value in (("slope", self.slope), ("width", self.width)):
            if not (np.isfinite(value) and value > 0):
                raise SceneError(
                    f"effect 'joint_limit_potential': {name} must be positive and finite, "
                    f"got {value:g}."
                )
        for joint, bounds in self.ranges.items():
            if len(bounds) != 2:
                raise SceneError(
                    f"effect 'joint_limit_potential': the range of {joint!r} must be two numbers, "
                    f"got {len(bounds)}."
                )
            if not bounds[0] < bounds[1]:
                raise SceneError(
                    f"effect 'joint_limit_potential': the range of {joint!r} must rise, "
                    f"got {bracketed(bounds)}."
                )

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints."""
        for joint in self.ranges:
            if joint not in _simple_joints(robot):
                raise SceneError(
                    f"effect 'joint_limit_potential': robot {robot.name!r} has no joint "
                    f"{joint!r} with one coordinate: {nearest(joint, _simple_joints(robot))}"
                )

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """V as a CasADi expression."""
        terms = []
        for joint, (lower, upper) in self.ranges.items():
            x = symbols.q[_simple_joints(robot)[joint]]
            terms += [smooth_ramp(lower - x, self.width), smooth_ramp(x - upper, self.width)]
        return self.slope * ca.sum1(ca.vertcat(*terms))

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """dV/dq of the joints with stops; None without stops."""
        if not self.stops or not self.ranges:
            return None
        rows = [ca.SX(0)] * robot.nv
        for joint, (lower, upper) in self.ranges.items():
            member = robot.model.joints[robot.model.getJointId(joint)]
            x = symbols.q[member.idx_q]
            pull = ramp_slope(x - upper, self.width) - ramp_slope(lower - x, self.width)
            rows[member.idx_v] = self.slope * pull
        return ca.vertcat(*rows)

    def describe(self) -> str:
        """One line for the description of a scene."""
        ranges = ", ".join(f"{j} in [{a:.6g}, {b:.6g}]" for j, (a, b) in self.ranges.items())
        stops = ", also a mechanical stop" if self.stops else ""
        return (
            f"joint_limit_potential: {ranges}; slope {self.slope:g} per rad or m, "
            f"smoothed over {self.width:g}{stops}"
        )


def _simple_joints(robot: Robot) -> dict[str, int]:
    """Index in q of every joint with nq = nv = 1."""
    model = robot.model
    joints = list(zip(model.names, model.joints, strict=True))[1:]
    return {name: joint.idx_q for name, joint in joints if joint.nq == joint.nv == 1}


def smooth_ramp(x: ca.SX, width: float) -> ca.SX:
    """max(x, 0), twice differentiable: (x + w)^3 (3 w - x) / (16 w^3) within w of the kink."""
    y = ca.fmin(ca.fmax(x + width, 0.0), 2 * width)
    return y**3 * (4 * width - y) / (16 * width**3) + ca.fmax(x - width, 0.0)


def ramp_slope(x: ca.SX, width: float) -> ca.SX:
    """The derivative of `smooth_ramp`: (x + w)^2 (2 w - x) / (4 w^3) within w, 0 and 1 outside."""
    y = ca.fmin(ca.fmax(x + width, 0.0), 2 * width)
    return y**2 * (3 * width - y) / (4 * width**3)
