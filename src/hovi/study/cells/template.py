"""The scene file of a study, into which each cell puts its values."""

from __future__ import annotations

import copy
import hashlib
import json
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Any

from hovi.errors import HoviError
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.reading import parsed, read_toml, task_of
from hovi.planning.task_file.scene_cache import SceneCache
from hovi.planning.task_file.task import Task
from hovi.robot.example_robots import example_robot
from hovi.study.cells.field_path import FieldPath
from hovi.system.dataclass import dataclass
from hovi.system.files import names_file

HASH_DIGITS = 32
"""Hexadecimal digits of the hashes of scenes and cells, 128 bits."""
_MAX_NAME = 1000
"""Longest text of a scene file that may be the name of a file."""


@dataclass(frozen=True, eq=False)
class Template:
    """A scene file as text and as a table.

    toml: path and text. table: what it says.
    """

    toml: TomlText
    table: dict[str, Any]
    _digests: dict[str, str | None] = field(default_factory=dict, repr=False)

    @classmethod
    def read(cls, path: Path) -> Template:
        """The template of a file. Raises SceneError."""
        toml = read_toml(path)
        return cls(toml, parsed(toml))

    def with_values(self, values: tuple[tuple[FieldPath, Any], ...]) -> dict[str, Any]:
        """The table with other values of some fields. Raises SceneError."""
        table = copy.deepcopy(self.table)
        for path, value in values:
            path.put(table, copy.deepcopy(value))
        return table

    def task(self, table: dict[str, Any], cache: SceneCache) -> Task:
        """The task of a table of `with_values`. Raises as `load_task` does."""
        return task_of(table, self.toml, cache)

    @cached_property
    def hash(self) -> str:
        """Of the scene file and of the files that it names."""
        return content_hash({"scene": self.table, "files": self.files(self.table)})

    def files(self, table: dict[str, Any]) -> dict[str, str]:
        """The SHA-256 of each file that a table names, relative to the folder of the scene file.

        Among them the URDF and the SRDF of the robot. Meshes that a URDF names are left out.
        """
        named = {text: self._digest(text, self._robot_files) for text in [table.get("robot")]}
        for text in _texts(table):
            if text not in named and "." in text:
                named[text] = self._digest(text, self._file)
        return {str(text): digest for text, digest in named.items() if digest is not None}

    def _digest(self, text: Any, find: Any) -> str | None:
        if not isinstance(text, str) or len(text) > _MAX_NAME:
            return None
        if text not in self._digests:
            found = [each for each in find(text) if names_file(each)]
            self._digests[text] = _hash_of_files(found) if found else None
        return self._digests[text]

    def _file(self, text: str) -> list[Path]:
        return [self.toml.path.parent / text]

    def _robot_files(self, text: str) -> list[Path]:
        """The URDF and the SRDF of a robot by its path or its name."""
        if text.endswith(".urdf"):
            return self._file(text)
        try:
            known = example_robot(text)
        except HoviError:
            return []  # of which the plan will say why
        return [known.urdf] if known.srdf is None else [known.urdf, known.srdf]


def content_hash(content: Any) -> str:
    """The hash of JSON-compatible data."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), default=str)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:HASH_DIGITS]


def _hash_of_files(paths: list[Path]) -> str | None:
    found = hashlib.sha256()
    try:
        for path in paths:
            with path.open("rb") as stream:
                found.update(hashlib.file_digest(stream, "sha256").digest())
    except OSError:
        return None
    return found.hexdigest()


def _texts(value: Any) -> list[str]:
    """All texts in a table, in its order."""
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [text for each in value.values() for text in _texts(each)]
    if isinstance(value, list):
        return [text for each in value for text in _texts(each)]
    return []
