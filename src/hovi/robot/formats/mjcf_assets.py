"""Meshes of an MJCF."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from xml.etree.ElementTree import Element

import numpy as np

from hovi.errors import ModelError
from hovi.robot.formats.mjcf_defaults import Compiler, Defaults, sections
from hovi.robot.formats.mjcf_poses import rotation_of
from hovi.robot.formats.mjcf_text import MjcfError, numbers
from hovi.robot.meshes.reading import MAX_MESH_BYTES, MESH_TYPES, triangles_in
from hovi.robot.meshes.triangles import Triangles
from hovi.system.files import reason, require_file


class Meshes:
    """The meshes of the assets by name, read when they are needed first."""

    def __init__(self, root: Element, folder: Path, compiler: Compiler, defaults: Defaults) -> None:
        self.folder, self.compiler, self.found = folder, compiler, dict[str, Triangles]()
        self.given: dict[str, dict[str, str]] = {}
        for element in sections(root, "asset"):
            if element.tag == "mesh":
                values = defaults.of(element, "")
                name = values.get("name", PurePosixPath(values.get("file", "")).stem)
                self.given[name] = values

    def path(self, name: str) -> Path:
        """The file of a mesh."""
        file = PurePosixPath(self.given.get(name, {}).get("file", "").replace("\\", "/"))
        return (
            self.folder
            / self.compiler.mesh_folder
            / (file.name if self.compiler.strip_path else file)
        )

    def read(self, name: str) -> Triangles:
        """The triangles of a mesh, scaled, in [m]. Raises MjcfError."""
        if name not in self.found:
            self.found[name] = self._read(name)
        return self.found[name]

    def _read(self, name: str) -> Triangles:
        if name not in self.given:
            raise MjcfError(f"there is no mesh {name[:60]!r} in <asset>.")
        path, given = self.path(name), self.given[name]
        if path.suffix.lower() not in MESH_TYPES or "builtin" in given:
            raise MjcfError(f"mesh {name[:60]!r} is not a file of {', '.join(MESH_TYPES)}.")
        try:
            require_file(path, MAX_MESH_BYTES)
            mesh = triangles_in(path, path.read_bytes())
        except (OSError, ValueError) as error:
            why = reason(error) if isinstance(error, OSError) else str(error)
            raise MjcfError(f"mesh {path.name!r} cannot be read: {why}.") from error
        except ModelError as error:
            raise MjcfError(str(error)) from None
        return _placed(mesh, given, f"mesh {name[:60]!r}", self.compiler)


def _placed(mesh: Triangles, given: dict[str, str], where: str, compiler: Compiler) -> Triangles:
    """A mesh relative to its reference pose, and scaled."""
    position, scale = numbers(given, "refpos", where, 3), numbers(given, "scale", where, 3)
    quat = {"quat": given["refquat"]} if "refquat" in given else {}
    vertices = mesh.vertices - (np.zeros(3) if position is None else position)
    vertices = vertices @ rotation_of(quat, where, compiler.angles)
    factors = np.ones(3) if scale is None else scale
    corners = mesh.triangles[:, ::-1] if factors.prod() < 0.0 else mesh.triangles
    return Triangles(vertices * factors, corners)
