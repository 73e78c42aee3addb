"""Limits on the power of joints, tau v."""

from __future__ import annotations

import casadi as ca

from hovi.conditions.condition import Condition
from hovi.conditions.places import AtPoints
from hovi.conditions.sets import Between
from hovi.robot.space.coordinates import Coordinates


def power_limit(
    coordinates: Coordinates, bounds: dict[int, tuple[float, float]]
) -> Condition[Between, AtPoints]:
    """lower <= tau_i v_i <= upper, in [W]; bounds: by index in v."""
    joints = list(bounds)
    lower, upper = zip(*bounds.values(), strict=True)

    def power(tau: ca.SX, v: ca.SX) -> list[ca.SX]:
        return [tau[i] * v[i] for i in joints]

    names = tuple(coordinates.coordinate_names[i] for i in joints)
    return Condition(power, Between(lower, upper), name="power", unit="W", of=names)
