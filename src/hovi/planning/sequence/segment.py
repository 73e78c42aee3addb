"""A segment of a sequence: where it leads, how long it takes, and what holds in it alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import shown
from hovi.checks.shapes import numbers_of
from hovi.discrete.state import State
from hovi.effects import Effect
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.ends import as_end
from hovi.planning.problem.units import seconds
from hovi.planning.search.options import PlanOptions
from hovi.robot.robot import Robot
from hovi.scene.scene import as_effects

MAX_SEGMENTS = 1000
"""Largest number of segments of a sequence."""
_ONLY_AT_THE_END = ("a", "free_acceleration", "jerk", "free_jerk")
"""What the goal of the last segment alone may say."""


@check_arguments_except("goal", "duration", "effects", "limits")
@dataclass(frozen=True, eq=False)
class Segment:
    """A segment of a sequence of motions, which `hovi.plan_sequence` plans together.

    goal: where it ends: a State, a configuration of shape (nq,) at rest, the name of a pose, or a
        FrameGoal. The motion stops there unless the goal gives velocities or leaves them free
        (`free_velocity`), and it does not stop where there is none (None).
    duration: T in [s], or a text such as "1.5 s".
    effects: what acts in this segment beside the effects of the scene, such as the payload that is
        carried; one of a kind that the scene has takes its place.
    limits: of this segment, as for `hovi.plan`; those of the options if None.
    name: in messages and reports.
    Raises InputError for a duration that is not positive, and for a goal or limits of another kind,
    SceneError for effects that are none.
    """

    goal: State | FrameGoal | npt.ArrayLike | str | None
    duration: float
    _: KW_ONLY
    effects: Sequence[Effect] = ()
    limits: str | Limits | Mapping[str, Any] | None = None
    name: str = ""

    def __post_init__(self) -> None:
        T = seconds(self.duration, "the duration of a segment")
        if not (math.isfinite(T) and T > 0):
            raise InputError(f"the duration of a segment must be positive, got {T} s.")
        object.__setattr__(self, "duration", T)
        object.__setattr__(self, "effects", as_effects(self.effects))
        if self.goal is not None and not isinstance(self.goal, State | FrameGoal | str):
            numbers_of("the goal of a segment", self.goal)
        if self.limits is not None and not isinstance(self.limits, str | Limits | Mapping):
            raise InputError(
                "the limits of a segment are 'urdf', 'none', the name of an arm, a mapping or a "
                f"hovi.Limits, not {shown(self.limits)}."
            )


def names_of(segments: Sequence[Segment]) -> tuple[str, ...]:
    """The names of the segments, by their numbers from 1 where they have none."""
    return tuple(each.name or f"segment {i}" for i, each in enumerate(segments, start=1))


def duration_of(segments: Sequence[Segment]) -> float:
    """The duration of a sequence, in [s]."""
    return float(sum(each.duration for each in segments))


def as_goal(given: Any, robot: Robot) -> State | FrameGoal:
    """A goal, or a start, as a State or a FrameGoal. Raises InputError for an unknown pose."""
    return as_end(given, robot, "goal")


def checked_segments(segments: Any, options: PlanOptions) -> tuple[Segment, ...]:
    """The segments of a sequence. Raises InputError for what is no sequence.

    options: of its plan.
    """
    if not isinstance(segments, Sequence) or not all(isinstance(x, Segment) for x in segments):
        raise InputError(
            f"segments must be a list of hovi.Segment(goal, duration), got {shown(segments)}."
        )
    if not 1 <= len(segments) <= MAX_SEGMENTS:
        raise InputError(f"a sequence has 1 to {MAX_SEGMENTS:,} segments, got {len(segments)}.")
    names = names_of(segments)
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two segments have the name {twice!r}; give each its own name.")
    if segments[-1].goal is None:
        raise InputError(f"the last segment, {names[-1]!r}, needs a goal.")
    for name, segment in zip(names[:-1], segments[:-1], strict=True):
        for key in _ONLY_AT_THE_END:
            given = getattr(segment.goal, key, None)
            if given is not None and np.size(given) > 0:
                raise InputError(
                    f"the goal of {name!r} takes no `{key}`, since accelerations are free where "
                    "segments meet: leave it out."
                )
    if options.time_weight != 0:
        raise InputError("time_weight needs a free duration, and those of segments are fixed.")
    if options.turns is not None:
        raise InputError("a sequence takes no `turns`, since its joints make no full turns.")
    return tuple(segments)
