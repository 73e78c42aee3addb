"""Loops that a URDF closes by elements of other programs, and that are not kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hovi.errors import some_of
from hovi.robot.findings.finding import PYTHON, Finding, Line, Severity
from hovi.robot.findings.subject import Subject
from hovi.robot.urdf.closed_loops import Tie, closed_loops


def loops(subject: Subject) -> Iterator[Finding]:
    """Ties of links and joints that move relative to each other."""
    ties = [] if subject.urdf is None else closed_loops(subject.urdf)
    moving = {tie: _joints_between(subject, tie) for tie in ties}
    found = {tie: joints for tie, joints in moving.items() if joints or not _is_known(subject, tie)}
    if not found:
        return
    joints = list(dict.fromkeys(name for names in found.values() for name in names))
    locked = [*sorted(subject.locked), *joints]
    yield Finding(
        Severity.MISLEADS,
        "open-loop",
        tuple(dict.fromkeys(end for tie in found for end in tie.ends)),
        f"not kept, so that its links move freely: {some_of([tie.text for tie in found])}",
        (Line(PYTHON, f"locked={locked!r}"),) if joints else (),
    )


def open_loops(file: str, parts: str, ties: Sequence[str]) -> str:
    """The warning where a file with loops is loaded. parts: what moves freely."""
    return (
        f"{file}: its {parts} move freely, without {some_of(ties, 3)}: lock the joints of the "
        "loop, or plan for a robot without it."
    )


def _is_known(subject: Subject, tie: Tie) -> bool:
    """Whether the ends of a tie are links or joints of the URDF."""
    if subject.urdf is None:
        return False
    names = {x.get("name") for tag in ("link", "joint") for x in subject.urdf.iterfind(tag)}
    return len(tie.ends) == 2 and names.issuperset(tie.ends)


def _joints_between(subject: Subject, tie: Tie) -> tuple[str, ...]:
    """The joints that move one end of a tie and not the other, or that it ties itself."""
    supports = [_supports(subject, end) for end in tie.ends]
    apart = set(supports[0]).symmetric_difference(*supports[1:]) if len(supports) == 2 else ()
    return tuple(name for name in subject.joints if name in apart)


def _supports(subject: Subject, end: str) -> tuple[str, ...]:
    if end in subject.joints:
        return (end,)
    body = next((i for i, names in subject.bodies.items() if end in names), 0)
    return tuple(str(subject.model.names[i]) for i in list(subject.model.supports[body])[1:])
