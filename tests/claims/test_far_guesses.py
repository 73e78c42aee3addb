"""A plan from a motion that is far from its task says that another one may cost much less."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import hovi

DOWN = np.array([-np.pi / 2, 0.0])
UP, FOLDED, HANGING = (DOWN + np.pi * np.array(each) for each in ([1, 0], [1, 1], [0, 1]))
SAID = "The guess is far from this task"
OPTIONS = {"limits": "none", "self_collision": False, "processes": 1}


@functools.cache
def planned(
    passive: str, goal: tuple[float, float], T: float, guess: tuple[object, ...] = ()
) -> hovi.Solution:
    """A swing from rest; guess: the same arguments of the motion that it begins with."""
    scene = hovi.Scene(
        hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()], passive=[passive]
    )
    more = {"guess": planned(passive, *guess).trajectory} if guess else {}
    return hovi.plan(scene, DOWN, list(goal), T, **OPTIONS, **more)


@pytest.mark.parametrize("passive", ["shoulder", "elbow"])
@pytest.mark.parametrize(
    ("first", "goal", "T"),
    [
        ((UP, 3.0), FOLDED, 2.0),
        ((UP, 3.0), FOLDED, 3.0),
        ((UP, 3.0), HANGING, 3.0),
        ((FOLDED, 3.0), UP, 2.0),
        ((FOLDED, 3.0), UP, 5.0),
        ((UP, 3.0), UP, 5.0),
        ((UP, 3.0), UP, 3.3),
        ((UP, 3.0), UP, 2.5),
    ],
)
def test_a_guess_of_another_duration_or_end_is_said_to_be_far(
    passive: str, first: tuple[np.ndarray, float], goal: np.ndarray, T: float
) -> None:
    guess = tuple(first[0]), first[1]
    found = planned(passive, tuple(goal), T, guess)
    assert (SAID in found.message) == any(SAID in each for each in found.trajectory.cautions)
    moved = np.abs(goal - first[0]).max() > 1.6
    longer = max(T, first[1]) > 1.5 * min(T, first[1])
    assert (SAID in found.message) == bool(moved or longer)


def test_some_of_these_cost_many_times_as_much() -> None:
    """So that the sentence is needed."""
    alone = planned("shoulder", tuple(HANGING), 3.0)
    far = planned("shoulder", tuple(HANGING), 3.0, (tuple(FOLDED), 3.0))
    assert far.cost > 5 * alone.cost
    assert SAID in far.message
    assert SAID not in alone.message


def test_nearby_tasks_are_planned_from_each_other_without_a_word() -> None:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start, goal = np.zeros(6), np.array([0.5, -1.0, 0.8, 0.2, 0.3, 0.0])
    first = hovi.plan(scene, start, goal, 2.0, **OPTIONS)
    again = hovi.plan(scene, start, 1.1 * goal, 2.4, guess=first.trajectory, **OPTIONS)
    assert again.success
    assert SAID not in again.message
    reversed_ = hovi.plan(scene, goal, start, 2.0, guess=first.trajectory, **OPTIONS)
    assert SAID in reversed_.message
