"""What a sequence keeps: in all of its segments, and in some, as conditions on parts of the motion.

A segment's conditions begin and end where it does. What they do not say is taken from its own ends,
if its start and its goal are known: those of a move over several segments are at its two ends.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from hovi.conditions.condition import Condition
from hovi.conditions.kept.keep import Keep
from hovi.conditions.kept.kinds import as_kept
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.kept_conditions import conditions_kept, goal_kept, kept_between
from hovi.planning.sequence.branches import End, MoveToGoal
from hovi.planning.sequence.segment import Segment, names_of
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Conditions = tuple[Condition[Any, Any], ...]


@dataclass(frozen=True, eq=False)
class KeptInSegments:
    """What a sequence keeps.

    kept: all along and in segments. conditions: of all of it. goals: of the moves, with the guesses
        to which ways along what is kept lead.
    """

    kept: tuple[Keep, ...]
    conditions: Conditions
    goals: tuple[End, ...]


def kept_in_segments(
    robot: Robot,
    whole: Sequence[Any],
    segments: Sequence[Segment],
    begin: State,
    moves: Sequence[MoveToGoal],
    reached: Sequence[End],
) -> KeptInSegments:
    """What is kept, and the goals.

    whole: what all segments keep. begin: the start. moves: as they were given; reached: their
    goals, of frames with the branches that were chosen for them. Raises InputError as
    `kept_between` and `conditions_kept` do.
    """
    every = list[Keep]()
    always = kept_between(as_kept(whole), robot, begin, reached[-1])
    found = list(conditions_kept(always, robot, begin, moves[-1].end))
    names, starts = names_of(segments), np.cumsum([0.0, *(x.seconds for x in segments)]).tolist()
    goals, before = list[End](), cast(End, begin)
    for move, goal in zip(moves, reached, strict=True):
        along = list(always)
        for number in move.numbers:
            first, last = number == move.numbers[0], number == move.numbers[-1]
            own = as_kept(segments[number].keep)
            ends = before if first else None, goal if last else None
            try:
                kept = kept_between(own, robot, *ends)
            except InputError as wrong:
                raise InputError(f"in {names[number]!r}, {wrong}") from None
            start = before if number == 0 else None
            length = starts[number + 1] - starts[number]
            part = starts[number], starts[number + 1]
            kept = tuple(
                dataclasses.replace(x, name=f"{x.title} in {names[number]}", during=part)
                for x in kept
            )
            found += conditions_kept(kept, robot, start, length)
            along += kept
            every += kept
        chosen = isinstance(move.goal, FrameGoal) and move.goal.guess is None
        if along and chosen and len(move.numbers) == 1:
            way = goal_kept(along, robot, before, move.goal, move.bounds, move.end - move.begin)
            goal = way if isinstance(way, FrameGoal) and way.guess is not None else goal
        goals.append(goal)
        before = _as_start(goal)
    return KeptInSegments((*always, *every), tuple(found), tuple(goals))


def _as_start(goal: End) -> End:
    """A goal as the start of what follows, a whole pose in the configuration chosen for it."""
    if not isinstance(goal, FrameGoal) or goal.guess is None:
        return goal
    whole = not goal.regional and all(
        each.rotation is not None and each.position is not None for each in goal.parts
    )
    return State(np.asarray(goal.guess)) if whole else goal
