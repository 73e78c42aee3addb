"""The docstrings of the source as reStructuredText: prose, and a table of the parameters.

They are prose with formulas; a line such as `speed: motion seconds per second. loop: play again.`
describes parameters, and `Raises InputError for ...` what is raised.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

_RAISES = re.compile(r"^(Raises|Returns|Warns)\b\s*(.*)$", re.S)
_AFTER = re.compile(r"(?:^|(?<=\. ))(?=(?:Raises|Returns|Warns) )", re.M)
_ERROR = re.compile(r"^([A-Z]\w*Error)\b\s*(.*)$", re.S)
_SPECIAL = re.compile(r"([\\*_`|<>])")
_CODE = re.compile(r"``?([^`]+)``?")


def as_rst(text: str, parameters: Collection[str], public: Collection[str]) -> list[str]:
    """A docstring as lines of reStructuredText.

    parameters: names of the parameters. public: names of hovi that have an entry of their own.
    """
    prose: list[str] = []
    fields: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        for kind, name, words in _parts(paragraph, parameters):
            shown = _inline(" ".join(words.split()), public)
            if kind == "param":
                fields.append(f":param {name}: {shown}")
            elif kind == "raises":
                fields.append(f":raises {name}: {shown}")
            elif kind == "returns":
                fields.append(f":returns: {shown}")
            elif kind == "literal":
                lines = words.splitlines()
                prose += ["", "::", "", *(f"    {line}" for line in lines), ""]
            elif shown:
                prose += ["", shown, ""]
    return [*prose, "", *fields, ""]


def _parts(paragraph: str, parameters: Collection[str]) -> Iterator[tuple[str, str, str]]:
    """Kind, name and words of the parts of a paragraph."""
    lines = paragraph.splitlines()
    if lines and all(line.startswith("    ") or not line.strip() for line in lines):
        yield "literal", "", "\n".join(line[4:] for line in lines)
        return
    names = "|".join(map(re.escape, sorted(parameters, key=len, reverse=True)))
    if not names:
        yield from _sentences(paragraph)
        return
    one = rf"(?:{names})"
    begin = re.compile(rf"(?:^|(?<=[.;)] ))({one}(?:, {one})*): ", re.M)
    pieces = begin.split("\n".join(line.strip() for line in lines))
    yield from _sentences(pieces[0])
    for group, words in zip(pieces[1::2], pieces[2::2], strict=True):
        after = _AFTER.search(words)
        end = len(words) if after is None else after.start()
        for name in group.split(", "):
            yield "param", name, words[:end]
        yield from _sentences(words[end:])


def _sentences(text: str) -> Iterator[tuple[str, str, str]]:
    """Prose, with what is raised or returned apart."""
    match = _AFTER.search(text)
    begin = len(text) if match is None else match.start()
    before, rest = text[:begin], text[begin:]
    yield "prose", "", before
    for sentence in _AFTER.split(rest):
        matched = _RAISES.match(sentence)
        if matched is None:
            yield "prose", "", sentence
        elif matched[1] == "Returns":
            yield "returns", "", matched[2]
        else:
            error = _ERROR.match(matched[2])
            if error is None or matched[1] == "Warns":
                yield "prose", "", sentence
            else:
                yield "raises", error[1], error[2].lstrip(".")


def _inline(text: str, public: Collection[str]) -> str:
    """Escaped prose, with names in backticks as code, linked where they have an entry."""
    shown, end = [], 0
    for match in _CODE.finditer(text):
        shown.append(_SPECIAL.sub(r"\\\1", text[end : match.start()]))
        name = match[1].strip().removeprefix("hovi.")
        shown.append(f":py:obj:`hovi.{name}`" if name in public else f"``{match[1].strip()}``")
        following = text[match.end() : match.end() + 1]
        shown.append("\\ " if following.isalnum() else "")
        end = match.end()
    shown.append(_SPECIAL.sub(r"\\\1", text[end:]))
    return "".join(shown)
