"""Meshes of robots stored in a motion's file: by their names in the URDF, each content once.

Names are only looked up, never opened, so that no name in a file leads to a folder of the reader.
"""

from __future__ import annotations

import hashlib
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cached_property
from pathlib import PurePosixPath
from typing import Any

from hovi.errors import InputError
from hovi.system.dataclass import dataclass

MAX_KEPT_BYTES = 20_000_000
"""Largest sum of the compressed files that a motion keeps."""
MAX_CONTENT_BYTES = 256_000_000
"""Largest sum of their contents."""
MAX_KEPT_FILES = 5_000
"""Largest number of them, and of the meshes of a robot."""
_LEVEL = 1  # the higher ones save 15 % on UR5 and Panda, in six times the time and more
_HASH = re.compile(r"[0-9a-f]{64}")
_CHUNK = 2**20


@dataclass(frozen=True)
class StoredMesh:
    """A mesh that a URDF names.

    sha256: of the content of its file. textures: the same of each texture, by its name in the mesh.
    """

    sha256: str
    textures: Mapping[str, str] = field(default_factory=dict)

    @property
    def hashes(self) -> tuple[str, ...]:
        """The sha256 of its file and of its textures."""
        return (self.sha256, *self.textures.values())


@dataclass(frozen=True, eq=False, repr=False)
class StoredMeshes:
    """The meshes of one robot.

    meshes: by their names in the URDF. packed: the compressed contents of files, by their hashes.
        A mesh of which a file is not there is known by its hash alone.
    """

    meshes: Mapping[str, StoredMesh] = field(default_factory=dict)
    packed: Mapping[str, bytes] = field(default_factory=dict)

    def keeps(self, name: str) -> bool:
        """Whether the contents of a mesh are there."""
        return name in self.meshes and all(x in self.packed for x in self.meshes[name].hashes)

    def content(self, sha256: str) -> bytes:
        """The content of a file that is there."""
        return zlib.decompress(self.packed[sha256])

    @cached_property
    def paths(self) -> dict[str, str]:
        """Stand-in paths of the meshes that are there, by name: a hash in place of the folder."""
        kept = (name for name in self.meshes if self.keeps(name))
        return {
            name: f"{self.meshes[name].sha256}-{number}/{PurePosixPath(name).name}"
            for number, name in enumerate(kept)
        }

    def name_at(self, path: str) -> str | None:
        """The name of a mesh by its stand-in path; None for another path."""
        return next((name for name, each in self.paths.items() if each == path), None)


class Packing:
    """Compresses files until they take more than a motion keeps.

    packed: the compressed contents by their hashes.
    """

    def __init__(self) -> None:
        self.packed: dict[str, bytes] = {}
        self._added: dict[str, bytes] = {}
        self._room = self._left = MAX_KEPT_BYTES, MAX_CONTENT_BYTES, MAX_KEPT_FILES

    @property
    def is_full(self) -> bool:
        """Whether what was added since the last call of `keep` is too much."""
        return min(self._left) < 0

    def add(self, content: bytes) -> str:
        """Add a file, if there is room. Returns its hash."""
        sha256 = content_hash(content)
        if not self.is_full and sha256 not in self.packed and sha256 not in self._added:
            self._added[sha256] = packed = zlib.compress(content, _LEVEL)
            kept, contents, files = self._left
            self._left = kept - len(packed), contents - len(content), files - 1
        return sha256

    def keep(self) -> None:
        """Keep all that was added since the last call, or nothing if it is too much."""
        fits, added, self._added = not self.is_full, self._added, {}
        self.packed |= added if fits else {}
        self._room = self._left = self._left if fits else self._room


def content_hash(content: bytes) -> str:
    """The sha256 of a file's content, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def to_table(robots: Mapping[str, StoredMeshes]) -> dict[str, Any]:
    """JSON-compatible data: the meshes of robots by the sha256 of their URDFs, and what is kept."""
    kept = {sha256 for each in robots.values() for sha256 in each.packed}
    return {"robots": {urdf: _names(each) for urdf, each in robots.items()}, "kept": sorted(kept)}


def _names(stored: StoredMeshes) -> dict[str, Any]:
    return {
        name: {"sha256": mesh.sha256, "textures": dict(mesh.textures)}
        for name, mesh in stored.meshes.items()
    }


def hashes_in(table: Any) -> list[str]:
    """The hashes of the files that are kept. Raises InputError for another table."""
    kept = table.get("kept") if isinstance(table, Mapping) else None
    if not isinstance(kept, list) or len(kept) > MAX_KEPT_FILES or not all(map(_is_hash, kept)):
        raise InputError(f"its meshes are no list of at most {MAX_KEPT_FILES:,} hashes")
    if len(set(kept)) < len(kept):
        raise InputError("a mesh is in its list twice")
    return kept


def from_table(table: Mapping[str, Any], packed: Mapping[str, bytes]) -> dict[str, StoredMeshes]:
    """The inverse of `to_table`. packed: the compressed contents by their hashes.

    Raises InputError for other data, too large files, and contents that do not have their hashes.
    """
    robots = table.get("robots")
    if not isinstance(robots, Mapping) or not all(isinstance(x, Mapping) for x in robots.values()):
        raise InputError("its meshes are no tables of names")
    if sum(map(len, robots.values())) > MAX_KEPT_FILES:
        raise InputError(f"it names more than {MAX_KEPT_FILES:,} meshes")
    _check_contents(packed)
    return {
        urdf: StoredMeshes({name: _mesh(name, given) for name, given in each.items()}, packed)
        for urdf, each in robots.items()
    }


def _mesh(name: str, given: Any) -> StoredMesh:
    entries: Mapping[str, Any] = given if isinstance(given, Mapping) else {}
    sha256, textures = entries.get("sha256"), entries.get("textures")
    if isinstance(textures, Mapping) and all(map(_is_hash, (sha256, *textures.values()))):
        return StoredMesh(str(sha256), dict(textures))
    raise InputError(f"its mesh {name[:200]!r} has no hashes of its file and its textures")


def _is_hash(value: Any) -> bool:
    return isinstance(value, str) and _HASH.fullmatch(value) is not None


def _check_contents(packed: Mapping[str, bytes]) -> None:
    """Raise InputError unless each file unpacks to its hash, and all to at most the largest sum."""
    room = MAX_CONTENT_BYTES
    for sha256, each in packed.items():
        digest = hashlib.sha256()
        for chunk in _chunks(each, sha256):
            room -= len(chunk)
            if room < 0:
                raise InputError(f"its meshes take more than {MAX_CONTENT_BYTES / 1e6:.0f} MB")
            digest.update(chunk)
        if digest.hexdigest() != sha256:
            raise InputError(f"its mesh {sha256[:12]} does not have its sha256: it was changed")


def _chunks(packed: bytes, sha256: str) -> Iterator[bytes]:
    """The content of a compressed file, of which no more is unpacked than is asked for."""
    unpacking = zlib.decompressobj()
    try:
        while chunk := unpacking.decompress(packed, _CHUNK):
            yield chunk
            packed = unpacking.unconsumed_tail
    except zlib.error as error:
        raise InputError(f"its mesh {sha256[:12]} is damaged") from error
    if not unpacking.eof or unpacking.unused_data:
        raise InputError(f"its mesh {sha256[:12]} is not complete")
