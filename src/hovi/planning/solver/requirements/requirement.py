"""A requirement: conditions of one kind, and what a whole motion violates of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from hovi.discrete.trajectory import Trajectory

SATISFIED = 1e-6
"""Excess over a limit relative to its range, and distance in [rad] or [m], up to which a motion
satisfies a requirement."""


class Requirement(ABC):
    """Conditions of one kind that a problem puts to its motions."""

    @abstractmethod
    def violation(self, motion: Trajectory) -> str:
        """The condition that a motion violates most, as a clause; "" if all hold to SATISFIED.

        Raises OutOfTimeError when the deadline in force passes before that is known.
        """

    def margins(self, motion: Trajectory) -> dict[str, Any]:
        """How far a motion stays from violating them, as fields of Margins; none by default."""
        return {}
