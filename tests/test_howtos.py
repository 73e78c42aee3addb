"""The code of the how-tos and of the README runs as it stands there."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import hovi

TOP = Path(__file__).resolve().parents[1]
PAGES = sorted((TOP / "docs" / "howto").glob("*.md"))
CODE, SHELL = (
    re.compile(rf"^```{language}\n(.*?)^```$", re.M | re.S) for language in ("python", "sh")
)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_code_and_the_commands_of_a_page_run(page: Path, tmp_path: Path) -> None:
    """In the page's order of languages: its Python as one script, then what it types after it."""
    if page.stem == "video":
        pytest.importorskip("imageio_ffmpeg")
    text = page.read_text()
    script = (tmp_path / "typed").with_suffix(".py")
    script.write_text("".join(CODE.findall(text)))
    commands = [line for block in SHELL.findall(text) for line in block.splitlines()]
    typed = [shlex.split(line, comments=True)[1:] for line in commands if line[:5] == "hovi "]
    for arguments in ([script.name], *(["-m", "hovi", *each] for each in typed)):
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, (arguments, done.stdout, done.stderr)


def test_every_page_but_the_index_has_code() -> None:
    without = [page.stem for page in PAGES if not CODE.search(page.read_text())]
    assert without == ["index"]


def test_every_page_is_in_the_index() -> None:
    index = (TOP / "docs" / "howto" / "index.md").read_text()
    for page in PAGES:
        assert page.stem == "index" or f"({page.name})" in index


def test_the_readme_begins_with_ten_lines_that_run(monkeypatch: pytest.MonkeyPatch) -> None:
    block = CODE.findall((TOP / "README.md").read_text())[0]
    assert len(block.splitlines()) <= 10
    names: dict[str, object] = {}
    shown: list[object] = []
    monkeypatch.setattr(hovi, "replay", shown.append)
    exec(compile(block, "README.md", "exec"), names)
    (motion,) = shown
    assert isinstance(motion, hovi.Trajectory)
    assert names["solution"].success  # type: ignore[attr-defined]


def test_the_first_picture_is_small() -> None:
    assert (TOP / "docs" / "images" / "first_motion.gif").stat().st_size < 1.5e6
