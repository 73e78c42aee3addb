"""Checks the files that a mesh names: textures of Collada, material libraries of OBJ.

A replay page embeds the textures and shows the mesh with its library, so both must lie where the
mesh itself must lie.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path
from xml.parsers import expat

from hovi.errors import ModelError
from hovi.robot.meshes.reading import MAX_MESH_BYTES, MESH_TYPES
from hovi.system.files import reason, require_file

MAX_NAMED_BYTES = 64_000_000
"""Largest mesh, and largest texture or material library, in bytes."""

_LIBRARY_TAG = "http://www.collada.org/2005/11/COLLADASchema}library_images"
_CONTINUED = re.compile(rb"\\(?:\n|[\r\0\f][^\n]*\n)")
_LIBRARY = re.compile(rb"mtllib[ \t\v]*([^\r\n\0\f]*)")


def check_mesh(path: Path, root: Path, drawn: bool) -> bytes:
    """The content of a mesh, after a check of the names of files in it.

    path: of the mesh, an existing file.
    root: the folder that must contain everything that the mesh names.
    drawn: whether the mesh is shown, so that its textures have to exist.
    Raises ModelError for another type of file, one that is too large or unreadable, and a name that
    leaves `root` or is no regular file there.
    """
    kind = _type_of(path)
    try:
        require_file(path, MAX_MESH_BYTES)
        content = path.read_bytes()
    except OSError as error:
        raise ModelError(f"mesh {path.name!r} cannot be read: {reason(error)}.") from error
    if kind in _FILES_IN:
        for name, is_shown in _FILES_IN[kind](path.name, content):
            _check_named(path, name, root, must_exist=drawn and is_shown)
        if drawn:
            _check_text(path.name, content)
    return content


def check_stored(path: Path, content: bytes, textures: Collection[str], drawn: bool) -> None:
    """The same check of a mesh that is stored in a motion's file. Raises ModelError.

    path: its stand-in path. textures: the names of those that are stored with it.
    """
    _type_of(path)
    missing = [name for name in shown_textures(path, content) if name not in textures]
    if drawn and missing:
        raise ModelError(f"mesh {path.name!r} names {missing[0]!r}, which its motion has not kept.")
    if drawn and path.suffix.lower() in _FILES_IN:
        _check_text(path.name, content)


def shown_textures(path: Path, content: bytes) -> list[str]:
    """The names of the textures of a mesh that a page shows: those of Collada files alone."""
    if path.suffix.lower() != ".dae":
        return []
    return [name for name, is_shown in _textures(path.name, content) if is_shown]


def _type_of(mesh: Path) -> str:
    """The suffix of a mesh. Raises ModelError for another type of file."""
    kind = mesh.suffix.lower()
    if kind not in MESH_TYPES:
        raise ModelError(
            f"mesh {mesh.name!r} is not of a type that hovi reads ({', '.join(MESH_TYPES)}): "
            "convert it to one of them."
        )
    return kind


def is_inside(path: Path, folder: Path) -> bool:
    """Whether a path is inside a folder, before and after following symbolic links."""
    named = Path(os.path.normpath(path)).is_relative_to(os.path.normpath(folder.absolute()))
    return named and path.resolve().is_relative_to(folder.resolve())


def _check_named(mesh: Path, name: str, root: Path, must_exist: bool) -> None:
    try:
        file = mesh.parent / name
        instead = [] if file.exists() else [each for each in _instead(mesh, name) if each.exists()]
        if not all(is_inside(each, root) for each in (file, *instead)):
            raise ModelError(
                f"mesh {mesh.name!r} names {name!r}, which lies outside {str(root)!r}: "
                "what a mesh names must stay inside its package; copy that file there."
            )
        if must_exist or file.exists():
            require_file(file, MAX_NAMED_BYTES)
    except (OSError, ValueError, RuntimeError) as error:  # a NUL in the name, or a loop of links
        why = reason(error) if isinstance(error, OSError) else str(error)
        raise ModelError(
            f"mesh {mesh.name!r} names {name!r}, which cannot be read ({why}): "
            "put that file there, or remove its name from the mesh."
        ) from error


def _instead(mesh: Path, name: str) -> Iterator[Path]:
    """The files that Assimp tries where one that a mesh names is missing.

    They are in the folder of the mesh: the ends of the path from every slash on, and these cut to
    the length of the file's own name.
    """
    path = f"{mesh.parent}/{name}"
    size = len(path) - path.rfind("/")
    for slash in re.finditer("/", path):
        end = path[slash.end() :]
        yield from (mesh.parent / end, mesh.parent / end[:size])


def _check_text(mesh: str, content: bytes) -> None:
    """Raise ModelError unless a mesh is UTF-8: a page gets Collada and OBJ files as text."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        raise ModelError(
            f"mesh {mesh!r} is not UTF-8 text (byte {error.start}): save it as UTF-8."
        ) from error


def _textures(mesh: str, content: bytes) -> list[tuple[str, bool]]:
    """The name of every image in a Collada file, and whether a page embeds it."""
    return _ImageNames(mesh).read(content)


def _material_libraries(mesh: str, content: bytes) -> Iterator[tuple[str, bool]]:
    """The libraries that an OBJ file names, and the one that Coal opens where they are missing.

    A backslash at the end of a line continues it; Coal reads any other as a slash.
    """
    joined = _CONTINUED.sub(b"", content)
    libraries = {os.fsdecode(match[1]).replace("\\", "/") for match in _LIBRARY.finditer(joined)}
    if libraries:
        libraries.add(f"{mesh[:-4]}.mtl")
    yield from ((name, False) for name in sorted(libraries - {""}))


_FILES_IN: dict[str, Callable[[str, bytes], Iterable[tuple[str, bool]]]]
_FILES_IN = {".dae": _textures, ".obj": _material_libraries}


class _ImageNames:
    """Collects the texts of <init_from> in <library_images> and <image>, in any namespace.

    Elsewhere <init_from> has the identifier of an image. Pinocchio embeds the images that have
    init_from in their tag, inside the <library_images> of Collada 1.4, and takes the text before
    the first element inside. In Collada 1.5 the name is in a <ref>.
    """

    def __init__(self, mesh: str) -> None:
        self.mesh = mesh
        self.image_depth = self.library_depth = self.name_depth = 0
        self.text, self.begins_name = "", False
        self.names: list[tuple[str, bool]] = []

    def read(self, content: bytes) -> list[tuple[str, bool]]:
        parser = expat.ParserCreate(namespace_separator="}")
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.characters
        parser.StartDoctypeDeclHandler = self.doctype
        try:
            parser.Parse(content, True)
        except (expat.ExpatError, LookupError, ValueError) as error:  # or an unknown encoding
            raise ModelError(f"mesh {self.mesh!r} is not well-formed XML: {error}.") from error
        return self.names

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.take()
        self.image_depth += _is_image(tag)
        self.library_depth += tag == _LIBRARY_TAG
        self.name_depth += _is_name(tag)
        self.begins_name = _is_name(tag)

    def end(self, tag: str) -> None:
        self.take()
        self.image_depth -= _is_image(tag)
        self.library_depth -= tag == _LIBRARY_TAG
        self.name_depth -= _is_name(tag)

    def characters(self, text: str) -> None:
        self.text += text if self.image_depth and self.name_depth else ""

    def take(self) -> None:
        """Keep the text since the last tag, if it is the name of an image."""
        is_shown = bool(self.begins_name and self.library_depth)
        if is_shown or self.text.strip():
            self.names.append((self.text, is_shown))
        self.text, self.begins_name = "", False

    def doctype(self, *_: object) -> None:
        raise ModelError(f"mesh {self.mesh!r} has a DOCTYPE, which no mesh needs: delete it.")


def _is_image(tag: str) -> bool:
    return tag.rpartition("}")[2] in ("library_images", "image")


def _is_name(tag: str) -> bool:
    return "init_from" in tag
