"""Input and output files of commands, checked before any computation."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from hovi.errors import InputError, SceneError, nearest
from hovi.robot.bundled_models import example, example_scenes

if TYPE_CHECKING:
    from hovi.discrete.trajectory import Trajectory


def find_scene(scene: str) -> Path:
    """The scene file at a path, or the bundled scene of that name."""
    path = Path(scene)
    if path.exists():
        return path
    if scene in example_scenes():
        return example(f"{scene}.toml")
    hint = nearest(path.stem, example_scenes())
    if path.suffix and not hint.startswith("did you mean"):  # a path: the names would not help
        raise SceneError(f"there is no scene file {scene!r}; check the path.")
    raise SceneError(
        f"there is no scene file {scene!r}; among the scenes shipped with hovi, {hint}"
    )


def check_output(path: Path, *suffixes: str) -> Path:
    """The path, if its suffix is valid and it can be written; raises InputError if not."""
    if path.suffix.lower() not in suffixes:
        raise InputError(f"the output file must end in {' or '.join(suffixes)}, not {path.name!r}.")
    folder = path.parent
    if not folder.is_dir():
        raise InputError(
            f"the folder {str(folder)!r} of the output file does not exist; create it first."
        )
    if path.is_dir() or not os.access(folder, os.W_OK):
        raise InputError(f"{str(path)!r} cannot be written; choose another path.")
    return path


def next_to(file: Path, suffix: str) -> Path:
    """The path of a motion's file with another extension. Raises InputError if it has no name."""
    if not file.name:
        given = str(file) if file.parts else ""
        raise InputError(f"FILE must be a motion, such as motion.npz, and not {given!r}.")
    return file.with_suffix(suffix)


def load_shown(
    path: Path, package_dirs: Sequence[Path] | None = None, warned: bool = True
) -> Trajectory:
    """A motion as `load_trajectory` reads it, after its cautions are printed on stderr.

    package_dirs: folders with the packages of its robot's meshes.
    warned: whether hovi warns of those against executing the motion when it is shown.
    """
    import sys

    from hovi.discrete.output.caution import cautions_of

    motion = load_trajectory(path, package_dirs)
    for each in cautions_of(motion.metadata):
        if not (warned and each.is_against):
            with suppress(OSError):  # stderr may be closed
                print(f"caution: {each}", file=sys.stderr, flush=True)
    return motion


def load_trajectory(path: Path, package_dirs: Sequence[Path] | None = None) -> Trajectory:
    """A motion written by `hovi plan --out`."""
    from hovi.discrete.trajectory import Trajectory

    return Trajectory.load(path, package_dirs or ())
