"""Error messages for TOML files: one sentence with file, line and key, from pydantic's errors."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from hovi.errors import SceneError, nearest
from hovi.planning.problem.notation.other_planners import TOML, instead_of
from hovi.system.dataclass import dataclass

Keys = tuple[str | int, ...]

MOST_SHOWN = 60
"""Number of characters of a value that a message shows."""
_HEADER = re.compile(r"(\[\[?)([^\]]+)\]\]?\s*(#.*)?$")
_ELEMENTS = {
    "finite_number": "a finite number",
    "float_type": "a finite number",
    "string_type": "a string",
    "string_pattern_mismatch": 'a length of time such as "2 s"',
    "list_type": "a list",
    "dict_type": "a table",
    "too_long": "a shorter list",
    "missing": "given as well",
    "tuple_type": "a list",
    "float_parsing": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
}
_ENTRY = re.compile(r"([A-Za-z0-9_.\"'\- ]+)=")


@dataclass(frozen=True)
class TomlText:
    """The text of a TOML file, and its path."""

    path: Path
    text: str

    def line(self, keys: Keys) -> int | None:
        """The line, from 1, of the longest leading part of `keys` that occurs in the text."""
        wanted = tuple(keys)
        best, where = 0, None
        table: Keys = ()
        tables: Counter[Keys] = Counter()
        for number, padded in enumerate(self.text.splitlines(), start=1):
            line, here = padded.strip(), table
            if header := _HEADER.match(line):
                name: Keys = _split(header[2])
                if header[1] == "[":
                    here = table = _numbered(name, tables)
                else:
                    here = table = (*name, tables[name])
                    tables[name] += 1
            elif entry := _ENTRY.match(line):
                here = table + _split(entry[1])
            else:
                continue
            if len(here) > best and (wanted[: len(here)] == here or here == (*wanted, 0)):
                best, where = len(here), number
        return where

    def error(self, keys: Keys, sentence: str) -> SceneError:
        """A SceneError with file, line and the sentence."""
        line = self.line(keys)
        place = f"{self.path}, line {line}" if line else str(self.path)
        end = "" if sentence.endswith((".", "?")) else "."
        return SceneError(f"{place}: {sentence}{end}")


def first_sentence(
    invalid: ValidationError, model: type[BaseModel], toml: TomlText, above: Keys = ()
) -> SceneError:
    """The most informative of pydantic's errors, as one sentence.

    Unknown keys come first, since a misspelt key is also reported as missing.
    above: the keys of the validated table.
    """
    details = sorted(invalid.errors(), key=lambda error: error["type"] != "extra_forbidden")[0]
    keys = tuple(key for key in details["loc"] if not str(key).startswith(("<", "dict[", "list[")))
    key = spelled(above + keys)
    kind = details["type"]
    if kind == "extra_forbidden":
        advice = "" if above + keys[:-1] else instead_of(keys[-1], TOML)
        if advice:
            return toml.error(keys, f"there is no key `{key}`: {advice}")
        valid = _fields_of(_model_at(model, keys[:-1]))
        return toml.error(above + keys, f"unknown key `{key}`; {nearest(str(keys[-1]), valid)}")
    expected = _expected(model, keys, details)
    if kind == "missing":
        return toml.error(above + keys[:-1], f"`{key}` is missing; it must be {expected}")
    came = in_toml(details["input"])
    return toml.error(above + keys, f"`{key}` must be {expected}, but it is {came}")


def spelled(keys: Iterable[str | int]) -> str:
    """Keys in dotted notation: start.q[1]."""
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def in_toml(value: Any) -> str:
    """A value in TOML syntax, truncated to MOST_SHOWN characters."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = f'"{value}"' if isinstance(value, str) else f"{value}"
    except ValueError:  # Python converts at most 4,300 digits
        return "a number of too many digits"
    return text if len(text) <= MOST_SHOWN else text[:57] + "..."


def _expected(model: type[BaseModel], keys: Keys, details: ErrorDetails) -> str:
    context = details.get("ctx", {})
    bound = context.get("le", context.get("ge"))
    if isinstance(bound, float) and bound != 0:  # on any number of an effect
        return f"at most {abs(bound):g} in size"
    owner = _model_at(model, keys[:-1])
    field = owner.model_fields.get(str(keys[-1])) if owner else None
    if field and field.description:
        return field.description
    return _ELEMENTS.get(details["type"], details["msg"].lower().removeprefix("input should be "))


def _model_at(model: type[BaseModel], keys: Keys) -> type[BaseModel] | None:
    for key in keys:
        if isinstance(key, int):
            continue  # into a list of tables, whose class is known
        field = model.model_fields.get(key)
        annotation = field.annotation if field else None
        tables = [kind for kind in _kinds(annotation) if issubclass(kind, BaseModel)]
        if not tables:
            return None
        model = tables[0]
    return model


def _kinds(annotation: Any) -> Iterator[type]:
    """The types that an annotation names, itself or in unions and lists."""
    if isinstance(annotation, type):
        yield annotation
    for each in get_args(annotation):
        yield from _kinds(each)


def _fields_of(model: type[BaseModel] | None) -> list[str]:
    return list(model.model_fields) if model else []


def _numbered(name: Keys, tables: Counter[Keys]) -> Keys:
    """The keys of a table, with the number of the table of an array in which it is, if any.

    tables: how many tables every array has so far.
    """
    for i in range(1, len(name)):
        if tables[name[:i]]:
            return (*name[:i], tables[name[:i]] - 1, *name[i:])
    return name


def _split(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))
