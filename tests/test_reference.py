"""The reference of the docs: public names by topic, docstrings as tables of parameters."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path

import pytest

import hovi

DOCS = Path(__file__).resolve().parents[1] / "docs"
sys.path.insert(0, str(DOCS))

from docstrings import as_rst  # noqa: E402
from topics import TOPICS  # noqa: E402

FUNCTIONS = [name for name in hovi.__all__ if inspect.isfunction(getattr(hovi, name))]
SEARCHED = ("gripper", "ROS", "video", "xacro", "batch")


def fields(name: str) -> dict[str, str]:
    """The fields of a function's entry: their text by their head."""
    function = getattr(hovi, name)
    parameters = set(inspect.signature(function).parameters)
    lines = as_rst(inspect.getdoc(function) or "", parameters, hovi.__all__)
    heads = [line[1:].partition(": ") for line in lines if line.startswith(":")]
    return {head: text for head, _, text in heads}


def test_topics_list_each_name_once_and_only_names_that_exist() -> None:
    listed = [name for names in TOPICS.values() for name in names]
    assert len(listed) == len(set(listed))
    assert not set(listed) - set(hovi.__all__)


def test_a_parameter_has_a_field_with_its_text() -> None:
    found = fields("replay")
    assert set(found) >= {f"param {name}" for name in inspect.signature(hovi.replay).parameters}
    assert found["param speed"].startswith("motion seconds per second.")
    assert found["param loop"] == "play again and again."
    assert found["raises DisplayError"] == "when the page cannot be served, opened or written."


def test_formulas_are_shown_as_they_are() -> None:
    lines = as_rst(
        "Minimizes |tau| * x_0.\n\n    |q1|_2 = 1\n\nq, v: of `plan`.", {"q", "v"}, {"plan"}
    )
    assert r"Minimizes \|tau\| \* x\_0." in lines
    assert "    |q1|_2 = 1" in lines
    assert lines[-3:-1] == [
        ":param q: of :py:obj:`hovi.plan`.",
        ":param v: of :py:obj:`hovi.plan`.",
    ]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_parameter_is_listed_once(name: str) -> None:
    function = getattr(hovi, name)
    parameters = set(inspect.signature(function).parameters)
    lines = as_rst(inspect.getdoc(function) or "", parameters, hovi.__all__)
    heads = [line.split(": ")[0] for line in lines if line.startswith(":param")]
    assert len(heads) == len(set(heads))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_text_of_a_docstring_is_lost(name: str) -> None:
    function = getattr(hovi, name)
    doc = inspect.getdoc(function) or ""
    lines = as_rst(doc, set(inspect.signature(function).parameters), hovi.__all__)
    shown = "".join(c for c in " ".join(lines) if c.isalpha())
    plain = "".join(c for c in doc if c.isalpha())
    assert len(shown) >= 0.97 * len(plain.replace("Raises", "").replace("Returns", ""))


@pytest.mark.parametrize("word", SEARCHED)
def test_what_people_search_for_is_in_a_title_or_in_the_glossary(word: str) -> None:
    glossary = (DOCS / "glossary.md").read_text()
    titles = [page.read_text().splitlines()[0] for page in (DOCS / "howto").glob("*.md")]
    assert any(word.lower() in title.lower() for title in [*titles, *glossary.splitlines()])
    pages = [page for page in DOCS.rglob("*.md") if word in page.read_text()]
    assert len(pages) >= 2
