"""What a terminal or a notebook shows of a motion."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hovi.discrete.output.caution import cautions_of
from hovi.system.summary import Summarized, Summary

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

DIGITS = 6
"""Significant digits of numbers."""


class TrajectorySummary(Summarized):
    """A motion: robot, duration, grid and what is recorded of its solution."""

    grid: Any
    metadata: Mapping[str, Any]

    @property
    @abstractmethod
    def robot(self) -> Robot | None:
        """The robot; None without one."""

    @property
    @abstractmethod
    def coordinate_names(self) -> tuple[str, ...]:
        """One name per velocity."""

    @property
    def cautions(self) -> tuple[str, ...]:
        """What its plan said of the motion beyond its numbers, a sentence each.

        Such as that its grid is coarse, what was left out, or why it is no minimum. None for a
        motion of another origin, or from a file of an earlier version.
        """
        return tuple(each.sentence for each in cautions_of(self.metadata))

    def _summary(self) -> Summary:
        name = "a robot" if self.robot is None else repr(self.robot.name)
        rows = [("grid", self.grid.in_words), ("joints", ", ".join(self.coordinate_names))]
        for key in ("status", "cost"):
            value = self.metadata.get(key)
            if value is not None:
                shown = f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
                rows.append((key, shown))
        words = dict.fromkeys(each.word for each in cautions_of(self.metadata))
        if words:
            rows.append(("cautions", ", ".join(words)))
        return Summary(f"Trajectory of {name}, {self.grid.duration:g} s", tuple(rows))
