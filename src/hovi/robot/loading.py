"""From what the user names (a file or an example) to a source."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from hovi.robot.example_robots import example_robot, rotor_armature
from hovi.robot.model import build_full_model
from hovi.robot.source import RobotSource, text_hash
from hovi.robot.srdf import read_srdf_file
from hovi.robot.urdf.check import read_urdf


def is_path(text: str) -> bool:
    """Whether a text means a file and not the name of an example."""
    return text.lower().endswith((".urdf", ".xml", ".xacro")) or "/" in text or "\\" in text


def as_names(values: Iterable[Any]) -> tuple[Any, ...]:
    """Names as a tuple; a single one may come without brackets."""
    return (values,) if isinstance(values, str | Path) else tuple(values)


def file_source(
    path: Path,
    package_dirs: tuple[str, ...],
    locked: tuple[str, ...],
    free_flyer: bool,
    srdf: Path | None = None,
    mimic: bool = False,
) -> RobotSource:
    """The source of a URDF file, and of an SRDF. Raises ModelError when one cannot be read."""
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
    """The source of an example robot, its own SRDF included. Raises ModelError for a bad name."""
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
