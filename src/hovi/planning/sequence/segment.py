"""A segment of a sequence: where it leads, how long it takes, and what holds in it alone."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, fields
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_number, shown
from hovi.checks.names import require_name
from hovi.checks.shapes import numbers_of
from hovi.checks.tables import entries_of
from hovi.checks.units import DURATION_IN_WORDS, Duration, as_duration, seconds
from hovi.discrete.state import State
from hovi.effects import Effect
from hovi.effects.registration import as_effects
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import require_times
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.notation.ends import End, are_frames, as_end
from hovi.planning.search.job import stops_of
from hovi.planning.search.options import PlanOptions
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.conditions.kept.keep import Keep
    from hovi.planning.obstacles.grasped import Grasped

MAX_SEGMENTS = 1000
"""Largest number of segments of a sequence."""
_ONLY_AT_THE_END = ("a", "free_acceleration", "jerk", "free_jerk")
"""What the goal of the last segment alone may say."""


@check_arguments_except("goal", "duration", "effects", "limits", "keep", "grasped")
@dataclass(frozen=True, eq=False)
class Segment:
    """A segment of a sequence of motions, which `hovi.plan_sequence` plans together.

    goal: where it ends: a State, a configuration of shape (nq,) at rest, the name of a pose, a
        FrameGoal, a list of them, or a table as for `hovi.plan`. The motion stops there unless the
        goal gives velocities or leaves them free (`free_velocity`), and it does not stop where
        there is none (None).
    duration: T in [s], or a text such as "1.5 s"; or a pair (lower, upper) of these for a free one.
    effects: what acts in this segment besides the effects of the scene, such as the payload that is
        carried, also as tables by name; one of a kind that the scene has takes its place.
    limits: of this segment, as for `hovi.plan`; those of the options if None.
    keep: what this segment keeps besides what the whole motion does, as for `hovi.plan`; what is
        not said is taken from its own ends.
    grasped: hovi.Grasped, or tables of them: objects that links carry in this segment, with mass,
        shape, and names of what they may touch. The same object in segments that follow each other
        is carried through; in others it neither weighs nor is in the way.
    name: in messages and reports.
    Raises InputError for a duration that is not positive, and for a goal or limits of another kind,
    SceneError for effects that are none.
    """

    goal: End | None
    duration: Duration
    _: KW_ONLY
    effects: Sequence[Effect] = ()
    limits: str | Limits | Mapping[str, Any] | None = None
    keep: Sequence[Keep | Mapping[str, Any]] = ()
    grasped: Sequence[Grasped | Mapping[str, Any]] = ()
    name: str = ""

    def __post_init__(self) -> None:
        require_name(self.name, "a segment")
        object.__setattr__(self, "duration", duration_of_segment(self.duration))
        object.__setattr__(self, "effects", as_effects(self.effects))
        if not isinstance(self.keep, tuple) or self.keep:
            from hovi.conditions.kept.kinds import as_kept  # most segments keep nothing

            object.__setattr__(self, "keep", as_kept(self.keep))
        for kept in cast("tuple[Keep, ...]", self.keep):
            if kept.during is not None:
                raise InputError(
                    f"{kept.subject} is kept in a segment from its begin to its end, and has a "
                    "`during`: leave it out, or give it to the whole sequence."
                )
        if not isinstance(self.grasped, tuple) or self.grasped:
            from hovi.planning.obstacles.grasped import as_grasped  # most segments carry nothing

            object.__setattr__(self, "grasped", as_grasped(self.grasped))
        named = self.goal is None or isinstance(self.goal, State | FrameGoal | str | Mapping)
        if not named and not are_frames(self.goal):
            numbers_of("the goal of a segment", cast(npt.ArrayLike, self.goal))
        if self.limits is not None and not isinstance(self.limits, str | Limits | Mapping):
            raise InputError(
                "the limits of a segment are 'urdf', 'none', the name of an arm, a mapping or a "
                f"hovi.Limits, not {shown(self.limits)}."
            )

    @property
    def seconds(self) -> float:
        """T of a segment whose duration is given, in [s]."""
        assert isinstance(self.duration, float | int)
        return float(self.duration)


def duration_of_segment(given: Any) -> float | tuple[float, float]:
    """A duration in [s], or the bounds of a free one. Raises InputError."""
    if isinstance(given, list | tuple):
        return as_duration(given)
    T = seconds(given, "the duration of a segment")
    if not (math.isfinite(T) and T > 0):
        raise InputError(f"the duration of a segment must be positive, got {T} s.")
    return T


Table = Segment | Mapping[str, Any]
"""A segment, or its table in the words of a scene file."""


def as_segment(given: Table, number: int) -> Segment:
    """A segment, from one or from a table as [[segments]] in a scene file. Raises InputError.

    number: of the segment, from 0.
    """
    if isinstance(given, Segment):
        return given
    keys = [each.name for each in fields(Segment)]
    name = f"segments[{number}]"
    entries = entries_of(given, name, keys, {"duration": DURATION_IN_WORDS})
    T = entries["duration"]
    if is_number(T) and not (math.isfinite(T) and T > 0):
        raise InputError(f"`{name}.duration` must be {DURATION_IN_WORDS}, but it is {shown(T)}.")
    if "effects" in entries:
        entries["effects"] = as_effects(entries["effects"], f"{name}.effects")
    return Segment(entries.pop("goal", None), entries.pop("duration"), **entries)


def names_of(segments: Sequence[Segment]) -> tuple[str, ...]:
    """The names of the segments, by their numbers from 1 where they have none."""
    return tuple(each.name or f"segment {i}" for i, each in enumerate(segments, start=1))


def durations_of(segments: Sequence[Segment]) -> tuple[float | tuple[float, float], ...]:
    """The duration of each segment, in [s], or its bounds."""
    return tuple(duration_of_segment(each.duration) for each in segments)


def duration_of(segments: Sequence[Segment]) -> float | tuple[float, float]:
    """The duration of a sequence, in [s], or its bounds where that of a segment is free."""
    each = durations_of(segments)
    lower, upper = np.sum([T if isinstance(T, tuple) else (T, T) for T in each], axis=0)
    return (float(lower), float(upper)) if lower < upper else float(lower)


def with_durations(segments: Sequence[Segment], durations: Sequence[float]) -> tuple[Segment, ...]:
    """The segments with given durations."""
    pairs = zip(segments, durations, strict=True)
    return tuple(dataclasses.replace(each, duration=T) for each, T in pairs)


def goals_of(segments: Sequence[Segment], robot: Robot) -> tuple[State | FrameGoal | None, ...]:
    """The goals of the segments, as States or FrameGoals. Raises InputError."""
    named = ((f"segments[{i}].goal", each.goal) for i, each in enumerate(segments))
    return tuple(None if goal is None else as_end(goal, robot, name) for name, goal in named)


def checked_segments(segments: Any, options: PlanOptions) -> tuple[Segment, ...]:
    """The segments of a sequence. Raises InputError for what is no sequence.

    options: of its plan.
    """
    listed = isinstance(segments, Sequence)
    if not listed or not all(isinstance(x, Segment | Mapping) for x in segments):
        raise InputError(
            "segments must be a list of hovi.Segment(goal, duration), or of tables with a goal and "
            f"a duration, got {shown(segments)}."
        )
    if not 1 <= len(segments) <= MAX_SEGMENTS:
        raise InputError(f"a sequence has 1 to {MAX_SEGMENTS:,} segments, got {len(segments)}.")
    segments = [as_segment(each, i) for i, each in enumerate(segments)]
    names = names_of(segments)
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two segments have the name {twice!r}; give each its own name.")
    if segments[-1].goal is None:
        raise InputError(f"the last segment, {names[-1]!r}, needs a goal.")
    for name, segment in zip(names[:-1], segments[:-1], strict=True):
        for key in _ONLY_AT_THE_END:
            goal = segment.goal
            given = goal.get(key) if isinstance(goal, Mapping) else getattr(goal, key, None)
            if given is not None and np.size(given) > 0:
                raise InputError(
                    f"the goal of {name!r} takes no `{key}`, since accelerations are free where "
                    "segments meet: leave it out."
                )
    require_times(options.via)
    free = isinstance(duration_of(segments), tuple)
    if options.time_weight != 0 and not free:
        raise InputError(
            "time_weight needs a free duration: give a segment a pair (lower, upper), in [s]."
        )
    if free and len(segments) > 1 and stops_of(options):
        raise InputError(
            "via points and conditions at given times need segments of given durations: make them "
            "goals of segments, or give each duration as one number."
        )
    if options.turns is not None:
        raise InputError(
            "a sequence takes no `turns`: give them to the goal of a segment, "
            "hovi.State(q, turns={joint: 1})."
        )
    return tuple(segments)
