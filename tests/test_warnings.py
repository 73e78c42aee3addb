"""Warnings name the line that called hovi, however deep in hovi they are found."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import HoviWarning

DEGREES = [90.0, -45.0]


def arm() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


def scene() -> hovi.Scene:
    return hovi.Scene(arm(), [hovi.effects.Gravity()])


def planned(**options: Any) -> hovi.Solution:
    free = {"limits": "none", "intervals": 4}
    return hovi.plan(scene(), [0.0, 0.0], [0.3, 0.2], 1.0, **(free | options))


CALLS: dict[str, Callable[[], object]] = {
    "angles of a goal": lambda: hovi.plan(scene(), [0.0, 0.0], DEGREES, 1.0, limits="none"),
    "a far obstacle": lambda: planned(obstacles=[hovi.Sphere([457.0, 0.0, 0.0], 0.1)]),
    "ranges of joints": lambda: hovi.as_limits(arm(), {"q": 170.0}),
    "ranges of joints of a plan": lambda: planned(limits={"base": "none", "q": 170.0}),
    "roll, pitch and yaw": lambda: hovi.FrameGoal("tip", rpy=[180.0, 0.0, 90.0]),
    "roll, pitch and yaw in a table": lambda: hovi.plan(
        scene(), [0.0, 0.0], {"frame": "tip", "rpy": [0.0, 90.0, 0.0]}, 1.0, time_limit=1e-3
    ),
    "an old name": lambda: hovi.load_task(hovi.example("two_link_reach")).starts,
}


@pytest.mark.parametrize("name", sorted(CALLS))
def test_a_warning_names_the_line_of_the_caller(name: str) -> None:
    with pytest.warns((HoviWarning, DeprecationWarning)) as caught:
        CALLS[name]()
    assert {each.filename for each in caught} == {__file__}


def test_a_warning_inside_a_callback_of_the_caller_names_the_callback() -> None:
    def report(text: str, fraction: float) -> None:
        hovi.as_limits(arm(), {"q": 170.0})

    first = report.__code__.co_firstlineno
    with pytest.warns(HoviWarning) as caught:
        hovi.plan(scene(), [0.0, 0.0], np.array([0.3, 0.2]), 1.0, report, limits="none")
    assert {each.lineno for each in caught} == {first + 1}
