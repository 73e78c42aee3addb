"""Every pair of effects, limits, goals, worlds, grids, calls and arrays: a right motion, or a word.

A motion satisfies what it claims, by Pinocchio and dense samples; anything else is a HoviError of
one sentence, or a status that says why there is none.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import hovi
from samples.asked_motions import (
    AXES,
    GROUPS,
    LEFT_OUT,
    REFUSED,
    USUAL,
    Array,
    Asked,
    effects_of,
    planned,
    two_link,
)
from samples.combinations import carried_out
from samples.motion_judge import judged
from samples.pairwise import Case, Pair, all_pairs, pairs_of, pairwise

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
CASES = pairwise(AXES, LEFT_OUT)


def failures(cases: Sequence[Case], folder: Path) -> tuple[list[str], int]:
    """What is wrong with each case, and how many have a motion."""
    wrong, motions = list[str](), 0
    for case in cases:
        try:
            found, reason = carried_out(case, folder)
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            reason, found = "", f"{type(error).__name__}: {error} ({where.name}:{where.lineno})"
        motions += not reason
        wrong += [f"{' '.join(case.values())}: {found}"] * bool(found)
    return wrong, motions


@pytest.mark.parametrize("robot", AXES["robot"])
def test_every_pair_gives_a_right_motion_or_a_sentence(robot: str, tmp_path: Path) -> None:
    cases = [case for case in CASES if case["robot"] == robot]
    wrong, motions = failures(cases, tmp_path)
    assert not wrong, "\n".join(wrong)
    assert motions >= len(cases) / 2


@pytest.mark.parametrize("refused", REFUSED, ids=" ".join)
def test_what_is_left_out_is_refused_in_a_sentence(
    refused: tuple[str, str, str, str], tmp_path: Path
) -> None:
    first, x, second, y = refused
    wrong, reason = carried_out(USUAL | {first: x, second: y}, tmp_path)
    assert not wrong
    assert reason, "it gives a motion: leave it in"
    assert not reason.startswith(tuple(map(str, hovi.Status))), reason


def test_the_cases_contain_every_pair() -> None:
    covered: set[Pair] = set().union(*map(pairs_of, CASES))
    assert covered == all_pairs(AXES, LEFT_OUT)
    assert len(CASES) <= 120
    assert {each for group in GROUPS.values() for each in group} == set(effects_of(two_link()))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.parametrize("robot", AXES["robot"])
def test_every_pair_of_single_effects_too(robot: str, seed: int, tmp_path: Path) -> None:
    """The product itself has millions of cases; these cover the pairs in four further ways."""
    single = AXES | {"effect": ("nothing", "gravity", *effects_of(two_link()))}
    alone = {kind: group for group, kinds in GROUPS.items() for kind in kinds}
    left_out = set(LEFT_OUT)
    for a, x, b, y in REFUSED:
        for one, value, other in ((a, x, (b, y)), (b, y, (a, x))):
            if one == "effect":
                kinds = [kind for kind, group in alone.items() if group == value]
                left_out |= {frozenset([("effect", kind), other]) for kind in kinds}
    cases = [case for case in pairwise(single, left_out, seed) if case["robot"] == robot]
    wrong, motions = failures(cases, tmp_path)
    assert not wrong, "\n".join(wrong)
    assert motions >= len(cases) / 2


@dataclass(frozen=True)
class Slow(Asked):
    """With a bound on velocities that the motion does not keep."""

    @property
    def bounds(self) -> Iterator[tuple[str, Array, Array]]:
        yield "v", np.full(3, -0.1), np.full(3, 0.1)


def test_the_judge_notices_what_a_motion_does_not_satisfy() -> None:
    """The motion of one case, judged as that of another."""
    asked = Asked(USUAL)
    found = planned(asked)
    assert judged(asked, found) == ""
    for axis, value in {"goal": "state", "via": "configuration", "effect": "nothing"}.items():
        word = {"effect": "torques"}.get(axis, axis)
        assert judged(Asked(USUAL | {axis: value}), found).startswith(f"{word}: ")
    assert judged(Slow(USUAL), found).startswith("limits: v")
    assert judged(asked, found, start=(asked.q0 + 1e-4, np.zeros(3))).startswith("start: ")
    assert judged(asked, found, goal=asked.q1 + 1e-4).startswith("goal: ")
    assert judged(asked, found, elapsed=0.1).startswith("duration: ")
