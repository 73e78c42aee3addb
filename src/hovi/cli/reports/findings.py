"""What will hurt about a robot's file, as text and as JSON."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from hovi.robot.findings.finding import SRDF, Finding, Line, Severity, element

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot

_HEADINGS = {
    Severity.STOPS: "Stops a plan",
    Severity.MISLEADS: "Plans for another robot than meant",
    Severity.HINT: "Makes plans poorer",
}
"""What is printed, in its order; notes are those of `hovi info`."""
_SHOWN = 4
"""Lines that are printed of a finding; JSON has all."""
_NAMED = re.compile(r"(\w+)\[@name=(['\"].*?['\"])\]")


def findings_of(robot: Robot, model: pin.Model | None = None) -> tuple[Finding, ...]:
    """What will hurt about a robot, the worst first.

    model: of a scene, with its rotors; lines are those of a scene file then.

    Raises ModelError for an SRDF that cannot be read.
    """
    from hovi.robot.file_findings import file_findings, in_order

    _ = robot.poses  # reads the SRDF
    found = file_findings(model or robot.model, robot.source, robot.tip_frames)
    has_shapes = all(each.kind not in ("mesh", "mesh-unit") for each in found)
    if has_shapes and not robot.unplanned_joints:
        found = in_order([*found, *_collisions(robot)])
    shown = tuple(each for each in found if each.severity in _HEADINGS)
    return shown if model is None else tuple(_in_scene_file(each) for each in shown)


def _in_scene_file(found: Finding) -> Finding:
    return dataclasses.replace(found, lines=tuple(line.in_scene_file for line in found.lines))


def _collisions(robot: Robot) -> Iterator[Finding]:
    """Pairs of links that always touch, or why there are none to look at."""
    from hovi.errors import ModelError, some_of
    from hovi.planning.clearance.self_collisions import names_shapes, touching_links

    pairs: tuple[tuple[str, str], ...] = ()
    try:
        given = robot.given[1] is not None and robot.given[1].ngeoms > 0
        pairs = touching_links(robot) if given or names_shapes(robot) else ()
    except ModelError as problem:
        sentence = f"links are not kept apart: {str(problem).removesuffix('.')}"
        yield Finding(Severity.MISLEADS, "collision-shape", (), sentence)
    if pairs:
        shown = some_of([f"{a} and {b}" for a, b in pairs])
        yield Finding(
            Severity.HINT,
            "always-touching",
            tuple(dict.fromkeys(link for pair in pairs for link in pair)),
            f"collision shapes overlap at every configuration, of {shown}: they are not kept "
            "apart; disable such pairs in an SRDF",
            tuple(
                Line(SRDF, element("disable_collisions", {"link1": a, "link2": b}))
                for a, b in pairs
            ),
        )


def stops(findings: tuple[Finding, ...]) -> bool:
    """Whether one of them stops a plan."""
    return any(each.severity is Severity.STOPS for each in findings)


def findings_json(robot: Robot, findings: tuple[Finding, ...]) -> dict[str, Any]:
    """`robot`, whether one `stops` a plan, the `tips` that goals may name, and `findings`."""
    return {
        "robot": robot.name,
        "stops": stops(findings),
        "tips": list(robot.tip_frames),
        "findings": [
            {
                "severity": str(each.severity),
                "kind": each.kind,
                "subject": list(each.subject),
                "sentence": each.sentence,
                "lines": [{"where": line.where, "text": line.text} for line in each.lines],
            }
            for each in findings
        ],
    }


def print_findings(robot: Robot, findings: tuple[Finding, ...]) -> None:
    """Print each finding under what it does to a plan, with the lines to write."""
    tips = ", ".join(robot.tip_frames)
    if not findings:
        print(f"{robot.name}: nothing hurts. Goals may name the frame {tips}.")
        return
    count = f"{len(findings)} finding{'' if len(findings) == 1 else 's'}"
    which = "" if stops(findings) else ", none of which stops a plan"
    print(f"{robot.name}: {count}{which}. Goals may name the frame {tips}.")
    printed = set[str]()
    for severity, heading in _HEADINGS.items():
        found = [each for each in findings if each.severity is severity]
        if found:
            print(f"\n{heading}:")
        for each in found:
            print(f"- {each.sentence}")
            lines = list(_shown(each.lines))
            again = bool(lines) and printed.issuperset(lines)
            for line in ("the lines above",) if again else lines:
                print(f"    {line}")
            printed.update(lines)


def _shown(lines: tuple[Line, ...]) -> Iterator[str]:
    for line in lines[:_SHOWN]:
        text = line.text.replace("\n", "\n    ")
        yield f"{_place(line.where)}: {text}"
    if len(lines) > _SHOWN:
        yield f"and {len(lines) - _SHOWN} more, which --json has"


def _place(where: str) -> str:
    """The path of an element in words."""
    if where == ".":
        return "in <robot>"
    named = _NAMED.sub(lambda found: f"{found[1]} {found[2]}", where)
    return f"in {named.replace('/', ', ')}" if named != where else where
