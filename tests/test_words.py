"""The words of sources and pages are those of robotics engineers: odd ones do not come back."""

import re
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
    r"[Ll]eg by leg": "segment by segment",
    r"segment_spans?|SegmentSpans?|motion_legs|legs_of": "segment, span",
    r"frame meets (its|a|the) (goal|target)": "reaches",
    r"(\w+_)?(?-i:SHARES?)\b": "FRACTION",
    r"(\w+_)?shares?(?=:| =| \*)": "fraction",
    r"(meets|met)\b": "satisfies (a condition), reaches (a goal)",
    r"(a saved|the last|last|previous) mark\b|marked\b": "saved iterate",
    r"(told|tells)\b": "reported, says",
    r"beside\b": "next to, compared with",
}
"""What is odd, as a pattern, and what to say instead."""
USES = (
    r"motion (that )?meets the ends|\"meets the ends;|cannot be met: \{",  # messages
    r"goal is met by \{len|where the goal is met\"|no configuration meets it\"",
    r"such a pair meets|met := met_sentence|COLLISION, met\b|that it meets in",  # shapes, sets
    r"(fault|Ctrl-C) (meets|met)\b|met a f(ault|ew files)",
    r"marked (with \*|as by)",  # in a printed table
    r"(args|given)\.share|all machines share:|has no share:|`NON_FINITE_SHARE = ",
    r"share(: FiniteFloat|: float, count| \* )",  # a key of study files
)
"""What is meant as it says, or quoted where users read it."""
ALLOWED = ("docs/changelog.md",)
"""Files that say what was: names and words of former versions."""


def files() -> list[str]:
    """The sources, pages and examples of the repository."""
    found = (TOP / folder for folder in ("src", "docs", "examples"))
    listed = [path for folder in found for end in ("py", "md") for path in folder.rglob(f"*.{end}")]
    assert len(listed) > 400, "the sources and pages are not where they were"
    names = (path.relative_to(TOP).as_posix() for path in sorted(listed))
    return [name for name in names if name not in ALLOWED]


@pytest.mark.parametrize("word", ODD)
def test_odd_words_do_not_come_back(word: str) -> None:
    pattern, found = re.compile(rf"\b(?:{word})", re.IGNORECASE), []
    for name in files():
        for number, line in enumerate((TOP / name).read_text().splitlines(), 1):
            if pattern.search(re.sub("|".join(USES), "", line)):
                found.append(f"{name}:{number}: {line.strip()}")
    assert not found, f"say {ODD[word]!r} instead:\n" + "\n".join(found)
