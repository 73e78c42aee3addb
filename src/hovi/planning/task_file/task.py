"""Task: all that a person says before a motion can be planned."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Self

from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.units import as_duration
from hovi.planning.search.options import PlanOptions
from hovi.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Task:
    """A planning task, valid once built.

    scene: the robot and the effects that act on it.
    start, goal: the two ends of the motion, q in [rad] or [m], v per second; the goal may be one
        of a frame.
    duration: length of the motion, in [s], or the bounds of a free one; a text such as "1.5 s"
        becomes the number.
    options: how it is planned; `with_options` changes some of them.
    name: what the task is called in reports.
    Raises InputError for numbers that make no task and for options that do not fit the robot.
    """

    scene: Scene
    start: State
    goal: State | FrameGoal
    duration: float | tuple[float, float]
    options: PlanOptions = field(default_factory=PlanOptions)
    name: str = "task"

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", as_duration(self.duration))
        ends = self.duration if isinstance(self.duration, tuple) else (self.duration,)
        if not all(math.isfinite(each) and each > 0 for each in ends):
            raise InputError(f"duration must be a positive number of seconds, not {self.duration}.")
        self.options.on(self.scene.robot)

    def with_options(self, **changes: Any) -> Self:
        """The task with some of its options changed.

        changes: what PlanOptions takes. Raises InputError for an unknown option.
        """
        return dataclasses.replace(self, options=self.options.with_changes(**changes))
