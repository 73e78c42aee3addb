"""Checks a URDF before Pinocchio reads it.

Pinocchio reads the mass "1,5" as 0, accepts negative masses, reports a broken tree on stderr only,
and needs memory that grows with the cube of the degrees of freedom. So sizes are limited while the
text is parsed, without entities, and the result is checked against a table of rules (rules.py). The
first violation raises a message that names the link or joint. Pinocchio never reads the original
text, only what normalize.py writes.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from hovi.errors import ModelError
from hovi.robot.urdf.harmless import Notes, without_harmless
from hovi.robot.urdf.rules import RULES
from hovi.system.files import reason, require_file

MAX_BYTES = 32_000_000
MAX_LINKS = 1_000
MAX_DEPTH = 64
MAX_ELEMENTS = 100_000
"""Largest file in bytes, and largest numbers of links, nested elements and elements."""
MAX_ATTRIBUTES = 64
"""Of one element: the time of Pinocchio's parser grows with their square."""
MAX_DOF = 250
"""Pinocchio's workspace holds tensors of 48 nv^3 bytes: 0.8 GB at 250 degrees of freedom."""

_FREEDOM = {"revolute": 1, "continuous": 1, "prismatic": 1, "planar": 3, "floating": 6}


def read_urdf(path: Path) -> str:
    """The text of a URDF file. Raises ModelError if it is missing, too large or not UTF-8."""
    try:
        require_file(path, MAX_BYTES)
        return path.read_bytes().decode()
    except FileNotFoundError as error:
        raise ModelError(f"cannot read the URDF {str(path)!r}: no such file.") from error
    except OSError as error:
        raise ModelError(f"cannot read the URDF {str(path)!r}: {reason(error)}.") from error
    except UnicodeDecodeError as error:
        raise ModelError(
            f"the URDF {path.name!r} is not UTF-8 text (byte {error.start}): save it as UTF-8."
        ) from error


def check_urdf(text: str, name: str = "robot.urdf") -> None:
    """Check the text of a URDF against every rule.

    name: of the URDF, for messages.
    Raises ModelError with one sentence: what was expected, what was found, what to do.
    """
    checked_urdf(text, name)


def checked_urdf(text: str, name: str = "robot.urdf") -> ElementTree.Element:
    """The element <robot> of the text of a URDF, checked. Raises ModelError."""
    return copy.deepcopy(_checked(text, name))


@lru_cache(maxsize=2)
def _checked(text: str, name: str) -> ElementTree.Element:
    """That element, which is looked at several times while a robot is loaded."""
    return noted_urdf(text, name)[0]


def noted_urdf(text: str, name: str = "robot.urdf") -> tuple[ElementTree.Element, Notes]:
    """The checked element, without what changes nothing, and notes on that. Raises ModelError."""
    if len(text) > MAX_BYTES:
        raise ModelError(_too_large(name, len(text)))
    robot = _Reader(name).read(text.lstrip("\ufeff \t\r\n"))
    notes = without_harmless(robot, Path(name).stem)
    for rule in RULES:
        for sentence in rule(robot):
            raise ModelError(f"URDF {name!r}: {sentence}")
    return robot, notes


class _Reader:
    """Parses XML into an element tree and enforces the size limits on the way."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.depth = self.elements = self.links = self.freedom = 0
        self.builder = ElementTree.TreeBuilder()

    def read(self, text: str) -> ElementTree.Element:
        parser = expat.ParserCreate()
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.builder.data
        parser.StartDoctypeDeclHandler = self.doctype
        try:
            parser.Parse(text, True)  # as UTF-8, regardless of the declaration
        except (expat.ExpatError, UnicodeEncodeError) as error:
            raise ModelError(f"URDF {self.name!r} is not well-formed XML: {error}.") from error
        return self.builder.close()

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        self.elements += 1
        if self.depth == 1 and tag != "robot":
            self.refuse(f"its root element must be <robot>, not <{tag[:40]}>.")
        if self.depth > MAX_DEPTH:
            self.refuse(f"elements are nested more than {MAX_DEPTH} deep.")
        if self.elements > MAX_ELEMENTS:
            self.refuse(f"it has more than {MAX_ELEMENTS:,} elements, the maximum.")
        if len(attributes) > MAX_ATTRIBUTES:
            self.refuse(f"<{tag[:40]}> has more than {MAX_ATTRIBUTES} attributes.")
        if self.depth == 2:
            self.count(tag, attributes.get("type", ""))
        self.builder.start(tag, attributes)

    def end(self, tag: str) -> None:
        self.depth -= 1
        self.builder.end(tag)

    def count(self, tag: str, joint_type: str) -> None:
        self.links += tag == "link"
        if self.links > MAX_LINKS:
            self.refuse(
                f"it has more than {MAX_LINKS} links, the maximum: "
                "merge links that do not move relative to each other."
            )
        self.freedom += _FREEDOM.get(joint_type, 0) if tag == "joint" else 0
        if self.freedom > MAX_DOF:
            self.refuse(
                f"it has more than {MAX_DOF} degrees of freedom, the maximum "
                "(memory grows with their cube): make some joints fixed."
            )

    def doctype(self, *_: object) -> None:
        self.refuse("a URDF needs no DOCTYPE and no entities: delete that declaration.")

    def refuse(self, sentence: str) -> NoReturn:
        raise ModelError(f"URDF {self.name!r}: {sentence}")


def _too_large(name: str, size: int) -> str:
    return (
        f"URDF {name!r} has {size / 1e6:.0f} MB, at most {MAX_BYTES / 1e6:.0f} MB are "
        "accepted: store meshes in separate files."
    )
