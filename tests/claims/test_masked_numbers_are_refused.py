"""A masked entry stands for no number: the value behind its mask is never planned to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hovi

ROBOT = hovi.load_robot(hovi.example("two_link.urdf"))
SCENE = hovi.Scene(ROBOT, [hovi.effects.Gravity()])
MASKED = np.ma.array([0.3, 0.7], mask=[False, True])
QUICK: dict[str, Any] = {"intervals": 4, "limits": "none", "self_collision": False}


def planned(goal: Any, **more: Any) -> hovi.Solution:
    return hovi.plan(SCENE, [0, 0], goal, 1.0, **(QUICK | more))


CALLS: dict[str, Callable[[Any], object]] = {
    "goal": planned,
    "goal of a state": lambda x: planned(hovi.State(x)),
    "velocity": lambda x: planned(hovi.State([0.3, 0.7], x)),
    "start": lambda x: hovi.plan(SCENE, x, [0.3, 0.7], 1.0, **QUICK),
    "via": lambda x: planned([0.3, 0.7], via=[{"time": 0.5, "q": x}]),
    "weight": lambda x: planned([0.3, 0.7], weight=x),
    "goal of a replan": lambda x: planned([0.3, 0.7]).replan(goal=x),
    "state of an advance": lambda x: planned([0.3, 0.7]).advance(0.1, hovi.State(x, [0.0, 0.0])),
    "times": lambda x: planned([0.3, 0.7]).trajectory.sample(x),
    "positions": lambda x: planned([0.3, 0.7]).trajectory.sample_intervals([0, 1], x),
    "torques": lambda x: SCENE.inverse_dynamics(x[None], [[0.0, 0.0]], [[0.0, 0.0]]),
    "simulation": lambda x: hovi.simulate(SCENE, x, 0.1, intervals=2),
    "limits": lambda x: planned([0.3, 0.7], limits={"v": x}),
    "frame": lambda x: planned(hovi.FrameGoal("tip", position=np.ma.append(x, 0.1))),
    "obstacle": lambda x: hovi.Sphere(np.ma.append(x, 0.1), 0.1),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_masked_entry_is_refused_in_one_sentence(name: str) -> None:
    with pytest.raises(hovi.HoviError, match="masked") as refusal:
        CALLS[name](MASKED)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", [name for name in CALLS if name not in ("frame", "limits")])
def test_a_mask_that_masks_nothing_changes_nothing(name: str) -> None:
    CALLS[name](np.ma.array([0.3, 0.7], mask=[False, False]))


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_refused(name: str, wrong: float) -> None:
    if name == "torques" or (name == "limits" and wrong == np.inf):  # as asked: no bound
        return
    with pytest.raises(hovi.HoviError) as refusal:
        CALLS[name](np.array([0.3, wrong]))
    assert "\n" not in str(refusal.value)
