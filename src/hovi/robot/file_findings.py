"""What is found about a robot's file, the worst first: for `hovi info`, `--check` and `doctor`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pinocchio as pin

from hovi.robot.findings.boxes import Bounds, ShapeBox, shape_boxes
from hovi.robot.findings.finding import Finding, Severity
from hovi.robot.findings.inertia import (
    bare_links,
    harmful,
    impossible,
    light_joints,
    massless_links,
    no_inertia,
    points,
)
from hovi.robot.findings.joints import no_joints, unsupported_joints
from hovi.robot.findings.loops import loops
from hovi.robot.findings.meshes import large_meshes, missing_meshes, no_shapes
from hovi.robot.findings.notes import (
    ambiguous_frames,
    harmless,
    mimics,
    of_reader,
    on_groups,
    unknown_names,
)
from hovi.robot.findings.ranges import degrees, empty_ranges, millimetres, soft_limits
from hovi.robot.findings.subject import Subject
from hovi.robot.findings.tools import tools_without_frame
from hovi.robot.findings.units import grams, square_millimetres
from hovi.robot.findings.zero_limits import zero_limits
from hovi.robot.formats.packages import holds_all_files
from hovi.robot.geometry import find_mesh
from hovi.robot.mass_matrix import joints_without_inertia, little_inertia
from hovi.robot.meshes.reading import triangles_in
from hovi.robot.mimic_model import couplings_of
from hovi.robot.model import ambiguous_frames as ambiguous_names
from hovi.robot.model import frame_named
from hovi.robot.source import RobotSource
from hovi.robot.urdf.check import noted_urdf

Finder = Callable[[Subject], Iterator[Finding]]

NOTED: tuple[Finder, ...] = (
    on_groups,
    empty_ranges,
    degrees,
    millimetres,
    grams,
    square_millimetres,
    ambiguous_frames,
    zero_limits,
    light_joints,
    of_reader,
    harmless,
    mimics,
    soft_limits,
    loops,
    unknown_names,
    bare_links,
    points,
    impossible,
)
"""What is looked for wherever a robot is described."""
CHECKED: tuple[Finder, ...] = (
    no_joints,
    unsupported_joints,
    no_inertia,
    *NOTED,
    harmful,
    massless_links,
    large_meshes,
    no_shapes,
    tools_without_frame,
)
"""What is looked for where its file is checked, which reads meshes."""
_FRAME_WORDS = {pin.BODY: "link", pin.OP_FRAME: "frame", pin.SENSOR: "sensor"}
_ABOVE = 4
"""Number of folders above that of a URDF in which packages of its meshes are looked for."""
_ORDER = list(Severity)


def notes(model: pin.Model, source: RobotSource) -> list[str]:
    """What there is to say about a robot without reading its meshes, a clause each."""
    subject = _subject(model, source)
    return [found.sentence for finder in NOTED for found in finder(subject)]


def file_findings(
    model: pin.Model, source: RobotSource, tips: tuple[str, ...]
) -> tuple[Finding, ...]:
    """What is found about a robot's file, the worst first. tips: its tip frames."""
    subject = _subject(model, source, tips)
    found = [each for finder in CHECKED for each in finder(subject)]
    named = bool(source.package_dirs) and not source.reference.endswith(".xacro")  # has found ones
    found += missing_meshes(subject, lambda mesh: _package_folder(mesh, source), named)
    return in_order(found)


def in_order(findings: list[Finding]) -> tuple[Finding, ...]:
    """Findings with the worst first."""
    return tuple(sorted(findings, key=lambda each: _ORDER.index(each.severity)))


def _subject(model: pin.Model, source: RobotSource, tips: tuple[str, ...] = ()) -> Subject:
    """What is known of a robot. tips: where its shapes are looked at, too."""
    urdf, harmless_notes, boxes = None, dict[str, list[str]](), list[ShapeBox]()
    if source.urdf is not None:
        urdf, harmless_notes = noted_urdf(source.urdf, source.reference)
        boxes += shape_boxes(urdf, _bounds(source)) if tips else ()
    return Subject(
        model,
        urdf,
        harmless_notes,
        frozenset(source.locked),
        source.mimic,
        {each.follower: each.leader for each in couplings_of(model)},
        source.notes,
        little_inertia(model),
        tuple(joints_without_inertia(model)),
        {name: _word(model, name) for name in ambiguous_names(model)},
        tuple(boxes),
        tips,
    )


def _word(model: pin.Model, name: str) -> str:
    return _FRAME_WORDS.get(frame_named(model, name).type, "joint")


def _bounds(source: RobotSource) -> Callable[[str], Bounds]:
    """The bounds of a mesh by the name of its file, each file read once."""

    @cache
    def bounds(file: str) -> Bounds:
        vertices = triangles_in(*find_mesh(file, source)).vertices
        return vertices.min(axis=0), vertices.max(axis=0)

    return bounds


def _package_folder(mesh: str, source: RobotSource) -> str:
    """The folder near a URDF from which a mesh would be found, or ""."""
    rest = mesh.partition("://")[2] or mesh
    folder = Path(source.folder or "/")
    for above in (folder, *folder.parents[:_ABOVE]) if source.folder else ():
        if not holds_all_files(above) and (above / rest.lstrip("/")).is_file():
            return str(above)
    return ""
