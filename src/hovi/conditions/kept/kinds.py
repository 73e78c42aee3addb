"""The kinds of what a motion keeps, and one from its table in a scene file."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

from hovi.checks.tables import entries_of
from hovi.conditions.kept.follow import Follow
from hovi.conditions.kept.keep import Keep
from hovi.conditions.kept.keep_orientation import KeepOrientation
from hovi.conditions.kept.keep_pose import KeepPose
from hovi.conditions.kept.on_line import OnLine
from hovi.conditions.kept.on_plane import OnPlane
from hovi.conditions.kept.row import Formula
from hovi.conditions.kept.together import Together
from hovi.conditions.kept.tool_speed import ToolAcceleration, ToolSpeed
from hovi.conditions.kept.upright import Upright
from hovi.errors import HoviError, InputError, nearest

_PLACES = Upright, OnLine, OnPlane, KeepOrientation, KeepPose, Together, Follow
_OTHERS = ToolSpeed, ToolAcceleration, Formula
KINDS: dict[str, type[Keep]] = {each.kind: each for each in (*_PLACES, *_OTHERS)}
"""The classes that scene files name, by kind."""


def as_kept(given: Any) -> tuple[Keep, ...]:
    """What is kept, from one or several, or their tables. Raises InputError for anything else."""
    several = (given,) if isinstance(given, Keep | Mapping) else given
    if not isinstance(several, Sequence) or isinstance(several, str):
        several = (None,)
    if not all(isinstance(each, Keep | Mapping) for each in several):
        raise InputError(
            'keep must be a list such as [hovi.conditions.Upright("tool0")], or of tables with a '
            f"kind, got {given!r:.200}."
        )
    found = tuple(_one(each, f"keep[{i}]") for i, each in enumerate(several))
    titles = [each.title for each in found]
    for title in titles:
        if titles.count(title) > 1:
            raise InputError(f"keep has {title!r} twice; give each its own `name`.")
    return found


def recorded(metadata: Mapping[str, Any]) -> tuple[Keep, ...]:
    """What a motion's metadata say that it keeps, without what is invalid: files may say it."""
    given, found = metadata.get("keep"), list[Keep]()
    for number, table in enumerate(given if isinstance(given, list) else ()):
        if isinstance(table, Mapping):
            with contextlib.suppress(HoviError):
                found.append(kept_of_table(table, f"keep[{number}]"))
    return tuple(found)


def _one(given: Keep | Mapping[str, Any], name: str) -> Keep:
    return given if isinstance(given, Keep) else kept_of_table(given, name)


def kept_of_table(table: Mapping[str, Any], name: str) -> Keep:
    """What a table with a `kind` stands for. name: of the table in messages. Raises InputError."""
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        hint = f"there is no {kind!r}; {nearest(str(kind), KINDS)}"
        raise InputError(f"`{name}.kind` must be one of {', '.join(KINDS)}: {hint}")
    known = fields(KINDS[kind])
    needed = {x.name: "given" for x in known if x.default is MISSING}
    keys = ["kind", *(each.name for each in known)]
    values = entries_of(table, name, keys, needed)
    del values["kind"]
    return KINDS[kind](**values)
