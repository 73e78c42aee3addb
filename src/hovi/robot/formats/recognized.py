"""Which format a robot is in, by its name and its first bytes."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import Literal

from hovi.errors import ModelError
from hovi.system.files import require_file

Format = Literal["urdf", "xacro", "mjcf", "sdf", "description"]

_MAX_BYTES = 2**26
_HEAD = 2**16  # bytes in which the first element is looked for
_ROOT = re.compile(rb"<\s*(mujoco|sdf)\b")
_DESCRIPTION = re.compile(r"\w+_description")


def format_of(robot: str | Path) -> Format:
    """The format of a file, or "description" for a name of robot_descriptions.

    Files are recognized by their extension, and those that end in .xml by their first element, too;
    other texts count as URDF, or as names that are looked up elsewhere.
    """
    text = str(robot).lower()
    if isinstance(robot, str) and _DESCRIPTION.fullmatch(robot):
        return "description"
    if text.endswith(".xacro"):
        return "xacro"
    if text.endswith(".sdf"):
        return "sdf"
    if text.endswith((".xml", ".mjcf")):
        found = _ROOT.search(_head(Path(robot)))
        if found or text.endswith(".mjcf"):
            return "sdf" if found and found[1] == b"sdf" else "mjcf"
    return "urdf"


def require_untrusted(robot: str | Path) -> None:
    """Raise ModelError for a robot that only code may name: what its file does is not known before.

    Xacro evaluates expressions and includes other files, MJCF includes files, and a name of
    robot_descriptions downloads a repository.
    """
    form = format_of(robot)
    if form in ("xacro", "mjcf", "description"):
        raise ModelError(
            f"a file may name a URDF or an example robot, and {str(robot)!r} is neither: load it "
            f"in Python with hovi.load_robot({str(robot)!r}), or convert it to a URDF."
        )


def _head(path: Path) -> bytes:
    with suppress(OSError, ValueError):  # reported by who reads it
        require_file(path, _MAX_BYTES)
        with path.open("rb") as stream:
            return re.sub(rb"<!--.*?-->", b"", stream.read(_HEAD), flags=re.DOTALL)
    return b""
