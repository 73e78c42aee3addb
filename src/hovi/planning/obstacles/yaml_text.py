"""YAML files, read strictly: every key known and given once, errors with file and line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hovi.errors import SceneError, nearest
from hovi.system.dataclass import dataclass
from hovi.system.files import reason, require_file

MAX_BYTES = 1_000_000
"""Maximum size of a file."""
MAX_NODES = 200_000
"""Maximum number of values of a file."""
MAX_DEPTH = 50
"""Maximum number of lists and mappings inside each other."""


@dataclass(frozen=True, eq=False)
class YamlNode:
    """A value of a file with its line.

    node: as PyYAML composes it. path: of the file.
    """

    node: Any
    path: Path

    @property
    def where(self) -> str:
        """The file, with which messages begin."""
        return str(self.path)

    def error(self, what: str) -> SceneError:
        """A sentence with file and line."""
        line = self.node.start_mark.line + 1
        return SceneError(f"{self.path}, line {line}: {what}.")

    @property
    def is_mapping(self) -> bool:
        """Whether the value has keys."""
        return bool(self.node.id == "mapping")

    @property
    def holds_items(self) -> bool:
        """Whether a list in the value has an item."""
        return any(each.node.id == "sequence" and each.node.value for each in _inside(self))

    def mapping(self, *known: str) -> YamlMapping:
        """The values by key. Raises SceneError for other values and unknown or repeated keys."""
        if not self.is_mapping:
            raise self.error(f"expected the keys {', '.join(known[:4])}, got {self._shown}")
        values = dict[str, YamlNode]()
        for key, value in self.node.value:
            name = YamlNode(key, self.path).text()
            if name not in known:
                raise YamlNode(key, self.path).error(
                    f"unknown key {name[:80]!r}: {nearest(name[:80], known).removesuffix('.')}"
                )
            if name in values:
                raise YamlNode(key, self.path).error(f"key {name!r} is given twice")
            values[name] = YamlNode(value, self.path)
        return YamlMapping(self, values)

    def items(self) -> list[YamlNode]:
        """The items of a list. Raises SceneError for other values."""
        if self.node.id != "sequence":
            raise self.error(f"expected a list, got {self._shown}")
        return [YamlNode(each, self.path) for each in self.node.value]

    def text(self) -> str:
        """A text or number as text. Raises SceneError for other values."""
        if self.node.id != "scalar":
            raise self.error(f"expected a text or a number, got {self._shown}")
        return str(self.node.value)

    def number(self) -> float:
        """A finite number. Raises SceneError for other values."""
        plain = self.node.id == "scalar" and self.node.tag.endswith((":float", ":int", ":str"))
        try:
            value = float(self.node.value) if plain and not self.node.style else math.nan
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(f"expected a finite number, got {self._shown}")
        return value

    @property
    def _shown(self) -> str:
        if self.node.id == "scalar":
            return repr(str(self.node.value)[:80])
        return "a list" if self.node.id == "sequence" else "keys"


@dataclass(frozen=True, eq=False)
class YamlMapping:
    """The values of a mapping by key."""

    node: YamlNode
    values: dict[str, YamlNode]

    def get(self, key: str) -> YamlNode | None:
        """A value, or None where there is none or null."""
        found = self.values.get(key)
        return None if found is None or found.node.tag.endswith(":null") else found

    def need(self, key: str) -> YamlNode:
        """A value. Raises SceneError where there is none."""
        found = self.get(key)
        if found is None:
            raise self.node.error(f"`{key}` is missing here")
        return found


def read_yaml(path: Path) -> YamlNode:
    """The value of a file with one document; a line "---" after it, as `ros2 topic echo` prints, is
    left out.

    Raises SceneError for a file that cannot be read, is no YAML, or refers to itself (anchors).
    """
    yaml = _library(path)
    text = re.sub(r"\n---\s*\Z", "\n", _text(path))
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        _require_simple(yaml.parse(text, Loader=loader), path, yaml)
        node = yaml.compose(text, Loader=loader)
    except yaml.YAMLError as wrong:
        mark = getattr(wrong, "problem_mark", None)
        line = "" if mark is None else f", line {mark.line + 1}"
        what = getattr(wrong, "problem", None) or "it cannot be decoded"
        raise SceneError(f"{path}{line}: not valid YAML: {what}.") from None
    except (RecursionError, ValueError, OverflowError):
        raise SceneError(f"{path}: not valid YAML, or nested too deeply.") from None
    if node is None:
        raise SceneError(f"{path} is empty.")
    return YamlNode(node, path)


def _library(path: Path) -> Any:
    try:
        import yaml
    except ImportError:
        raise SceneError(
            f"{path} is YAML, which needs PyYAML: run pip install 'hovi[yaml]'."
        ) from None
    return yaml


def _text(path: Path) -> str:
    try:
        require_file(path, MAX_BYTES)
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"there is no file {path}.") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path} is not UTF-8 text.") from None
    except (OSError, ValueError) as refused:
        why = reason(refused) if isinstance(refused, OSError) else "no file can have that path"
        raise SceneError(f"{path} cannot be read: {why}.") from None


def _require_simple(events: Iterator[Any], path: Path, yaml: Any) -> None:
    """Raise SceneError for anchors, by which a small file can stand for a huge one."""
    depth = 0
    for count, event in enumerate(events):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if getattr(event, "anchor", None) is not None:
            line = event.start_mark.line + 1
            raise SceneError(f"{path}, line {line}: anchors (& and *) are not read; write it out.")
        if count > MAX_NODES or depth > MAX_DEPTH:
            raise SceneError(f"{path} has too many values, or is nested too deeply.")


def _inside(node: YamlNode) -> Iterator[YamlNode]:
    """A value and all values in it."""
    yield node
    if node.node.id == "scalar":
        return
    for each in node.node.value:
        for one in each if node.is_mapping else (each,):
            yield from _inside(YamlNode(one, node.path))
