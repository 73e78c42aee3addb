"""Error messages are one printable line, whatever a file contains."""

from __future__ import annotations

import pickle

import pytest

from hovi.errors import HoviError, InputError, nearest


def test_an_ordinary_message_is_unchanged() -> None:
    sentence = "joint 'Gelenk_ä' has mass -1 kg: give 0 or more."
    assert str(InputError(sentence)) == sentence


@pytest.mark.parametrize("text", ["a\nb", "\x1b[2J", "\x9b2J", "\u202etxt", "a\x00b"])
def test_control_characters_are_escaped(text: str) -> None:
    sentence = str(HoviError(f"there is no {text}."))
    assert sentence.isprintable()
    assert sentence.startswith("there is no ")


@pytest.mark.parametrize("letter", ["x", " "])
def test_long_words_and_gaps_are_shortened(letter: str) -> None:
    sentence = str(HoviError("there is no " + letter * 10**6 + "end of it."))
    assert len(sentence) < 200
    assert sentence.endswith("end of it.")


@pytest.mark.parametrize("word", ["1 h ", "\x00 ", "pose's "])
def test_long_messages_are_shortened(word: str) -> None:
    sentence = str(HoviError(f"there is no pose {word * 10**4!s}of that name."))
    assert len(sentence) < 1_500
    assert sentence.startswith("there is no pose ")
    assert sentence.endswith("of that name.")


def test_errors_can_be_pickled() -> None:
    error = pickle.loads(pickle.dumps(InputError("T is\n0.")))
    assert type(error) is InputError
    assert str(error) == "T is\\n0."


def test_the_list_of_valid_names_is_limited() -> None:
    hint = nearest("x", [f"joint{i:03}" for i in range(250)])
    assert hint.startswith("valid names are 'joint000', ")
    assert hint.endswith(" and 190 more.")


def test_very_long_names_are_not_compared() -> None:
    names = ["abcdefgh" * 10**5, "abcdefgi" * 10**5]  # difflib would take hours
    assert nearest("abcdefgj" * 10**5, names).startswith("valid names are")
