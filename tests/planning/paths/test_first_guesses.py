"""Which guesses a search begins with, and what the message of its solution says of them."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import hovi
from hovi.planning.paths import first_guesses as module
from hovi.planning.paths.first_guesses import FirstGuesses, first_guesses
from hovi.robot.robot import Robot
from hovi.system.deadline import Deadline
from planning.paths.test_path_guess import ball, problem_of

needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="needs the extra `obstacles`")


def silent(text: str, share: float) -> None:
    """Ignore progress."""


def planned(robot: Robot, starts: int = 1, **options: object) -> hovi.Solution:
    """From (0, 0) to (2.5, 0) with a ball on the way of the forearm."""
    obstacle = hovi.Sphere([2.0 * np.cos(1.25), 0.0, 2.0 * np.sin(1.25)], 0.3)
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    given = {"limits": "none", "obstacles": [obstacle], "starts": starts, "processes": 1}
    return hovi.plan(scene, [0.0, 0.0], [2.5, 0.0], 2.0, **given, **options)


def test_without_ompl_the_direct_guess_is_the_only_one(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "has_ompl", lambda: False)
    problem = problem_of(two_link, ball())
    direct = problem.guess("cubic")
    found = first_guesses(problem, direct, 4, 0, Deadline(), silent)
    assert found.all == (direct,)
    assert found.sentence(False, True) == ""
    said = found.sentence(False, False)
    assert f"{found.depth:.2g} m deep" in said
    assert "pip install 'hovi[obstacles]'" in said


@pytest.mark.parametrize("ompl", [True, False])
@pytest.mark.parametrize("success", [True, False])
def test_without_obstacles_none_are_named(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch, ompl: bool, success: bool
) -> None:
    """Links that enter each other are no obstacles."""
    monkeypatch.setattr(module, "has_ompl", lambda: ompl)
    direct = problem_of(two_link, ball()).guess("cubic")
    for paths in ((), (direct,)):
        found = FirstGuesses(direct, 0.1, paths, obstacles=False)
        said = found.sentence(True, success) + found.sentence(False, success)
        assert "obstacles" not in said.replace("hovi[obstacles]", "")


def test_a_failure_without_ompl_names_the_extra(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "has_ompl", lambda: False)
    found = planned(two_link, max_iterations=1, continuation=False)
    assert not found.success
    assert "hovi[obstacles]" in found.message
    assert "hovi[obstacles]" not in planned(two_link).message


def test_out_of_time_the_direct_guess_is_the_only_one(two_link: Robot) -> None:
    problem = problem_of(two_link, ball())
    direct, deadline = problem.guess("cubic"), Deadline(1e-9)
    with deadline.in_force():
        found = first_guesses(problem, direct, 4, 0, deadline, silent)
    assert found.all == (direct,)


@needs_ompl
def test_a_guess_that_is_not_deep_needs_no_path(two_link: Robot) -> None:
    problem = problem_of(two_link, ball(at=2.5))
    direct = problem.guess("cubic")
    found = first_guesses(problem, direct, 4, 0, Deadline(), silent)
    assert found.all == (direct,)
    assert found.sentence(False, False) == ""


@needs_ompl
def test_every_start_but_the_last_has_a_path_of_its_own(two_link: Robot) -> None:
    problem = problem_of(two_link, ball())
    direct = problem.guess("cubic")
    for starts, paths in ((1, 1), (2, 1), (4, 3)):
        found = first_guesses(problem, direct, starts, 0, Deadline(), silent)
        assert len(found.paths) == paths
        assert found.all[-1] is direct


@needs_ompl
def test_no_time_for_paths_leaves_the_direct_guess(two_link: Robot) -> None:
    problem = problem_of(two_link, ball())
    found = first_guesses(problem, problem.guess("cubic"), 4, 0, Deadline(1e-6), silent)
    assert found.paths == ()
    assert "found no path" in found.sentence(False, False)


@needs_ompl
def test_the_message_says_that_a_path_led_to_the_minimum(two_link: Robot) -> None:
    found = planned(two_link)
    assert found.success
    assert "A path around the obstacles by OMPL led here." in found.message


@needs_ompl
def test_several_starts_give_several_minima_and_the_same_ones_again(two_link: Robot) -> None:
    first, again = planned(two_link, 4), planned(two_link, 4)
    assert len(first.minima) > 1
    assert first.minima == again.minima
    assert first.message == again.message


@needs_ompl
def test_where_no_start_succeeds_the_message_says_what_was_tried(two_link: Robot) -> None:
    found = planned(two_link, max_iterations=1, continuation=False)
    assert not found.success
    assert "Neither OMPL's paths" in found.message


def test_a_direct_guess_alone_has_nothing_to_say(two_link: Robot) -> None:
    found = FirstGuesses(problem_of(two_link, ball()).guess("cubic"))
    assert found.sentence(False, False) == ""
