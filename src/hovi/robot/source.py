"""The source of a robot: all that is needed to build the same model again on any machine."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal, get_args

from hovi.checks.names import as_names
from hovi.errors import ModelError
from hovi.robot.formats.packages import holds_all_files
from hovi.robot.meshes.stored_meshes import StoredMeshes
from hovi.robot.tool import Tool, as_tools
from hovi.system.dataclass import dataclass

SourceKind = Literal["urdf", "example", "model"]
MAX_POSITION = 1e9
"""Largest position of a locked joint, in [rad] or [m]."""
_NO_MESHES = StoredMeshes()


@dataclass(frozen=True)
class RobotSource:
    """The text and the options that a model is built from.

    kind: "urdf" (a file), "example" (a name of example-robot-data) or "model" (a pinocchio.Model).
    reference: the name of the file, the example or the model; never a path.
    urdf: the text of the URDF; None for kind "model".
    sha256: of that text in UTF-8, in hexadecimal.
    package_dirs: folders in which `package://` meshes are looked up, none of which holds the files
        of every user.
    locked: joints that are fixed, which are not part of the model.
    locked_at: their positions in [rad] or [m]; 0, the neutral one, for all of them if empty.
    free_flyer: whether the base floats.
    folder: folder of the URDF file, for its meshes; "" if unknown.
    armature: reflected rotor inertia in [kg m^2] by joint, from an example's SRDF.
    srdf: the text of the SRDF, or None.
    mimic: whether joints with a <mimic> tag follow their leaders.
    tools: frames that are added to the model.
    notes: what the file of a model says and the model does not have, for `hovi info`.
    meshes: those stored in a motion's file, which are taken before any of a folder.
    Raises ModelError for such a folder.
    """

    kind: SourceKind
    reference: str
    urdf: str | None = field(default=None, repr=False)
    sha256: str | None = None
    package_dirs: tuple[str, ...] = ()
    locked: tuple[str, ...] = ()
    locked_at: tuple[float, ...] = ()
    free_flyer: bool = False
    folder: str = ""
    armature: tuple[tuple[str, float], ...] = ()
    srdf: str | None = field(default=None, repr=False)
    mimic: bool = False
    notes: tuple[str, ...] = ()
    tools: tuple[Tool, ...] = ()
    meshes: StoredMeshes = field(default=_NO_MESHES, compare=False, repr=False)

    def __post_init__(self) -> None:
        _check_folders(self.package_dirs)

    @property
    def held(self) -> dict[str, float]:
        """The positions of the locked joints by name, in [rad] or [m]."""
        return dict(zip(self.locked, self.locked_at or (0.0,) * len(self.locked), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """A JSON-compatible dictionary without local paths."""
        return {
            "kind": self.kind,
            "reference": self.reference,
            "urdf": self.urdf,
            "sha256": self.sha256,
            "locked": list(self.locked),
            **({"locked_at": list(self.locked_at)} if any(self.locked_at) else {}),
            "free_flyer": self.free_flyer,
            **({"mimic": True} if self.mimic else {}),
            **({"tools": {x.name: x.to_dict() for x in self.tools}} if self.tools else {}),
            "armature": dict(self.armature),
            "srdf": self.srdf,
        }

    @classmethod
    def from_dict(
        cls,
        data: Mapping[str, Any],
        package_dirs: Iterable[str | Path] = (),
        meshes: Mapping[str, StoredMeshes] | None = None,
    ) -> RobotSource:
        """The source from the result of `to_dict`. Raises ModelError if it is incomplete.

        meshes: of robots, by the sha256 of their URDFs.
        """
        kind = _entry(data, "kind", str)
        if kind not in get_args(SourceKind):
            raise ModelError(
                f"a stored robot is of kind 'urdf', 'example' or 'model', not {kind!r}."
            )
        urdf, sha256 = data.get("urdf"), data.get("sha256")
        if kind != "model" and (not isinstance(urdf, str) or sha256 != text_hash(urdf)):
            raise ModelError(
                f"the URDF stored with robot {data.get('reference')!r} does not match its own "
                "sha256: the file was damaged or edited; load the robot again from its URDF."
            )
        locked = tuple(str(name) for name in _entry(data, "locked", list))
        return cls(
            kind=kind,
            reference=_entry(data, "reference", str),
            urdf=urdf,
            sha256=sha256,
            package_dirs=absolute_folders(package_dirs),
            locked=locked,
            locked_at=_positions(data.get("locked_at", []), len(locked)),
            free_flyer=_entry(data, "free_flyer", bool),
            armature=_armature(_entry(data, "armature", dict)),
            srdf=None if data.get("srdf") is None else _entry(data, "srdf", str),
            mimic="mimic" in data and _entry(data, "mimic", bool),
            tools=as_tools(data.get("tools", {})),
            meshes=(meshes or {}).get(sha256 or "", _NO_MESHES),
        )


def absolute_folders(folders: Iterable[str | Path]) -> tuple[str, ...]:
    """The paths of package_dirs, or of a single one, from the root.

    Raises InputError for others than paths, ModelError for a folder of everybody's files.
    """
    paths = tuple(str(Path(folder).absolute()) for folder in as_names(folders))
    _check_folders(paths)
    return paths


def _check_folders(package_dirs: tuple[str, ...]) -> None:
    for folder in package_dirs:
        if holds_all_files(folder):
            raise ModelError(
                f"package_dirs names {folder!r}, which holds the files of every user, so that "
                "meshes could be read from anywhere: name the folder of the packages."
            )


def text_hash(text: str) -> str:
    """The sha256 of a text in UTF-8, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def _positions(stored: Any, count: int) -> tuple[float, ...]:
    numbers = isinstance(stored, list) and all(
        isinstance(x, int | float) and abs(x) <= MAX_POSITION for x in stored
    )
    if not numbers or len(stored) not in (0, count):
        raise ModelError(
            f"a stored robot needs {count} positions of locked joints under 'locked_at', or none, "
            f"not {stored!r}."
        )
    return tuple(float(x) for x in stored)


def _armature(stored: dict[str, Any]) -> tuple[tuple[str, float], ...]:
    for joint, value in stored.items():
        if not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise ModelError(f"the armature of joint {joint!r} must be 0 or more, not {value!r}.")
    return tuple((joint, float(value)) for joint, value in stored.items())


def _entry(data: Mapping[str, Any], key: str, expected: type) -> Any:
    value = data.get(key)
    if not isinstance(value, expected):
        raise ModelError(
            f"a stored robot needs a {expected.__name__} under {key!r}, not {value!r}."
        )
    return value
