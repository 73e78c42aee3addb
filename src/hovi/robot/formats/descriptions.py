"""Robots of robot_descriptions, which clones a repository that is not in its cache."""

from __future__ import annotations

import importlib
import os
from pathlib import Path

from hovi.errors import ModelError, nearest
from hovi.system.dataclass import dataclass


@dataclass(frozen=True)
class Description:
    """Where the files of a description are: the URDF, xacro or MJCF, and folders of packages."""

    path: Path
    package_dirs: tuple[str, ...]


def description_of(name: str) -> Description:
    """The files of a description such as "panda_description", cloned if need be.

    Its cache is ~/.cache/robot_descriptions, or ROBOT_DESCRIPTIONS_CACHE.
    Raises ModelError for an unknown name, without the package, and where the clone fails.
    """
    try:
        known = importlib.import_module("robot_descriptions._descriptions").DESCRIPTIONS
    except ImportError:
        raise ModelError(
            f"there is no example robot {name!r}; names that end in _description are those of "
            "robot_descriptions: run pip install 'hovi[robots]'."
        ) from None
    if name not in known:
        raise ModelError(f"robot_descriptions has no {name!r}: {nearest(name, known)}")
    try:
        module = importlib.import_module(f"robot_descriptions.{name}")
    except Exception as error:  # of git, of the network, of the disk
        first = str(error).strip().splitlines() or [type(error).__name__]
        raise ModelError(
            f"robot_descriptions cannot clone the repository of {name!r} ({first[-1].strip()}): "
            "check the network, or give the path of a URDF."
        ) from error
    attributes = ("URDF_PATH", "XACRO_PATH", "MJCF_PATH")
    path = next((getattr(module, each) for each in attributes if hasattr(module, each)), None)
    if path is None:
        raise ModelError(f"{name!r} of robot_descriptions is neither URDF, xacro nor MJCF.")
    homes = (module.PACKAGE_PATH, module.REPOSITORY_PATH)
    folders = [*homes, *map(os.path.dirname, homes)]
    return Description(Path(path), tuple(dict.fromkeys(folders)))
