"""Loops that a URDF closes by the elements of other programs: URDF itself is a tree of joints."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from hovi.system.dataclass import dataclass

TIES = (
    "loop_joint",
    "drake:ball_constraint",
    "drake:linear_bushing_rpy",
    "gazebo/joint",
    "mujoco/equality/*",
)
"""Paths of the elements that tie two links or joints together."""
_ENDS = "link", "body1", "body2", "joint1", "joint2", "site1", "site2"
_NAMED_PARTS = "drake:bushing_frameA", "drake:bushing_frameC"
_TEXT_PARTS = "parent", "child"


@dataclass(frozen=True)
class Tie:
    """What ties two links or joints together and is not read: its element, and their names."""

    tag: str
    ends: tuple[str, ...]

    @property
    def text(self) -> str:
        """It, in a sentence."""
        return f"<{self.tag}> of {' and '.join(map(repr, self.ends))}"


def closed_loops(robot: Element) -> list[Tie]:
    """What ties links or joints of a URDF together and is not read."""
    ties = [tie for path in TIES for tie in _at(robot, path.split("/"))]
    return [_tie(tie) for tie in ties if tie.get("active") != "false"]


def _at(element: Element, path: list[str]) -> Iterator[Element]:
    """The elements at a path of tags, where * is any."""
    for child in element:
        if path[0] in (child.tag, "*"):
            yield from _at(child, path[1:]) if path[1:] else (child,)


def _tie(tie: Element) -> Tie:
    ends = tuple(end[:40] for end in _ends(tie) if end)
    return Tie(tie.tag[:40], ends or (tie.get("name", ""),))


def _ends(tie: Element) -> Iterator[str]:
    """The names of links or joints that an element ties: in it, or in its parts."""
    for part in (tie, *tie):
        yield from (part.attrib[key] for key in _ENDS if key in part.attrib)
        if part.tag.startswith("drake:ball_constraint_body") or part.tag in _NAMED_PARTS:
            yield part.get("name", "")
        if part.tag in _TEXT_PARTS:
            yield (part.text or "").strip()
