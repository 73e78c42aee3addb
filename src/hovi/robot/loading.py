"""Loads a `Robot` from a file, by the name of an example, or from a Pinocchio model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError, ModelError, expect
from hovi.robot.example_robots import BUILT_IN_CODE, build_in_code, example_robot, rotor_armature
from hovi.robot.model import build_full_model, build_model, locked_model
from hovi.robot.robot import Robot
from hovi.robot.source import RobotSource, text_hash
from hovi.robot.srdf import read_srdf_file
from hovi.robot.urdf.check import MAX_DOF, read_urdf


def is_path(text: str) -> bool:
    """Whether a string is a file path rather than the name of an example."""
    return text.lower().endswith((".urdf", ".xml", ".xacro")) or "/" in text or "\\" in text


def as_names(values: Iterable[Any]) -> tuple[Any, ...]:
    """Names as a tuple; a single string counts as one name. Raises InputError for others."""
    if isinstance(values, str | Path):
        return (values,)
    try:
        names = tuple(values)
    except TypeError:  # no iterable
        names = (None,)
    if not all(isinstance(name, str | Path) for name in names):
        raise InputError(f"expected a list of names, or a single one, got {values!r}.")
    return names


def file_source(
    path: Path,
    package_dirs: tuple[str, ...],
    locked: tuple[str, ...],
    free_flyer: bool,
    srdf: Path | None = None,
    mimic: bool = False,
) -> RobotSource:
    """The source of a URDF file and an SRDF file. Raises ModelError if one cannot be read."""
    text = read_urdf(path)
    return RobotSource(
        kind="urdf",
        reference=path.name,
        urdf=text,
        sha256=text_hash(text),
        package_dirs=package_dirs,
        locked=locked,
        free_flyer=free_flyer,
        folder=str(path.parent.absolute()),
        srdf=None if srdf is None else read_srdf_file(srdf),
        mimic=mimic,
    )


def example_source(
    name: str,
    package_dirs: tuple[str, ...],
    locked: tuple[str, ...],
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
        locked=locked,
        free_flyer=example.free_flyer if free_flyer is None else free_flyer,
        srdf=None if semantics is None else read_srdf_file(semantics),
        mimic=mimic,
    )
    if example.srdf is None or not example.rotors:
        return source
    return replace(source, armature=rotor_armature(build_full_model(source), example.srdf))


@check_arguments_except("x", "mimic", "free_flyer", "locked", "package_dirs")
def load_robot(
    x: str | Path | pin.Model,
    *,
    package_dirs: Iterable[str | Path] = (),
    free_flyer: bool | None = None,
    locked: Iterable[str] = (),
    visual: pin.GeometryModel | None = None,
    collision: pin.GeometryModel | None = None,
    srdf: str | Path | None = None,
    mimic: bool = False,
) -> Robot:
    """Load a robot. Models that do not support planning load as well; the problem refuses them.

    x: path of a URDF file; or a name of example-robot-data, such as "panda"; or a
        pinocchio.Model, which is copied. A string with a separator or ending in .urdf is a path.
    package_dirs: folders in which `package://` meshes are looked up.
    free_flyer: whether the base floats; by default it is fixed, or as the example's loader says.
    locked: joints to fix at the neutral configuration, or a single name.
    visual, collision: geometry of a pinocchio.Model.
    srdf: path of an SRDF with named poses; by default an example robot uses its own.
    mimic: whether joints with a <mimic> tag follow their leaders, without coordinates of their own
        in q; otherwise they move freely. A pinocchio.Model has its own couplings.
    Raises ModelError for an unknown file or name, an invalid URDF, an unknown joint to lock;
    InputError for a mimic or free_flyer that is neither True nor False.
    """
    expect(mimic, bool, "mimic=True or mimic=False")
    expect(False if free_flyer is None else free_flyer, bool, "free_flyer=True or free_flyer=False")
    names = as_names(locked)
    folders = tuple(str(Path(folder).absolute()) for folder in as_names(package_dirs))
    semantics = None if srdf is None else Path(srdf)
    if isinstance(x, pin.Model):
        return _from_model(x, x.name, names, (visual, collision), semantics)
    if not isinstance(x, str | Path):
        raise ModelError(f"a robot is a path, a name or a pinocchio.Model, not {type(x).__name__}.")
    if isinstance(x, Path) or is_path(x):
        source = file_source(Path(x), folders, names, bool(free_flyer), semantics, mimic)
    elif x in BUILT_IN_CODE:
        model, *shapes = build_in_code(x)
        return _from_model(model, x, names, (shapes[0], shapes[1]), semantics)
    else:
        source = example_source(x, folders, names, free_flyer, semantics, mimic)
    model = build_model(source)
    return Robot(source.reference if source.kind == "example" else model.name, model, source)


def _from_model(
    model: pin.Model,
    name: str,
    locked: tuple[str, ...],
    given: tuple[pin.GeometryModel | None, pin.GeometryModel | None],
    srdf: Path | None = None,
) -> Robot:
    if model.nv > MAX_DOF:
        raise ModelError(
            f"model {name!r} has {model.nv} degrees of freedom, at most {MAX_DOF} are "
            "accepted: lock joints with pinocchio.buildReducedModel first."
        )
    shapes = [shape.copy() for shape in given if shape is not None]
    reduced, shapes = locked_model(model.copy(), shapes, locked)
    queue = iter(shapes)
    kept = [None if shape is None else next(queue) for shape in given]
    text = None if srdf is None else read_srdf_file(srdf)
    source = RobotSource(kind="model", reference=name, locked=locked, srdf=text)
    return Robot(name, reduced, source, (kept[0], kept[1]))
