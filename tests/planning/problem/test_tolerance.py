"""Tolerances from numbers and texts, and the sentences about them."""

from __future__ import annotations

import numpy as np
import pytest

from hovi.discrete.measures.motion_error import MotionError
from hovi.errors import InputError
from hovi.planning.problem.tolerance import Accuracy, Quantity, Tolerance
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot

VALID = [
    (1e-6, Quantity.COST, 1e-6, None),
    ("1e-6", Quantity.COST, 1e-6, None),
    (" 0.1 % ", Quantity.COST, 1e-3, None),
    ("0.1 mm", Quantity.FRAME, 1e-4, None),
    ("0.1mm at tool0", Quantity.FRAME, 1e-4, "tool0"),
    ("2 um at tool0", Quantity.FRAME, 2e-6, "tool0"),
    ("1.5E-3 m", Quantity.FRAME, 1.5e-3, None),
    ("0.01 deg", Quantity.JOINTS, np.deg2rad(0.01), None),
    ("1e-4 rad", Quantity.JOINTS, 1e-4, None),
    ("3 mrad", Quantity.JOINTS, 3e-3, None),
]
REFUSED = [
    ("1 mmm", "unit 'mmm': did you mean 'mm'"),
    ("1 parsec", "unit 'parsec'"),
    ("mm", "a tolerance must be a number"),
    ("1.2.3 mm", "a tolerance must be a number"),
    ("", "a tolerance must be a number"),
    ("-1e-3", "a tolerance must be a number"),
    ("1 deg at tool0", "only a length"),
    ("1e-6 at tool0", "only a length"),
    ("1 mm at tol0", "no such frame; did you mean 'tool0'"),
    ("1 mm at base", r"frame 'base' .* is fixed to the world, .*; one that moves is 'tool0'\."),
    (Tolerance(1e-3, Quantity.FRAME, "base"), "frame 'base' .* is fixed to the world"),
    (0.0, "positive and finite"),
    (-1e-6, "positive and finite"),
    (float("nan"), "positive and finite"),
    (float("inf"), "positive and finite"),
    (True, "a tolerance must be a number"),
    (None, "a tolerance must be a number"),
    ([1e-6], "a tolerance must be a number"),
]


@pytest.mark.parametrize(("given", "quantity", "size", "frame"), VALID)
def test_a_number_or_a_text_becomes_a_tolerance(
    ur5: Robot, given: float | str, quantity: Quantity, size: float, frame: str | None
) -> None:
    tolerance = Tolerance.of(given, ur5)
    assert (tolerance.quantity, tolerance.frame) == (quantity, frame)
    assert tolerance.size == pytest.approx(size, rel=1e-14)
    assert Tolerance.of(tolerance, ur5) == tolerance


@pytest.mark.parametrize(("given", "sentence"), REFUSED)
def test_an_invalid_tolerance_is_refused_in_one_sentence(
    ur5: Robot, given: object, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        Tolerance.of(given, ur5)  # type: ignore[arg-type]


def test_each_quantity_is_measured_by_its_own_number() -> None:
    error = MotionError(
        cost=1e-3,
        q=np.array([[1e-4, 2e-4], [5e-5, 3e-4]]),
        v=np.zeros((2, 2)),
        tau=np.zeros((2, 2)),
        tip=np.array([7e-5, 6e-5]),
        q_at_nodes=np.zeros((3, 2)),
        tip_at_nodes=np.zeros(3),
        frame="tool0",
        sliding=np.array([True, False]),
    )
    assert (error.slide, error.angle) == (1e-4, 3e-4)
    measured = [Tolerance(1.0, each).measure(error) for each in Quantity]
    assert measured == [1e-3, 3e-4, 7e-5]


def test_an_accuracy_says_what_was_reached_and_what_was_not() -> None:
    wanted = Tolerance(1e-4, Quantity.FRAME, "tool0")
    assert str(Accuracy(wanted, 2e-5, True, "")) == (
        "estimated error 0.02 mm at tool0, tolerance 0.1 mm at tool0."
    )
    assert str(Accuracy(wanted, 2e-4, False, "the time limit was reached")) == (
        "stopped early: the time limit was reached; estimated error 0.2 mm at tool0, tolerance "
        "0.1 mm at tool0."
    )
    assert "no error was estimated" in str(Accuracy(wanted, np.nan, False, "no minimum was found"))


def test_the_repr_of_an_accuracy_has_its_numbers_and_not_what_computes_others() -> None:
    found = Accuracy(Tolerance(1e-4, Quantity.COST), 2e-5, True, "", compare=lambda: None)
    assert "error=2e-05" in repr(found)
    assert "lambda" not in repr(found)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (1e-6, "1e-06 of the cost"),
        ("0.1 %", "0.1 % of the cost"),
        ("0.01 deg", "0.01 deg in the joints"),
        ("3 mrad", "3 mrad in the joints"),
        ("0.1 m", "0.1 m at tool0"),
        ("2 um at tool0", "2 um at tool0"),
    ],
)
def test_errors_are_stated_in_the_unit_of_the_tolerance(
    ur5: Robot, given: float | str, words: str
) -> None:
    tolerance = Tolerance.of(Tolerance.of(given, ur5), ur5)
    assert tolerance.in_words(tolerance.size) == words


def test_a_length_at_several_tips_names_them(two_arms: Robot) -> None:
    wanted = Tolerance.of("0.1 mm", two_arms)
    assert wanted.frame is None
    assert wanted.in_words(1e-4) == "0.1 mm at left_gripper and right_gripper"
    at_one = Tolerance.of("0.1 mm at right_gripper", two_arms)
    assert at_one.in_words(1e-4) == "0.1 mm at right_gripper"
    legs = Tolerance.of("0.1 mm", load_robot("anymal"))
    assert legs.in_words(1e-4) == "0.1 mm at LF_FOOT and 3 more"


def test_a_robot_in_which_nothing_moves_has_no_length_to_bound() -> None:
    panda = load_robot("panda")
    still = load_robot("panda", locked=panda.joint_names)
    with pytest.raises(InputError, match="is fixed to the world, as no joint moves it"):
        Tolerance.of("0.1 mm", still)


def test_a_tolerance_without_a_robot_is_at_the_tip() -> None:
    words = Tolerance(1e-3, Quantity.FRAME).in_words(2e-3)
    assert words == "2 mm at the tip"
    assert Tolerance(1e-3, Quantity.FRAME, "tool0").in_words(2e-3) == "2 mm at tool0"
