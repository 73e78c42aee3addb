"""Conditions that have a key of their own in `limits`, with bounds by joint."""

from __future__ import annotations

from collections.abc import Callable

from hovi.planning.conditions.condition import Condition
from hovi.planning.conditions.places import AtPoints
from hovi.planning.conditions.power import power_limit
from hovi.planning.conditions.sets import Between
from hovi.robot.space.coordinates import Coordinates

Named = Callable[[Coordinates, dict[int, tuple[float, float]]], Condition[Between, AtPoints]]

NAMED: dict[str, Named] = {"power": power_limit}
"""What makes a condition of the bounds of joint coordinates, by the key."""
