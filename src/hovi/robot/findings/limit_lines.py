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

    What the file leaves empty, or at 0, has an example. factor: of the range of positions.
    """
    lower, upper = (factor * bound for bound in subject.single.get(joint, (0.0, 0.0)))
    if not lower < upper:
        half = TURN if kind_of(subject.joints[joint]).units == (ANGLE,) else STROKE
        lower, upper = -half, half
    joint_element = subject.elements.get(joint)
    if joint_element is None:
        return Line(PYTHON, f'limits={{"q": {{{joint!r}: [{lower:.5g}, {upper:.5g}]}}}}')
    limit = joint_element.find("limit")
    stated = {} if limit is None else limit.attrib
    speed, effort = (
        stated.get(key) if float(stated.get(key, "0")) else example
        for key, example in (("velocity", SPEED), ("effort", EFFORT))
    )
    span = {"lower": f"{lower:.5g}", "upper": f"{upper:.5g}"}
    if joint_element.get("type") not in ("revolute", "prismatic"):
        span = {}
    text = element("limit", {**span, "effort": str(effort), "velocity": str(speed)})
    return Line(f"joint[@name={quoted(joint)}]", text)
