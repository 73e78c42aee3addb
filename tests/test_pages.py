"""The code of the README and of every page of the docs runs as it stands there, in its order."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import tomlkit
from tests.oracles.documents import NOT_RUN, PART, blocks, run, script, shown_outputs, with_outputs

import hovi

TOP = Path(__file__).resolve().parents[1]
HOWTOS = sorted((TOP / "docs" / "howto").glob("*.md"))
LESSONS = sorted((TOP / "docs" / "lessons").glob("[1-9]_*.md"))
PAGES = [TOP / "README.md", *sorted((TOP / "docs").glob("*.md")), *HOWTOS, *LESSONS]
SHOWING = [page for page in PAGES if list(shown_outputs(page))]
TYPED = [page for page in PAGES if script(page) and page not in SHOWING]
MOST_MARKS = 12
"""Blocks that may be left out."""


@pytest.mark.parametrize("page", TYPED, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    """As one script, in a folder with the bundled models, and with hovi where the README has it."""
    if page.stem == "video":
        pytest.importorskip("imageio_ffmpeg")
    done = run(page, tmp_path)
    assert done.returncode == 0, (done.stdout[-3000:], done.stderr[-3000:])


@pytest.mark.parametrize("page", SHOWING, ids=lambda page: page.stem)
def test_the_code_of_a_page_runs_and_prints_what_the_page_shows(page: Path, tmp_path: Path) -> None:
    """Otherwise run `python docs/shown_outputs.py --write`."""
    done = run(page, tmp_path)
    assert done.returncode == 0, (done.stdout[-3000:], done.stderr[-3000:])
    assert with_outputs(page, done.stdout) == page.read_text()


@pytest.mark.parametrize(
    "page", [page for page in PAGES if list(blocks(page))], ids=lambda p: p.stem
)
def test_the_tables_of_a_page_are_part_of_a_scene(page: Path, tmp_path: Path) -> None:
    """They take the place of those of the bundled scene that a comment above them names."""
    for block in blocks(page):
        if block.language != "toml" or not block.runs:
            continue
        assert block.mark.startswith(PART), (page.name, block.code)
        scene = hovi.example(block.mark.removeprefix(PART))
        text = tomlkit.parse(scene.read_text())
        for key, value in tomlkit.parse(block.code).items():
            old = text.get(key)
            if isinstance(old, dict) and key == "effects":
                old.update(value)
            else:
                text[key] = value
        file = tmp_path / scene.name
        file.write_text(tomlkit.dumps(text))
        hovi.load_task(file)


def test_few_blocks_are_left_out_and_each_says_why() -> None:
    marks = [block.mark for page in PAGES for block in blocks(page) if not block.runs]
    assert len(marks) <= MOST_MARKS
    assert all(mark.removeprefix(NOT_RUN) for mark in marks)


def test_every_page_but_the_index_has_code() -> None:
    assert [page.stem for page in HOWTOS if not script(page)] == ["index"]


def test_every_page_is_in_the_index() -> None:
    index = (TOP / "docs" / "howto" / "index.md").read_text()
    for page in HOWTOS:
        assert page.stem == "index" or f"({page.name})" in index


def test_the_readme_begins_with_ten_lines_that_run(monkeypatch: pytest.MonkeyPatch) -> None:
    block = next(blocks(TOP / "README.md")).code
    assert len(block.splitlines()) <= 10
    names: dict[str, object] = {}
    shown: list[object] = []
    monkeypatch.setattr(hovi, "replay", shown.append)
    exec(compile(block, "README.md", "exec"), names)
    (motion,) = shown
    assert isinstance(motion, hovi.Trajectory)
    assert names["solution"].success  # type: ignore[attr-defined]


def test_lessons_are_the_first_pages_in_their_order() -> None:
    names = [page.stem for page in LESSONS]
    assert [name[0] for name in names] == list("12345")
    lessons = (TOP / "docs" / "lessons" / "index.md").read_text()
    contents = lessons.split("```{toctree}\n:hidden:\n\n")[1].split("```")[0]
    assert contents.split() == names
    assert all(f"({name}.md)" in lessons for name in names)
    assert ":caption: Begin\n\nlessons/index\n" in (TOP / "docs" / "index.md").read_text()
    assert "(docs/lessons/index.md)" in "".join((TOP / "README.md").read_text().split("\n## ")[0])
    assert "(../lessons/index.md)" in (TOP / "docs" / "howto" / "index.md").read_text()


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda page: page.stem)
def test_a_lesson_shows_what_its_code_prints_and_a_small_picture(lesson: Path) -> None:
    assert len(list(shown_outputs(lesson))) >= 3
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", lesson.read_text(), re.S)
    assert pictures
    for picture in pictures:
        assert 5e3 < (lesson.parent / picture).stat().st_size < 1e5, picture


def test_the_first_picture_is_small() -> None:
    assert (TOP / "docs" / "images" / "pick.gif").stat().st_size < 1.5e6


SEARCHED = {
    "MPC": "howto/replan",
    "collision": "scene_files",
    "payload": "howto/gripper",
    "constraint": "conditions",
    "speed": "howto/keep",
    "obstacle": "scene_files",
}
"""Words of a person who searches, and the page that is to be found by each."""


@pytest.mark.parametrize("word", SEARCHED)
def test_a_word_that_is_searched_for_is_in_a_heading_of_its_page(word: str) -> None:
    """The search of the docs weighs titles and headings most."""
    text = (TOP / "docs" / f"{SEARCHED[word]}.md").read_text()
    headings = [line for line in text.splitlines() if line.startswith("#")]
    assert re.search(rf"\b{word}", "\n".join(headings), re.I), headings


def test_every_picture_has_words_for_those_who_cannot_see_it() -> None:
    pages = [*PAGES, *sorted((TOP / "docs" / "lessons").glob("*.md"))]
    for page in pages:
        for words in re.findall(r"!\[(.*?)\]\(", page.read_text(), re.S):
            assert len(words) > 20, (page.name, words)
