"""The <limit> of a joint as it should be written: one line for all that is wrong with it."""

from __future__ import annotations

from hovi.robot.findings.boxes import quoted
from hovi.robot.findings.finding import PYTHON, Line, element
from hovi.robot.findings.subject import Subject
from hovi.robot.space.joint_kinds import ANGLE, kind_of

TURN, STROKE = 3.1416, 0.1
"""An example of half a range of angles in [rad], and of lengths in [m]."""
SPEED, EFFORT = "3", "100"
"""Examples of limits, in [rad/s] or [m/s] and in [N m] or [N]."""


def limit_line(subject: Subject, joint: str, factor: float = 1.0) -> Line:
    """The element <limit>, or limits in Python for a model without a URDF.

    What the file leaves empty, or at 0, has an example. factor: of the range, 1 to keep it.
    """
    given = subject.single.get(joint, (0.0, 0.0))
    half = TURN if kind_of(subject.joints[joint]).units == (ANGLE,) else STROKE
    lower, upper = (f"{factor * x:.6g}" for x in (given if given[0] < given[1] else (-half, half)))
    joint_element = subject.elements.get(joint)
    if joint_element is None:
        return Line(PYTHON, f'limits={{"q": {{{joint!r}: [{lower}, {upper}]}}}}')
    limit = joint_element.find("limit")
    stated = {} if limit is None else limit.attrib
    examples = {"effort": EFFORT, "velocity": SPEED}
    written = {
        key: stated[key] if float(stated.get(key, "0")) else example
        for key, example in examples.items()
    }
    if joint_element.get("type") in ("revolute", "prismatic"):
        span = {"lower": lower, "upper": upper}
        is_kept = given[0] < given[1] and factor == 1.0
        written = {**({key: stated.get(key, "0") for key in span} if is_kept else span), **written}
    return Line(f"joint[@name={quoted(joint)}]", element("limit", written))
