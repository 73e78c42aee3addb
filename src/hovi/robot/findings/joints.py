"""Robots without a joint that moves, and joints that no motion is planned for."""

from __future__ import annotations

from collections.abc import Iterator

from hovi.errors import some_of
from hovi.robot.findings.finding import COMMAND_LINE, PYTHON, Finding, Line, Severity
from hovi.robot.findings.subject import Subject
from hovi.robot.space.configuration_space import configuration_space


def no_joints(subject: Subject) -> Iterator[Finding]:
    """A robot in which nothing moves."""
    if subject.model.nv == 0:
        yield Finding(
            Severity.STOPS,
            "no-joint",
            (),
            "no joint moves: give one a type other than fixed, lock fewer, or let the base float",
            (Line(COMMAND_LINE, "--free-flyer"), Line(PYTHON, "free_flyer=True")),
        )


def unsupported_joints(subject: Subject) -> Iterator[Finding]:
    """Joints whose configurations are neither vectors nor elements of a supported group."""
    if names := configuration_space(subject.model)[1]:
        yield Finding(
            Severity.STOPS,
            "unsupported-joint",
            names,
            f"joints of a kind that is not planned for: {some_of(names)}; lock them",
            (Line(PYTHON, f"locked={list(names)!r}"),),
        )
