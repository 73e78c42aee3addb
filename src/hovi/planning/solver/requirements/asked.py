"""Conditions that a user puts to a motion: bounds of functions, at all times."""

from __future__ import annotations

from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.planning.conditions.condition import Bounded
from hovi.planning.solver.condition_excess import ConditionBounds
from hovi.planning.solver.requirements.requirement import SATISFIED, Requirement
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Asked(Requirement):
    """Conditions hold at all times, to their own tolerance or SATISFIED."""

    given: tuple[Bounded, ...]

    def violation(self, motion: Trajectory) -> str:
        """The first condition that is exceeded, where it is exceeded most."""
        for each in self.given:
            excess, sentence = ConditionBounds(each).worst(motion)
            if not excess <= max(SATISFIED, each.tolerance):
                return sentence
        return ""

    def margins(self, motion: Trajectory) -> dict[str, Any]:
        """Margins by the names of the conditions."""
        return {"conditions": {x.name: ConditionBounds(x).margin(motion) for x in self.given}}
