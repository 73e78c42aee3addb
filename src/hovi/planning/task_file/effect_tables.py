"""The tables [effects.NAME], whose keys are the fields of the effect's dataclass."""

from __future__ import annotations

import dataclasses
import functools
import operator
import types
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from pydantic import (
    AllowInfNan,
    BaseModel,
    Discriminator,
    Field,
    Strict,
    Tag,
    ValidationError,
    create_model,
)

from hovi.effects.effect import Effect
from hovi.effects.registration import REGISTRY
from hovi.errors import SceneError, nearest
from hovi.planning.task_file.messages import Keys, TomlText, first_sentence
from hovi.planning.task_file.schema import Table
from hovi.robot.robot import Robot

_MAX_NUMBER = 1e12
"""Largest absolute value of a number, in SI units; the squares of larger ones may overflow."""
_NUMBERS = {
    float: "finite number",
    int: "whole number",
    str: "string",
    bool: "true or false",
}


def read_effects(
    tables: Mapping[str, Mapping[str, Any]], robot: Robot, toml: TomlText, above: Keys = ()
) -> list[Effect]:
    """The effects of a file, in its order, checked against the robot.

    above: the keys of the table in which they are.
    """
    keys = (*above, "effects")
    return [_read_effect((*keys, name), table, robot, toml) for name, table in tables.items()]


def effect_table(effect: Effect) -> dict[str, Any]:
    """The table from which `read_effects` reads this effect."""
    values = {field.name: plain(getattr(effect, field.name)) for field in fields(effect)}
    return {key: value for key, value in values.items() if value is not None}


def _read_effect(keys: Keys, table: Mapping[str, Any], robot: Robot, toml: TomlText) -> Effect:
    name = str(keys[-1])
    if name not in REGISTRY:
        raise toml.error(keys, f"there is no effect {name!r}; {nearest(name, REGISTRY)}")
    schema = effect_schema(REGISTRY[name])
    try:
        checked = schema.model_validate(dict(table))
    except ValidationError as invalid:
        raise first_sentence(invalid, schema, toml, above=keys) from None
    given = {key: getattr(checked, key) for key in table}
    try:
        effect = REGISTRY[name](**given)
        effect.check(robot)
    except SceneError as refused:
        raise toml.error(keys, str(refused)) from None
    return effect


@functools.cache
def effect_schema(effect: type[Effect]) -> type[BaseModel]:
    """The schema of an effect's table: its fields, with their types and descriptions."""
    hints = get_type_hints(effect)
    keys: dict[str, Any] = {}
    for field in fields(effect):
        needed = field.default is MISSING and field.default_factory is MISSING
        description = _in_words(hints[field.name])
        keys[field.name] = (
            _strict(hints[field.name]),
            Field(... if needed else _default(field), description=description),
        )
    return create_model(effect.__name__, __base__=Table, **keys)


def _default(field: dataclasses.Field[Any]) -> Any:
    """The default value of a field."""
    return field.default if field.default_factory is MISSING else field.default_factory()


def _strict(hint: Any) -> Any:
    """The hint with strict, finite scalars; a TOML list may still become a tuple."""
    if hint is float:
        return Annotated[
            float, Strict(), AllowInfNan(False), Field(ge=-_MAX_NUMBER, le=_MAX_NUMBER)
        ]
    if hint in (int, str, bool):
        return Annotated[hint, Strict()]
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        return _strict_union(hint)
    inner = tuple(_strict(each) if each is not Ellipsis else each for each in get_args(hint))
    if isinstance(origin, type):
        return Annotated[origin[inner], Strict(False)]  # type: ignore[index]  # any generic class
    return hint


def _strict_union(hint: Any) -> Any:
    """A union whose member is chosen by the type of the value, so that there is one error."""
    members = [each for each in get_args(hint) if each is not type(None)]
    if len(members) == 1:
        return _strict(members[0])
    tagged = (Annotated[_strict(each), Tag(_tag_of(each))] for each in members)
    union = functools.reduce(operator.or_, tagged)
    return Annotated[
        union, Discriminator(_tag, custom_error_type="kind", custom_error_message=_in_words(hint))
    ]


def _tag_of(hint: Any) -> str:
    origin = get_origin(hint) or hint
    if origin in (float, int):
        return "<number>"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return "<table>"
    return "<list>" if origin in (list, tuple) else f"<{origin.__name__}>"


def _tag(value: Any) -> str:
    """The tag of a TOML value."""
    for kind, tag in ((bool, "<bool>"), (dict, "<table>"), ((list, tuple), "<list>")):
        if isinstance(value, kind):
            return tag
    return "<number>" if isinstance(value, (int, float)) else f"<{type(value).__name__}>"


def _in_words(hint: Any) -> str:
    if hint in _NUMBERS:
        return _NUMBERS[hint] if hint is bool else f"a {_NUMBERS[hint]}"
    inner = get_args(hint)
    origin = get_origin(hint)
    if origin is tuple and Ellipsis not in inner:
        if inner[0] in _NUMBERS:
            return f"a list of {len(inner)} {_NUMBERS[inner[0]]}s"
        return f"a list of {len(inner)}, each {_in_words(inner[0])}"
    if origin in (list, tuple):
        return f"a list, each {_in_words(inner[0])}"
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return f"a table of names, each with {_in_words(inner[1])}"
    if origin in (Union, types.UnionType):
        return " or ".join(_in_words(each) for each in inner if each is not type(None))
    return "a value of the right type"


def plain(value: Any) -> Any:
    """The value in types that TOML has."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(each) for each in value] if isinstance(value, (list, tuple)) else value
