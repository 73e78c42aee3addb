"""What was found about a robot's file, and the line that mends it."""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping
from enum import StrEnum
from typing import Any
from xml.sax.saxutils import quoteattr

from hovi.system.dataclass import dataclass

SRDF, PYTHON, COMMAND_LINE, SCENE_FILE = "SRDF", "Python", "command line", "scene file"
"""Where a line is written that is no element of the URDF."""


class Severity(StrEnum):
    """What a finding does to a plan, the worst first."""

    STOPS = "stops"
    MISLEADS = "misleads"
    HINT = "hint"
    NOTE = "note"


@dataclass(frozen=True)
class Line:
    """A line to write.

    where: the path of the element of the URDF in which it replaces the element of its tag, as
        XPath from <robot>; "." for one that is added to the robot itself; or SRDF, PYTHON,
        COMMAND_LINE, SCENE_FILE.
    """

    where: str
    text: str

    @property
    def in_scene_file(self) -> Line:
        """The line, and one in Python as a scene file has it: a key, or the table of an effect."""
        if self.where != PYTHON:
            return self
        call = ast.parse(f"options({self.text})", mode="eval").body
        assert isinstance(call, ast.Call)
        if call.keywords:
            given = call.keywords[0]
            return Line(SCENE_FILE, f"{given.arg} = {_toml(ast.literal_eval(given.value))}")
        effect = call.args[0]
        assert isinstance(effect, ast.Call)
        value = _toml(ast.literal_eval(effect.args[0]))
        return Line(SCENE_FILE, f"[effects.armature]\ninertia = {value}")


def _toml(value: Any) -> str:
    """A literal in TOML, on one line."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{json.dumps(k)} = {_toml(x)}' for k, x in value.items())} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return json.dumps(value, ensure_ascii=False)


def element(tag: str, attributes: Mapping[str, str], *inside: str) -> str:
    """The text of an element. inside: texts of the elements in it."""
    words = " ".join([tag, *(f"{key}={quoteattr(x)}" for key, x in attributes.items())])
    return f"<{words}>{''.join(inside)}</{tag}>" if inside else f"<{words}/>"


@dataclass(frozen=True)
class Finding:
    """What was found.

    severity: a plan stops at it; or is for another robot than meant; or may be a poor one; or it is
        good to know.
    kind: of finding, a word for programs. subject: names of the joints, links or frames.
    sentence: what was found, and what to do. lines: to write, for example; none without one.
    """

    severity: Severity
    kind: str
    subject: tuple[str, ...]
    sentence: str
    lines: tuple[Line, ...] = ()
