"""Task: a scene, the ends of a motion, its duration and the options of the plan."""

from __future__ import annotations

import dataclasses
import math
import warnings
from dataclasses import dataclass, field
from typing import Any, Self

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.units import as_duration
from hovi.planning.search.option_fields import option_infos
from hovi.planning.search.options import PlanOptions
from hovi.scene.scene import Scene


@check_arguments_except("duration")
@dataclass(frozen=True, eq=False)
class Task:
    """A planning task, valid once built.

    scene: the robot and the effects that act on it.
    start, goal: the ends of the motion, q in [rad] or [m], v in [rad/s] or [m/s]; the goal may be
        a FrameGoal.
    duration: in [s], or the bounds of a free duration; a text such as "1.5 s" is converted.
    options: of the plan; `with_options` changes some of them.
    name: of the task in reports.
    Raises InputError for an invalid duration and for options that do not fit the robot.
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
            raise InputError(
                f"the duration must be a positive number of seconds, got {self.duration}."
            )
        self.options.on(self.scene)

    def __getattr__(self, name: str) -> Any:
        """An option by its own name, as tasks had it before: deprecated, use task.options."""
        if name not in option_infos(PlanOptions):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        message = f"task.{name} is now task.options.{name}, and task.with_options changes it."
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(self.options, name)

    def with_options(self, **changes: Any) -> Self:
        """The task with some of its options changed.

        changes: as for PlanOptions. Raises InputError for an unknown option.
        """
        return dataclasses.replace(self, options=self.options.with_changes(**changes))
