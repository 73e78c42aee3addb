"""Loads a `Robot` from a file, by the name of an example, or from a Pinocchio model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_number
from hovi.checks.names import as_names
from hovi.errors import InputError, ModelError, expect, warn
from hovi.robot.example_robots import BUILT_IN_CODE, build_in_code, example_robot, rotor_armature
from hovi.robot.findings.loops import open_loops
from hovi.robot.formats.descriptions import description_of
from hovi.robot.formats.mjcf import model_of_mjcf
from hovi.robot.formats.recognized import format_of
from hovi.robot.formats.xacro import as_arguments, urdf_of_xacro
from hovi.robot.mimic_model import Coupling
from hovi.robot.mimic_tags import held_values, read_couplings
from hovi.robot.model import build_full_model, build_model, locked_model
from hovi.robot.robot import Robot
from hovi.robot.source import MAX_POSITION, RobotSource, absolute_folders, text_hash
from hovi.robot.srdf import read_srdf_file
from hovi.robot.tool import Tool, as_tools, with_tools
from hovi.robot.urdf.check import MAX_DOF, checked_urdf, read_urdf
from hovi.robot.urdf.closed_loops import closed_loops

Locked = tuple[str, ...] | Mapping[str, float]
"""Joints at their neutral configuration, or their positions in [rad] or [m] by name."""


def is_path(text: str) -> bool:
    """Whether a string is a file path rather than the name of an example."""
    suffixes = (".urdf", ".xml", ".xacro", ".mjcf", ".sdf")
    return text.lower().endswith(suffixes) or "/" in text or "\\" in text


def file_source(
    path: Path,
    package_dirs: tuple[str, ...],
    locked: Locked,
    free_flyer: bool,
    srdf: Path | None = None,
    mimic: bool = False,
    xacro_args: Mapping[str, str] | None = None,
) -> RobotSource:
    """The source of a URDF or xacro file and an SRDF file.

    Raises ModelError if one cannot be read.
    """
    if format_of(path) == "xacro":
        text, package_dirs = urdf_of_xacro(path, package_dirs, xacro_args or {})
    else:
        text = read_urdf(path)
    _warn_of_loops(text, path.name)
    return RobotSource(
        kind="urdf",
        reference=path.name,
        urdf=text,
        sha256=text_hash(text),
        package_dirs=package_dirs,
        **_held(locked, text, path.name),
        free_flyer=free_flyer,
        folder=str(path.parent.absolute()),
        srdf=None if srdf is None else read_srdf_file(srdf),
        mimic=mimic,
    )


def _warn_of_loops(urdf: str, name: str) -> None:
    """Warn of loops that are not kept; `hovi info` has them for examples, too."""
    if ties := closed_loops(checked_urdf(urdf, name)):
        warn(open_loops(f"URDF {name!r}", "links", [tie.text for tie in ties]))


def example_source(
    name: str,
    package_dirs: tuple[str, ...],
    locked: Locked,
    free_flyer: bool | None,
    srdf: Path | None = None,
    mimic: bool = False,
) -> RobotSource:
    """The source of an example robot with its SRDF. Raises ModelError for an unknown name."""
    example = example_robot(name)
    text = read_urdf(example.urdf)
    semantics = srdf or example.srdf
    source = RobotSource(
        kind="example",
        reference=name,
        urdf=text,
        sha256=text_hash(text),
        package_dirs=package_dirs,
        **_held(locked, text, name),
        free_flyer=example.free_flyer if free_flyer is None else free_flyer,
        srdf=None if semantics is None else read_srdf_file(semantics),
        mimic=mimic,
    )
    if example.srdf is None or not example.rotors:
        return source
    return replace(source, armature=rotor_armature(build_full_model(source), example.srdf))


def _checked(locked: Any) -> Locked:
    """Names of joints, or their positions by name. Raises InputError for anything else."""
    if not isinstance(locked, Mapping):
        return as_names(locked)
    for name, at in locked.items():
        if not isinstance(name, str) or not is_number(at) or not abs(at) <= MAX_POSITION:
            raise InputError(
                "locked must map names of joints to their positions in rad or m, got "
                f"{name!r}: {at!r}."
            )
    return {name: float(at) for name, at in locked.items()}


def _held(locked: Locked, urdf: str = "", name: str = "") -> dict[str, Any]:
    """The fields of a source for locked joints, with the followers of those with a position.

    urdf, name: the text of a URDF with <mimic> tags, and its name for messages.
    """
    if not isinstance(locked, Mapping):
        return {"locked": locked}
    held = dict(locked)
    if urdf:
        held = held_values(_led(urdf, name, held), held)
    at = tuple(held.values())
    return {"locked": tuple(held), "locked_at": at if any(at) else ()}


def _led(urdf: str, name: str, held: Mapping[str, float]) -> list[Coupling]:
    """The couplings to locked joints."""
    couplings = read_couplings(urdf, name, tuple(held))
    return [coupling for coupling in couplings if coupling.leader in held]


@check_arguments_except("x", "mimic", "free_flyer", "locked", "package_dirs", "xacro_args", "tools")
def load_robot(
    x: str | Path | pin.Model,
    *,
    package_dirs: Iterable[str | Path] = (),
    free_flyer: bool | None = None,
    locked: Iterable[str] | Mapping[str, float] = (),
    visual: pin.GeometryModel | None = None,
    collision: pin.GeometryModel | None = None,
    srdf: str | Path | None = None,
    mimic: bool = False,
    xacro_args: Mapping[str, Any] | None = None,
    tools: Mapping[str, Mapping[str, Any]] | None = None,
) -> Robot:
    """Load a robot. Models that do not support planning load as well; the problem refuses them.

    x: path of a URDF, xacro or MJCF file; or a name of example-robot-data, such as "panda", or of
        robot_descriptions, such as "ur10e_description"; or a pinocchio.Model, which is copied. A
        string with a separator or ending in .urdf is a path. See docs/robots.md.
    package_dirs: folders in which `package://` meshes, and the packages of a xacro file, are looked
        up; a xacro file finds those of its own source tree by itself.
    free_flyer: whether the base floats; by default it is fixed, or as the example's loader says.
    locked: joints to fix at the neutral configuration, or a single name; or a mapping from joints
        to the positions at which they are fixed, in [rad] or [m], whose followers by <mimic> tags
        are fixed where they follow them.
    visual, collision: geometry of a pinocchio.Model.
    srdf: path of an SRDF with named poses; by default an example robot uses its own.
    mimic: whether joints with a <mimic> tag follow their leaders, without coordinates of their own
        in q; otherwise they move freely. A pinocchio.Model has its own couplings.
    xacro_args: values of a xacro file's arguments by name, as `name:=value` elsewhere.
    tools: frames that are added to the robot, by name, such as the point of a tool at an offset
        from the flange: {"tcp": {"frame": "tool0", "position": [0, 0, 0.12], "rpy": [0, 0, 0]}}, in
        [m] and [rad] in that frame. Goals, what is kept and formulas name them as other frames.
    Raises ModelError for an unknown file or name, an invalid URDF, an unknown joint to lock;
    InputError for a mimic or free_flyer that is neither True nor False.
    """
    expect(mimic, bool, "mimic=True or mimic=False")
    expect(False if free_flyer is None else free_flyer, bool, "free_flyer=True or free_flyer=False")
    held, added = _checked(locked), as_tools({} if tools is None else tools)
    folders = absolute_folders(package_dirs)
    semantics = None if srdf is None else Path(srdf)
    if isinstance(x, pin.Model):
        return _from_model(x, x.name, held, (visual, collision), semantics, tools=added)
    if not isinstance(x, str | Path):
        raise ModelError(f"a robot is a path, a name or a pinocchio.Model, not {type(x).__name__}.")
    form = format_of(x)
    given_args = as_arguments(xacro_args or {})
    if form == "description":
        found = description_of(str(x))
        x, folders = found.path, (*folders, *found.package_dirs)
        form = format_of(x)
    if given_args and form != "xacro":
        raise InputError(f"xacro_args are those of a xacro file, and {str(x)!r} is none.")
    if form == "sdf":
        raise ModelError(f"{str(x)!r} is SDF, which Pinocchio's wheel does not read: save a URDF.")
    if form == "mjcf":
        found_model = model_of_mjcf(Path(x), bool(free_flyer), held)
        given = (visual or found_model.visual, collision or found_model.collision)
        model = found_model.model
        return _from_model(model, model.name, held, given, semantics, found_model.notes, added)
    if isinstance(x, Path) or is_path(x):
        source = file_source(Path(x), folders, held, bool(free_flyer), semantics, mimic, given_args)
    elif x in BUILT_IN_CODE:
        model, *both = build_in_code(x)
        return _from_model(model, x, held, (both[0], both[1]), semantics, tools=added)
    else:
        source = example_source(x, folders, held, free_flyer, semantics, mimic)
    source = replace(source, tools=added)
    model = build_model(source)
    return Robot(source.reference if source.kind == "example" else model.name, model, source)


def with_locked(robot: Robot, positions: Mapping[str, float]) -> Robot:
    """A robot with more of its joints locked, at positions in [rad] or [m] by name.

    Raises ModelError for an unknown joint, or a position that it cannot have.
    """
    source = robot.source
    held = source.held | dict(positions)
    source = replace(source, locked=tuple(held), locked_at=tuple(held.values()))
    if source.urdf is not None:
        return Robot(robot.name, build_model(source), source)
    given = [shape.copy() for shape in robot.given if shape is not None]
    model, shapes = locked_model(robot.model.copy(), given, positions)
    queue = iter(shapes)
    kept = [None if shape is None else next(queue) for shape in robot.given]
    return Robot(robot.name, model, source, (kept[0], kept[1]))


def _attach(geometry: pin.GeometryModel, model: pin.Model, name: str) -> None:
    """Give shapes without a frame that of their joint, which is added to the model if it has none.

    Raises ModelError for an unknown joint.
    """
    for shape in geometry.geometryObjects:
        if shape.parentJoint >= model.njoints:
            raise ModelError(
                f"shape {shape.name!r} is on joint {shape.parentJoint}, and model {name!r} has "
                f"{model.njoints}: give the geometry that was built with this model."
            )
        if shape.parentFrame >= model.nframes:
            joint = model.names[shape.parentJoint]
            if not model.existFrame(joint):
                model.addJointFrame(shape.parentJoint)
            shape.parentFrame = model.getFrameId(joint)


def _from_model(
    model: pin.Model,
    name: str,
    locked: Locked,
    given: tuple[pin.GeometryModel | None, pin.GeometryModel | None],
    srdf: Path | None = None,
    notes: tuple[str, ...] = (),
    tools: tuple[Tool, ...] = (),
) -> Robot:
    if model.nv > MAX_DOF:
        raise ModelError(
            f"model {name!r} has {model.nv} degrees of freedom, at most {MAX_DOF} are "
            "accepted: lock joints with pinocchio.buildReducedModel first."
        )
    model, shapes = (
        with_tools(model.copy(), tools),
        [shape.copy() for shape in given if shape is not None],
    )
    for shape in shapes:
        _attach(shape, model, name)
    held = locked if isinstance(locked, Mapping) else dict.fromkeys(locked, 0.0)
    reduced, shapes = locked_model(model, shapes, held)
    queue = iter(shapes)
    kept = [None if shape is None else next(queue) for shape in given]
    text = None if srdf is None else read_srdf_file(srdf)
    more: dict[str, Any] = {"srdf": text, "notes": notes, "tools": tools}
    source = RobotSource(kind="model", reference=name, **_held(locked), **more)
    return Robot(name, reduced, source, (kept[0], kept[1]))
