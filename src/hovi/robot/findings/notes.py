"""What is read in another way than one may think, or not at all."""

from __future__ import annotations

from collections.abc import Iterator

from hovi.errors import some_of
from hovi.robot.findings.finding import COMMAND_LINE, PYTHON, Finding, Line, Severity
from hovi.robot.findings.subject import Subject
from hovi.robot.urdf.spelling import ignored_names


def on_groups(subject: Subject) -> Iterator[Finding]:
    """Joints with nq != nv."""
    names = tuple(name for name, joint in subject.joints.items() if joint.nq != joint.nv)
    if names:
        yield _note(
            "group",
            names,
            f"nq and nv differ at {some_of(names)}: a continuous joint takes its angle, "
            "and is (cos, sin) in arrays q; an orientation takes a unit quaternion (x, y, z, w)",
        )


def ambiguous_frames(subject: Subject) -> Iterator[Finding]:
    """Names that several frames have."""
    for name, taken in subject.ambiguous.items():
        yield _note(
            "ambiguous-frame",
            (name,),
            f"several frames are named {name!r}: the name stands for the {taken}, and not for "
            "those elsewhere",
        )


def of_reader(subject: Subject) -> Iterator[Finding]:
    """What the reader of another format noted."""
    for note in subject.notes:
        yield Finding(Severity.MISLEADS, "not-read", (), note)


def harmless(subject: Subject) -> Iterator[Finding]:
    """What was taken out of a URDF, since it changes nothing."""
    for note, names in subject.harmless.items():
        found = tuple(dict.fromkeys(names))
        yield _note("oddity", found, f"{some_of(found)}: {note}")


def mimics(subject: Subject) -> Iterator[Finding]:
    """Joints that mimic others in the URDF, and do not in the model."""
    names = tuple(x for x, joint in subject.elements.items() if joint.find("mimic") is not None)
    if names and not subject.mimic:
        yield Finding(
            Severity.MISLEADS,
            "mimic-ignored",
            names,
            f"{some_of(names)}: <mimic> is ignored without mimic=True; the joint moves freely",
            (Line(COMMAND_LINE, "--mimic"), Line(PYTHON, "mimic=True")),
        )
    if subject.mimic and not names and not subject.leaders:
        yield _note("mimic-unused", (), "no joint mimics another: mimic=True has no effect")
    free = tuple(x for x, leader in subject.leaders.items() if _ranges_are_lost(subject, x, leader))
    if free and subject.mimic:
        yield Finding(
            Severity.HINT,
            "mimic-range",
            free,
            f"the position range of {some_of(free)} is not enforced, since its leader is a "
            "continuous joint",
        )


def _ranges_are_lost(subject: Subject, follower: str, leader: str) -> bool:
    """Whether a follower has a position range and its leader is a continuous joint."""
    joint = subject.elements.get(follower)
    return joint is not None and joint.get("type") == "revolute" and subject.joints[leader].nq == 2


def unknown_names(subject: Subject) -> Iterator[Finding]:
    """Elements and attributes that URDF does not have."""
    names = () if subject.urdf is None else tuple(ignored_names(subject.urdf))
    if names:
        yield _note(
            "unknown-name",
            names,
            f"ignored, since URDF has no such elements and attributes: {some_of(names)}",
        )


def _note(kind: str, subject: tuple[str, ...], sentence: str) -> Finding:
    return Finding(Severity.NOTE, kind, subject, sentence)
