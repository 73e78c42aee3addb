"""Tools without a frame at their tip."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hovi.errors import some_of
from hovi.robot.findings.finding import Finding, Line, Severity, element
from hovi.robot.findings.subject import Subject

LONG = 0.02
"""Length of a tool beyond its frame, in [m], from which goals should name a frame at its tip."""
NAME = "tool0"


def tools_without_frame(subject: Subject) -> Iterator[Finding]:
    """Tips whose only frame is at their joint, and whose shapes reach further."""
    found = {}
    for tip in subject.tips:
        joint, links = next((x for x in subject.bodies.items() if tip in x[1]), (0, []))
        if links != [tip] or not joint or subject.model.joints[joint].nv != 1:
            continue
        corners = [box.corners for box in subject.boxes if box.link == tip and len(box.corners)]
        if corners and (end := _end_of(np.concatenate(corners)))[1] > LONG:
            found[tip] = end
    if found:
        longest = max(found, key=lambda tip: found[tip][1])
        yield Finding(
            Severity.HINT,
            "tool-without-frame",
            tuple(found),
            f"no frame at the tip of {some_of(found)}: goals name a frame at its joint, "
            f"{found[longest][1]:.2g} m from the end of its shapes",
            tuple(x for n, tip in enumerate(found) for x in _frame(subject, tip, found[tip][0], n)),
        )


def _end_of(corners: np.ndarray) -> tuple[np.ndarray, float]:
    """The middle of the side of a box that is furthest from the origin, (3,), and how far it is."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    axis = int(np.argmax(np.maximum(-low, high)))
    end = (low + high) / 2
    end[axis] = high[axis] if high[axis] >= -low[axis] else low[axis]
    return end, float(abs(end[axis]))


def _frame(subject: Subject, tip: str, end: np.ndarray, number: int) -> Iterator[Line]:
    name = NAME if not number else f"{tip}_{NAME}"
    while name in subject.links:
        name += "_"
    at = " ".join(f"{x:.4g}" for x in end)
    yield Line(".", element("link", {"name": name}))
    ends = element("parent", {"link": tip}), element("child", {"link": name})
    joint = {"name": f"{name}_fixed", "type": "fixed"}
    yield Line(".", element("joint", joint, *ends, element("origin", {"xyz": at})))
