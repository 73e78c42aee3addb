"""The <limit> of a joint as it should be written: one line for all that is wrong with it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.robot.findings.boxes import quoted
from hovi.robot.findings.finding import PYTHON, Line, element
from hovi.robot.findings.subject import Subject
from hovi.robot.space.angle_ranges import which_in_degrees
from hovi.robot.space.joint_kinds import ANGLE, LENGTH, kind_of

TURN, STROKE = 3.1416, 0.1
"""An example of half a range of angles in [rad], and of lengths in [m]."""
SPEED, EFFORT = "3", "100"
"""Examples of limits, in [rad/s] or [m/s] and in [N m] or [N]."""
LONG = 50.0
"""A range of a sliding joint, in [m], from which it looks like millimetres."""


def in_degrees(subject: Subject) -> list[str]:
    """The joints whose range looks like degrees."""
    names, bounds = list(subject.single), np.array(list(subject.single.values())).reshape(-1, 2)
    return [names[i] for i in which_in_degrees(are_angles(subject), *bounds.T)]


def are_angles(subject: Subject) -> npt.NDArray[np.bool_]:
    """Whether the range of each single joint is one of angles."""
    kinds = [kind_of(subject.joints[name]).units == (ANGLE,) for name in subject.single]
    return np.array(kinds, dtype=bool)


def in_millimetres(subject: Subject) -> dict[str, float]:
    """The sliding joints whose range looks like millimetres, with its length."""
    return {
        name: high - low
        for name, (low, high) in subject.single.items()
        if kind_of(subject.joints[name]).units == (LENGTH,) and LONG <= high - low < 1e6
    }


def limit_line(subject: Subject, joint: str) -> Line:
    """The element <limit>, or limits in Python for a model without a URDF.

    What the file leaves empty, or at 0, has an example, and a range in degrees or millimetres is
    converted.
    """
    factor = _factor(subject, joint)
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


def _factor(subject: Subject, joint: str) -> float:
    """What the range of a joint is multiplied by to be in [rad] or [m]."""
    if joint in in_degrees(subject):
        return np.pi / 180
    return 1e-3 if joint in in_millimetres(subject) else 1.0
