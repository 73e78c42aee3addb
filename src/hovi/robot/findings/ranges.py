"""Ranges of positions: empty ones, and those in degrees or millimetres."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hovi.errors import some_of
from hovi.robot.findings.finding import PYTHON, Finding, Line, Severity
from hovi.robot.findings.limit_lines import limit_line
from hovi.robot.findings.subject import Subject
from hovi.robot.space.angle_ranges import ranges_in_degrees, which_in_degrees
from hovi.robot.space.joint_kinds import ANGLE, LENGTH, kind_of
from hovi.robot.urdf.safety_controllers import soft_ranges

LONG = 50.0
"""A range of a sliding joint, in [m], from which it looks like millimetres."""


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
    angles = np.array([kind_of(subject.joints[x]).units == (ANGLE,) for x in names], dtype=bool)
    found = [names[i] for i in which_in_degrees(angles, *bounds.T)]
    if found:
        yield Finding(
            Severity.MISLEADS,
            "range-in-degrees",
            tuple(found),
            ranges_in_degrees(names, angles, *bounds.T),
            tuple(limit_line(subject, name, np.pi / 180) for name in found),
        )


def millimetres(subject: Subject) -> Iterator[Finding]:
    """Ranges of sliding joints that look like millimetres."""
    sliding = {
        name: high - low
        for name, (low, high) in subject.single.items()
        if kind_of(subject.joints[name]).units == (LENGTH,) and LONG <= high - low < 1e6
    }
    if sliding:
        longest = max(sliding, key=lambda name: sliding[name])
        span = sliding[longest]
        yield Finding(
            Severity.MISLEADS,
            "range-in-millimetres",
            tuple(sliding),
            f"the position range of {longest}, {span:g} m, looks like millimetres: "
            f"{span:g} mm are {span / 1e3:g} m",
            tuple(limit_line(subject, name, 1e-3) for name in sliding),
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
