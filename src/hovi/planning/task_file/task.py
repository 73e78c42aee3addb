"""Task: a scene, the ends of a motion, its duration and the options of the plan."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import field
from typing import Any, Self

from hovi.checks.arguments import check_arguments_except
from hovi.checks.units import as_duration, in_words
from hovi.discrete.state import State
from hovi.errors import InputError, warn
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.ends import as_end
from hovi.planning.search.option_fields import option_infos
from hovi.planning.search.options import PlanOptions
from hovi.planning.sequence.segment import (
    Segment,
    Table,
    checked_segments,
    duration_of,
    goals_of,
    names_of,
)
from hovi.scene.scene import Scene
from hovi.system.dataclass import dataclass
from hovi.system.summary import Summarized, Summary


@check_arguments_except("start", "goal", "duration")
@dataclass(frozen=True, eq=False, repr=False)
class Task(Summarized):
    """A planning task, valid once built.

    scene: the robot and the effects that act on it.
    start, goal: the ends of the motion, q in [rad] or [m], v in [rad/s] or [m/s], or a FrameGoal;
        whatever else `hovi.plan` takes is converted.
    duration: in [s], or the bounds of a free duration; a text such as "1.5 s" is converted.
    options: of the plan; `with_options` changes some of them.
    name: of the task in reports.
    segments: of a sequence, as for `hovi.plan_sequence`: see `of_segments`.
    note: what is assumed of its file, as a sentence; it is said when the task is planned.
    Raises InputError for an invalid duration and for options that do not fit the robot.
    """

    scene: Scene
    start: State | FrameGoal
    goal: State | FrameGoal
    duration: float | tuple[float, float]
    options: PlanOptions = field(default_factory=PlanOptions)
    name: str = "task"
    segments: tuple[Segment, ...] = ()
    note: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", as_duration(self.duration))
        for name in ("start", "goal"):
            given = as_end(getattr(self, name), self.scene.robot, name)
            object.__setattr__(self, name, given)
        if self.segments and self.duration != duration_of(self.segments):
            raise InputError(
                f"the duration of a sequence is that of its segments, "
                f"{in_words(duration_of(self.segments))}, got {self.duration}: change theirs."
            )
        self.options.on(self.scene)

    def _summary(self) -> Summary:
        free = ", free" if isinstance(self.duration, tuple) else ""
        bounds = f"{in_words(self.duration)}{free}"
        effects = ", ".join(each.key for each in self.scene.effects)
        rows = [("robot", self.scene.robot.name), ("effects", effects), ("duration", bounds)]
        if self.segments:
            rows.append(("segments", ", ".join(names_of(self.segments))))
        return Summary(f"Task {self.name!r}", tuple(rows))

    @classmethod
    def of_segments(
        cls,
        scene: Scene,
        start: State | FrameGoal,
        segments: Sequence[Table],
        options: PlanOptions | None = None,
        name: str = "task",
    ) -> Self:
        """The task of a sequence, which ends at the goal of its last segment.

        Arguments as for `hovi.plan_sequence`, and the name of the task in reports.
        Raises InputError for an invalid sequence.
        """
        chosen = PlanOptions() if options is None else options
        checked = checked_segments(segments, chosen)
        goal = goals_of(checked, scene.robot)[-1]
        assert goal is not None
        return cls(scene, start, goal, duration_of(checked), chosen, name, checked)

    def __getattr__(self, name: str) -> Any:
        """An option by its own name, as tasks had it before: deprecated, use task.options."""
        if name not in option_infos(PlanOptions):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        message = f"task.{name} is now task.options.{name}, and task.with_options changes it."
        warn(message, DeprecationWarning)
        return getattr(self.options, name)

    def require_one_motion(self, what: str) -> None:
        """Raise InputError for a sequence. what: needs one motion, such as "an effect study"."""
        if self.segments:
            raise InputError(
                f"{what} takes one motion, and task {self.name!r} has {len(self.segments)} "
                "segments: give it a scene file without [[segments]]."
            )

    @property
    def keeps(self) -> bool:
        """Whether the motion keeps something, in all of it or in a segment."""
        return bool(self.options.keep) or any(each.keep for each in self.segments)

    @property
    def held_scene(self) -> Scene:
        """The scene with what its robot holds, and with the shapes of what segments carry."""
        held = self.options.holding(self.scene)
        if not any(each.grasped for each in self.segments):
            return held
        from hovi.planning.sequence.carried import scene_carrying  # most carry nothing

        return scene_carrying(held, self.segments)

    @property
    def planned_scene(self) -> Scene:
        """The scene with what its robot holds, and with the effects of the objective."""
        return self.options.aiming(self.held_scene)

    @property
    def start_state(self) -> State:
        """The start, where it has to be a state. Raises InputError for a FrameGoal."""
        if isinstance(self.start, State):
            return self.start
        raise InputError(
            f"task {self.name!r} starts where frame {self.start.frame!r} is at its target, which "
            "only a plan chooses: give the start joint positions, such as those of "
            "hovi.inverse_kinematics."
        )

    def with_options(self, **changes: Any) -> Self:
        """The task with some of its options changed.

        changes: as for PlanOptions. Raises InputError for an unknown option.
        """
        note = "" if "self_collision" in changes else self.note
        return dataclasses.replace(self, options=self.options.with_changes(**changes), note=note)
