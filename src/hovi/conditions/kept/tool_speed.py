"""Limits on the speed and on the acceleration of a frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

import casadi as ca
import numpy as np
import pinocchio as pin

from hovi.checks.units import acceleration, angular_speed, speed
from hovi.conditions.condition import Condition
from hovi.conditions.kept.keep import Conditions, EndPoses, KeepFrame, placement, root
from hovi.conditions.places import AtPoints
from hovi.conditions.sets import Between
from hovi.effects.expressions.formula_symbols import frame_column
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.configuration_rate import configuration_rate
from hovi.system.dataclass import dataclass

ROUNDED = 1e-9
"""Relative excess over a speed that is rounding."""


@dataclass(frozen=True, eq=False)
class ToolSpeed(KeepFrame):
    """The speed of a frame's origin, |p'| <= linear, and of its turn, |w| <= angular.

    linear: in [m/s] or as "250 mm/s". angular: in [rad/s] or as "30 deg/s". One of them at least.
    """

    linear: float | str | None = None
    angular: float | str | None = None
    kind: ClassVar[str] = "tool_speed"

    def check_values(self) -> None:
        """See Keep."""
        if self.linear is None and self.angular is None:
            raise InputError(f"{self.subject} needs a speed: give `linear` or `angular`.")
        if self.linear is not None:
            speed(self.linear, f"`linear` of {self.subject}")
        if self.angular is not None:
            angular_speed(self.angular, f"`angular` of {self.subject}")

    def require_time(self, ends: EndPoses, longest: float) -> None:
        """See Keep."""
        first, last = ends.start(self.frame), ends.goal(self.frame)
        if self.during is not None:
            return
        if self.linear is not None and first.position is not None and last.position is not None:
            way = float(np.linalg.norm(last.position - first.position))
            self._require(way, speed(self.linear, self.subject), longest, "m")
        if self.angular is not None and first.rotation is not None and last.rotation is not None:
            turn = float(np.linalg.norm(pin.log3(first.rotation.T @ last.rotation)))
            self._require(turn, angular_speed(self.angular, self.subject), longest, "rad")

    def _require(self, way: float, fastest: float, longest: float, unit: str) -> None:
        if way > fastest * longest * (1.0 + ROUNDED):
            raise InputError(
                f"{self.subject} allows {fastest:.4g} {unit}/s, and the frame moves by {way:.4g} "
                f"{unit} in {longest:.4g} s: give more than {way / fastest:.4g} s, or more speed."
            )

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)
        at, found = placement(robot, self.frame), list[Condition[Between, AtPoints]]()

        def linear(q: ca.SX, v: ca.SX) -> ca.SX:
            return ca.sumsqr(_derivative(robot, self.frame, q, v))

        def angular(q: ca.SX, v: ca.SX) -> ca.SX:
            turn = ca.jtimes(ca.vec(at(q)[0]), q, configuration_rate(robot.model, q, v))
            return ca.sumsqr(turn) / 2  # |w|^2 of R' = [w] R

        if self.linear is not None:
            found.append(_at_most(speed(self.linear, self.subject), linear, self.title, "m/s"))
        if self.angular is not None:
            title = f"{self.title} (turn)" if found else self.title
            found.append(
                _at_most(angular_speed(self.angular, self.subject), angular, title, "rad/s")
            )
        return tuple(found)


@dataclass(frozen=True, eq=False)
class ToolAcceleration(KeepFrame):
    """The acceleration of a frame's origin, |p''| <= linear.

    linear: in [m/s^2] or as "2 m/s^2".
    """

    linear: float | str
    kind: ClassVar[str] = "tool_acceleration"

    def check_values(self) -> None:
        """See Keep."""
        acceleration(self.linear, self.subject)

    def conditions(self, robot: Robot) -> Conditions:
        """See Keep."""
        self.check(robot)

        def squared(q: ca.SX, v: ca.SX, a: ca.SX) -> ca.SX:
            return ca.sumsqr(_derivative(robot, self.frame, q, v, a))

        return (_at_most(acceleration(self.linear, self.subject), squared, self.title, "m/s^2"),)


def _derivative(robot: Robot, frame: str, q: ca.SX, v: ca.SX, a: ca.SX | None = None) -> ca.SX:
    """The velocity of a frame's origin, or its acceleration, (3,)."""
    order, rest = (1, ca.SX.zeros(robot.nv)) if a is None else (2, a)
    return frame_column(robot, SceneSymbols(q, v, rest, ca.SX.sym("t")), order, frame)


def _at_most(
    size: float, squared: Callable[..., ca.SX], title: str, unit: str
) -> Condition[Between, AtPoints]:
    """A size whose square is a function of the motion."""
    on = Between(upper=size**2)
    return Condition(squared, on, name=title, unit=unit, scale=size**2, read=root)
