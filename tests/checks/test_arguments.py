"""Arguments are checked against annotations, whatever these say."""

from __future__ import annotations

import pickle
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt
import pytest

from hovi.checks.arguments import (
    check_arguments,
    check_arguments_except,
    check_fields,
    unchecked,
)
from hovi.errors import InputError, SceneError

Array = npt.NDArray[np.float64]


class Robot:
    """A class of objects."""


class Drive(Protocol):
    def evaluate(self) -> None: ...


class Motor:
    def evaluate(self) -> None: ...


@check_arguments
def function(
    number: float = 0.0,
    whole: int = 0,
    truth: bool = False,
    text: str = "",
    maybe: Robot | None = None,
    array: Array = np.zeros(2),  # noqa: B008
    numbers: Sequence[float] = (),
    names: Iterable[str] = (),
    by_name: Mapping[str, float] = {},
    pair: tuple[float, str] = (0.0, ""),
    choice: Literal["a", "b"] = "a",
    drive: Drive | Callable[[], None] | None = None,
    path: str | Path = "",
    like: npt.ArrayLike = 0.0,
    either: Array | Sequence[Array] = (),
    anything: Any = None,
) -> dict[str, Any]:
    return dict(locals())


ACCEPTED: dict[str, tuple[Any, ...]] = {
    "number": (1, -2.5, np.float32(1), np.int64(3), np.array(2.0), float("nan"), float("inf")),
    "whole": (1, -3, np.int32(4), 5.0, np.array(6)),
    "truth": (True, np.True_),
    "text": ("", "abc"),
    "maybe": (None, Robot()),
    "array": ([1, 2], (1.0,), np.arange(3), np.float32([1]), 3, [], [[1, 2], [3, 4]]),
    "numbers": ([], (1, 2.5), np.arange(3.0)),
    "names": ([], "ab", ("a",), {"a"}, iter(["a"])),
    "by_name": ({}, {"a": 1}),
    "pair": ((1, "a"), [1.5, "b"]),
    "choice": ("a", "b"),
    "drive": (None, Motor(), lambda: None),
    "path": ("a", Path("a")),
    "like": (1, [1.0], np.zeros(3)),
    "either": (np.zeros(2), [np.zeros(2), np.zeros(3)]),
    "anything": (None, 1, Robot(), "x"),
}
BOOLEANS: tuple[Any, ...] = (
    *([1.0, True], [[0, 1], [False, 2]], [np.True_, 1.0], deque([1, True])),
    *((np.array(True), 1), [np.array([True, False]), [1, 2]]),
)
"""Truth values among numbers, which NumPy takes as 0 and 1."""
REFUSED: dict[str, tuple[Any, ...]] = {
    "number": (None, "1", True, 1j, [1.0], 10**400, np.zeros(2), Robot()),
    "whole": (None, "1", True, 1.5, float("nan"), float("inf"), 10**30, np.array(1.5)),
    "truth": (None, 0, 1, "True", np.array([True, False])),
    "text": (None, b"a", 1, ["a"]),
    "maybe": (1, "robot", Robot),
    "array": (
        None,
        "1",
        ["1"],
        [None],
        1j,
        [1j],
        [True],
        {},
        [[1], [2, 3]],
        b"1",
        Robot(),
        *BOOLEANS,
    ),
    "numbers": (None, 1.0, "12", b"12", ["a"], [None], {1.0: 2.0}, np.array(1.0), iter([1.0])),
    "names": (None, 1, [1], ["a", None], b"ab"),
    "by_name": (None, [], [("a", 1)], {1: 1}, {"a": "b"}),
    "pair": (None, (1, 2), (1, "a", 3), "ab"),
    "choice": (None, "c", 1, ["a"], []),
    "drive": (1, "motor", Robot(), Motor),
    "path": (None, 1, b"a"),
    "like": (None, "1", [None], 1j),
    "either": (None, "a", ["a"]),
}


@pytest.mark.parametrize("name", ACCEPTED)
def test_what_fits_the_annotation_is_accepted(name: str) -> None:
    for value in ACCEPTED[name]:
        function(**{name: value})


@pytest.mark.parametrize("name", [name for name in REFUSED if name != "drive"])
def test_what_does_not_fit_is_refused_by_name_and_kind(name: str) -> None:
    for value in REFUSED[name]:
        with pytest.raises(InputError) as refusal:
            function(**{name: value})
        sentence = str(refusal.value)
        assert sentence.startswith(f"function: {name} must be ")
        assert ", got " in sentence
        assert sentence.endswith(".")


def test_a_class_is_not_accepted_for_an_object_of_a_protocol() -> None:
    for value in (1, "motor", Robot()):
        with pytest.raises(InputError, match="drive must be a Drive, a function or None"):
            function(drive=value)


def test_arguments_by_position_are_checked_too() -> None:
    with pytest.raises(InputError, match="whole must be a whole number, got 'x'"):
        function(1.0, "x")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="unexpected keyword"):
        function(unknown=1)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="positional"):
        Made.of(1.0, 2.0)  # type: ignore[call-arg]


def test_lists_become_arrays_and_arrays_are_passed_on() -> None:
    given = np.zeros((3, 2))
    assert function(array=given)["array"] is given
    for strided in (given[:, ::2], given.T, given[::-1]):
        passed_on = function(array=strided)["array"]
        assert passed_on.flags.c_contiguous
        np.testing.assert_array_equal(passed_on, strided)
    converted = function(array=[1, 2])["array"]
    assert converted.dtype == np.float64
    listed = [np.zeros(2), np.zeros(3)]
    assert function(either=listed)["either"] is listed


def test_numbers_too_large_for_a_machine_word_become_doubles() -> None:
    assert isinstance(function(number=10**30)["number"], float)
    with pytest.raises(InputError, match=r"whole must be a whole number of at most 1e\+18, got"):
        function(whole=10**30)


def test_fractions_become_doubles_since_numpy_refuses_them() -> None:
    assert repr(function(number=Fraction(1, 4))["number"]) == "0.25"


@check_arguments
def further(first: float, *rest: float, **options: int) -> tuple[Any, ...]:
    return first, rest, options


def test_arguments_beyond_the_named_ones_are_checked() -> None:
    assert further(1.0, 2.0, 3, key="any") == (1.0, (2.0, 3), {"key": "any"})
    with pytest.raises(InputError, match="rest must be a number, got 'x'"):
        further(1.0, 2.0, "x")  # type: ignore[arg-type]


@check_arguments_except("own")
@dataclass(frozen=True)
class Made:
    """A dataclass with methods of each kind."""

    size: float
    own: float = 0.0

    def scaled(self, factor: float) -> float:
        return self.size * factor

    @classmethod
    def of(cls, size: float) -> Made:
        return cls(size)

    @staticmethod
    def twice(size: float) -> float:
        return 2 * size

    @unchecked
    def quick(self, factor: float) -> float:
        return factor

    def _inner(self, factor: float) -> float:
        return factor


def test_constructor_and_public_methods_of_a_class_are_checked() -> None:
    for call in (Made, Made(1.0).scaled, Made.of, Made.twice):
        assert call(2.0) is not None  # type: ignore[operator]
        with pytest.raises(InputError, match="must be a number, got None"):
            call(None)  # type: ignore[operator]


def test_private_methods_and_those_with_a_decorator_of_their_own_are_not_checked() -> None:
    made = Made(1.0, own=None)  # type: ignore[arg-type]
    assert made.quick(None) is None  # type: ignore[arg-type]
    assert made._inner(None) is None  # type: ignore[arg-type]
    assert pickle.loads(pickle.dumps(made)) == made


@dataclass
class Field:
    """A dataclass that is checked once built."""

    weight: float
    names: tuple[str, ...] = ()
    unknown: NotDefined = None  # type: ignore[name-defined]  # noqa: F821


@dataclass
class MoreFields(Field):
    more: int = 0


def test_fields_are_checked_with_the_error_and_words_given() -> None:
    check_fields(MoreFields(1.0, ("a",)), "effect", SceneError)
    with pytest.raises(SceneError, match=r"^effect: weight must be a number, got None\.$"):
        check_fields(MoreFields(None), "effect", SceneError)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="more must be a whole number, got 'x'"):
        check_fields(MoreFields(1.0, more="x"), "effect", SceneError)  # type: ignore[arg-type]


def test_long_values_are_named_by_type_or_shortened() -> None:
    with pytest.raises(InputError, match=r"got an array of float64 of shape \(1000,\)"):
        function(text=np.zeros(1000))  # type: ignore[arg-type]
    with pytest.raises(InputError) as refusal:
        function(number="x" * 10**6)  # type: ignore[arg-type]
    assert len(str(refusal.value)) < 150
