"""Ranges of positions: empty ones, and those in degrees or millimetres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hovi.errors import some_of
from hovi.robot.findings.finding import PYTHON, Finding, Line, Severity
from hovi.robot.findings.limit_lines import are_angles, in_degrees, in_millimetres, limit_line
from hovi.robot.findings.subject import Subject
from hovi.robot.space.angle_ranges import ranges_in_degrees
from hovi.robot.urdf.safety_controllers import soft_ranges


def empty_ranges(subject: Subject) -> Iterator[Finding]:
    """Joints without a range, as exporters leave them: lower = upper = 0, or nothing."""
    names = tuple(name for name, (low, high) in subject.single.items() if not low < high)
    if names:
        yield Finding(
            Severity.STOPS,
            "empty-range",
            names,
            f"no range of positions at {some_of(names)} (lower = upper): lock such joints, make "
            "them continuous, or give their ranges as limits",
            tuple(limit_line(subject, name) for name in names),
        )


def degrees(subject: Subject) -> Iterator[Finding]:
    """Ranges of angles that look like degrees."""
    names, bounds = list(subject.single), np.array(list(subject.single.values())).reshape(-1, 2)
    found = in_degrees(subject)
    if found:
        yield Finding(
            Severity.MISLEADS,
            "range-in-degrees",
            tuple(found),
            ranges_in_degrees(names, are_angles(subject), *bounds.T),
            tuple(limit_line(subject, name) for name in found),
        )


def millimetres(subject: Subject) -> Iterator[Finding]:
    """Ranges of sliding joints that look like millimetres."""
    sliding = in_millimetres(subject)
    if sliding:
        longest = max(sliding, key=lambda name: sliding[name])
        span = sliding[longest]
        yield Finding(
            Severity.MISLEADS,
            "range-in-millimetres",
            tuple(sliding),
            f"the position range of {longest}, {span:g} m, looks like millimetres: "
            f"{span:g} mm are {span / 1e3:g} m",
            tuple(limit_line(subject, name) for name in sliding),
        )


def soft_limits(subject: Subject) -> Iterator[Finding]:
    """Safety controllers, whose ranges are used where they are asked for."""
    names = () if subject.urdf is None else tuple(soft_ranges(subject.urdf, subject.single))
    if names:
        yield Finding(
            Severity.NOTE,
            "soft-limits",
            names,
            f'safety controllers at {some_of(names)}: limits = "soft" has their ranges',
            (Line(PYTHON, 'limits="soft"'),),
        )
