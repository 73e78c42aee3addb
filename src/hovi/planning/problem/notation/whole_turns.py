"""Full turns of continuous joints that the angles of a goal ask for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import MAX_TURNS, State
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.turns import remainder, turns_of

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def says_turns(goal: State, on: Coordinates) -> Mask:
    """The joints whose goal is an angle beyond (-pi, pi], which says its full turns, (nv,)."""
    return np.asarray(turns_of(goal.angles_on(on)) != 0)


def turns_to(goal: State, start: State, on: Coordinates, stops: Sequence[Array]) -> Array:
    """Full turns to a goal beyond the shortest path, shape (nv,): see `State.turns_on`.

    Those that the goal adds, and those up to an angle beyond (-pi, pi], which says them.
    stops: configurations (nq,) from the start to the goal. Raises InputError for a joint of which
    both are given, and as `turns_on` does.
    """
    added, angles, said = goal.turns_on(on, "goal"), goal.angles_on(on), says_turns(goal, on)
    if not said.any():
        return added
    for i in np.flatnonzero(said & (added != 0)):
        raise InputError(
            f"goal.turns: the goal of joint {on.joint_at(int(i))!r}, {angles[i]:g} rad, says its "
            "full turns: give an angle from -pi to pi, or leave out `turns`."
        )
    changes = [on.difference(*pair) for pair in pairwise(stops)]
    begun = remainder(stops[0], on.space) + 2 * np.pi * turns_of(start.angles_on(on))
    further = np.round((angles - begun - np.sum(changes, axis=0)) / (2 * np.pi))
    for i in np.flatnonzero(said & (abs(further) > MAX_TURNS)):
        raise InputError(
            f"the goal of joint {on.joint_at(int(i))!r}, {angles[i]:g} rad, is "
            f"{abs(further[i]):,.0f} turns away: at most {MAX_TURNS:,} are planned."
        )
    return np.asarray(np.where(said, further, added))


def turns_missed(goal: State, on: Coordinates, reached: Array) -> str:
    """By how many full turns a motion misses the angle of its goal, as a clause; "" if none.

    reached: the angles of the joints at its end, shape (nv,), in [rad].
    """
    angles = goal.angles_on(on)
    away = np.round((reached - angles) / (2 * np.pi))
    missed = np.where(says_turns(goal, on), away, 0.0)
    i = int(np.argmax(np.abs(missed)))
    if not missed.any():
        return ""
    turns = "a full turn" if abs(missed[i]) == 1 else f"{abs(missed[i]):.0f} full turns"
    return f"ends {turns} from the goal of {on.joint_at(i)!r}, {angles[i]:g} rad"
