"""Conditions that have a key of their own in `limits`, with bounds by joint."""

from __future__ import annotations

from collections.abc import Callable

from hovi.conditions.condition import Condition
from hovi.conditions.places import AtPoints
from hovi.conditions.power import power_limit
from hovi.conditions.sets import Between
from hovi.robot.space.coordinates import Coordinates

Named = Callable[[Coordinates, dict[int, tuple[float, float]]], Condition[Between, AtPoints]]

NAMED: dict[str, Named] = {"power": power_limit}
"""What makes a condition of the bounds of joint coordinates, by the key."""
