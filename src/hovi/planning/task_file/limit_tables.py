"""`limits`: "urdf", "soft", "none" or the table [limits], checked against the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from hovi.conditions.named import NAMED
from hovi.errors import InputError, nearest
from hovi.planning.problem.limits import KINDS, NAMES, Limits, as_limits, pairs_of
from hovi.planning.task_file.effect_tables import plain
from hovi.planning.task_file.messages import Keys, TomlText, first_sentence, in_toml, spelled
from hovi.planning.task_file.schema import LimitsTable
from hovi.robot.robot import Robot


def read_limits(
    given: Any, robot: Robot, toml: TomlText, keys: Keys = ("limits",)
) -> str | dict[str, Any]:
    """The value of `limits` in a file, as `hovi.plan` accepts it. keys: where it is."""
    if isinstance(given, str) and given in NAMES:
        _check(keys, given, robot, toml)
        return given
    if not isinstance(given, dict):
        expected = '"urdf", "soft", "none", the name of an arm or a table [limits]'
        hint = f": {nearest(given, NAMES)}" if isinstance(given, str) else ""
        sentence = f"`{spelled(keys)}` must be {expected}, but it is {in_toml(given)}{hint}"
        raise toml.error(keys, sentence)
    try:
        LimitsTable.model_validate(given)
    except ValidationError as invalid:
        raise first_sentence(invalid, LimitsTable, toml, above=keys) from None
    limits = {key: _by_joint(value, robot) for key, value in given.items()}
    for kind in (*KINDS, *NAMED):
        _check_kind(keys, kind, limits, robot, toml)
    _check(keys, limits, robot, toml)
    return limits


def limits_value(limits: str | Limits | Mapping[str, Any], robot: Robot) -> str | dict[str, Any]:
    """The inverse of `read_limits`: a name or a table."""
    if isinstance(limits, str):
        return limits
    if not isinstance(limits, Limits):
        return {str(key): plain(each) for key, each in limits.items()}
    table: dict[str, Any] = {"base": "none", "tolerance": limits.tolerance}
    for row, kind in enumerate(limits.kinds):
        bounded = np.flatnonzero(limits.bounded[row])
        pairs = {
            robot.coordinate_names[i]: [float(limits.lower[row, i]), float(limits.upper[row, i])]
            for i in bounded
        }
        table |= {kind: pairs} if pairs else {}
    for each in limits.conditions:
        table[each.name] = {joint: list(pair) for joint, pair in pairs_of(each).items()}
    return table


def _by_joint(value: Any, robot: Robot) -> Any:
    """A list with pairs, and perhaps numbers, as a table of joint names; others unchanged."""
    fits = isinstance(value, list) and len(value) == robot.nv
    if fits and any(isinstance(each, list) for each in value):
        return dict(zip(robot.coordinate_names, value, strict=True))
    return value


def _check_kind(
    keys: Keys, kind: str, limits: Mapping[str, Any], robot: Robot, toml: TomlText
) -> None:
    """Check a kind, joint by joint if joints are named, so that errors have their line."""
    given = limits.get(kind, {})
    if isinstance(given, dict):
        for joint, bound in given.items():
            _check((*keys, kind, joint), _alone(limits, kind, {joint: bound}), robot, toml)
    else:
        _check((*keys, kind), _alone(limits, kind, given), robot, toml)


def _alone(limits: Mapping[str, Any], kind: str, given: Any) -> dict[str, Any]:
    """A table with one kind of limits; fractions also need the base, and the ranges it may lack."""
    parts = list(given.values()) if isinstance(given, dict) else given
    parts = parts if isinstance(parts, list) else [parts]
    if kind in ("q", *NAMED) or not any(isinstance(each, str) for each in parts):
        return {"base": "none", kind: given}
    return {key: limits[key] for key in ("base", "q") if key in limits} | {kind: given}


def _check(keys: Keys, limits: str | Mapping[str, Any], robot: Robot, toml: TomlText) -> None:
    try:
        as_limits(robot, limits)
    except InputError as wrong:
        raise toml.error(keys, str(wrong)) from None
