"""The words of sources and pages are those of robotics engineers: odd ones do not come back."""

import re
import subprocess
from pathlib import Path

import pytest

TOP = Path(__file__).parents[1]
ODD = {
    r"whirl\w*": "spin",
    r"hand(ed|ing)[ _]on\b": "transfer",
    r"(a|as a|the) share of": "fraction",
    r"costs? nothing": "is free, takes no time",
    r"(is|are) sought": "solve, look for",
    r"(is|are) told (before|at once)": "reported",
    r"[Ll]eg by leg": "in subproblems",
    r"segment_spans?|SegmentSpans?|motion_legs|legs_of": "segment, subproblem",
    r"frame meets (its|a|the) (goal|target)": "reaches",
}
"""What is odd, as a pattern, and what to say instead."""
ALLOWED = ("docs/changelog.md",)
"""Files that say what was: names and words of former versions."""


def files() -> list[str]:
    """The sources, pages and examples of the repository."""
    asked = ["git", "ls-files", "src/*.py", "docs/*.md", "docs/howto/*.md", "examples/*.py"]
    listed = subprocess.run(asked, cwd=TOP, capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.split() if name not in ALLOWED]


@pytest.mark.parametrize("word", ODD)
def test_odd_words_do_not_come_back(word: str) -> None:
    pattern, found = re.compile(rf"\b(?:{word})", re.IGNORECASE), []
    for name in files():
        for number, line in enumerate((TOP / name).read_text().splitlines(), 1):
            if pattern.search(line):
                found.append(f"{name}:{number}: {line.strip()}")
    assert not found, f"say {ODD[word]!r} instead:\n" + "\n".join(found)
