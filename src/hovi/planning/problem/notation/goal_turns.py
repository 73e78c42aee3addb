"""Full turns of continuous joints that the angles of a goal ask for."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.state import MAX_TURNS, State
from hovi.errors import InputError
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.joint_table import with_angles
from hovi.robot.space.turns import known_or, nearest_angles, remainder, turns_of

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def says_turns(goal: State, on: Coordinates) -> Mask:
    """The joints whose goal is an angle beyond (-pi, pi], which says its full turns, (nv,)."""
    return np.asarray(turns_of(goal.angles_on(on)) != 0)


def turns_to(goal: State, start: State, on: Coordinates, q0: Array, q1: Array) -> Array:
    """Full turns to a goal beyond the shortest path, shape (nv,): see `State.turns_on`.

    Those that the goal adds, and those up to an angle beyond (-pi, pi], which says them.
    q0, q1: configurations (nq,) of both. Raises InputError for a joint of which both are given,
    and as `turns_on` does.
    """
    added, angles, said = goal.turns_on(on, "goal"), goal.angles_on(on), says_turns(goal, on)
    if not said.any():
        return added
    for i in np.flatnonzero(said & (added != 0)):
        raise InputError(
            f"goal.turns: the goal of joint {on.joint_at(int(i))!r}, {angles[i]:g} rad, says its "
            "full turns: give an angle from -pi to pi, or leave out `turns`."
        )
    further = turns_after(goal, start, on, q0, on.difference(q0, q1))
    for i in np.flatnonzero(said & (abs(further) > MAX_TURNS)):
        raise InputError(
            f"the goal of joint {on.joint_at(int(i))!r}, {angles[i]:g} rad, is "
            f"{abs(further[i]):,.0f} turns away: at most {MAX_TURNS:,} are planned."
        )
    return np.asarray(np.where(said, further, added))


def keeping_turns(start: State, on: Coordinates, q0: Array, q: Array, turns: Array) -> State:
    """A configuration as the start of what follows, with the full turns that joints have made.

    From the start, whose configuration is q0, to q the shortest way, and by `turns` beyond it.
    """
    if not on.space.flat and on.joint_names == on.coordinate_names:
        return State(q)  # orientations that are nobody's joint cannot be named
    first = nearest_angles(q0, known_or(start.angles_on(on), remainder(q0, on.space)), on.space)
    return State(with_angles(q, first + on.difference(q0, q) + 2 * np.pi * turns, on))


def turns_after(goal: State, start: State, on: Coordinates, q: Array, change: Array) -> Array:
    """Full turns up to the angles that a goal says after a change from the start, shape (nv,).

    q: configuration (nq,) of the start. change: of the angles, shape (nv,), in [rad].
    """
    given = known_or(start.angles_on(on), remainder(q, on.space))
    left = goal.angles_on(on) - nearest_angles(q, given, on.space) - change
    return np.asarray(np.where(says_turns(goal, on), np.round(left / (2 * np.pi)), 0.0))


def turns_sentence(goal: State, on: Coordinates, turns: Array) -> str:
    """That angles of a goal ask for more than the shortest way, as a sentence; "" if none does.

    turns: beyond the shortest way, shape (nv,): see `turns_to`.
    """
    joints = np.flatnonzero(says_turns(goal, on) & (turns != 0))
    if not len(joints):
        return ""
    i, more = int(joints[0]), f", and {len(joints) - 1} more" if len(joints) > 1 else ""
    return (
        f"Joint {on.joint_at(i)!r}{more} goes {_in_words(turns[i])} beyond the shortest way, as "
        f"its goal {goal.angles_on(on)[i]:g} rad says; an angle from -pi to pi says none."
    )


def _in_words(turns: float) -> str:
    return "a full turn" if abs(turns) == 1 else f"{abs(turns):.0f} full turns"


def turns_missed(goal: State, on: Coordinates, reached: Array, free: Mask) -> str:
    """By how many full turns a motion misses the angle of its goal, as a clause; "" if none.

    reached: the angles of the joints at its end, shape (nv,), in [rad]. free: joints whose angles
    are guesses, (nv,).
    """
    angles = goal.angles_on(on)
    away = np.round((reached - angles) / (2 * np.pi))
    missed = np.where(says_turns(goal, on) & ~free, away, 0.0)
    i = int(np.argmax(np.abs(missed)))
    if not missed.any():
        return ""
    return f"ends {_in_words(missed[i])} from the goal of {on.joint_at(i)!r}, {angles[i]:g} rad"
