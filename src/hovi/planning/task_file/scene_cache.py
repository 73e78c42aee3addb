"""Robots, scenes and options of scene files that differ in a few keys, each built once."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

Built = TypeVar("Built")

MOST = 16
"""How many of each kind are kept; those that were not used for the longest time are dropped."""
ROBOT_KEYS = ("robot", "locked", "package_dirs", "srdf", "free_flyer", "mimic", "tools")
"""The keys of a scene file that say which robot it is."""
SCENE_KEYS = (*ROBOT_KEYS, "passive", "begin", "effects")
"""The keys that say which scene it is."""
MOTION_KEYS = ("start", "goal", "duration")
"""The keys that say nothing about the scene and the options."""


class SceneCache:
    """What was built from the tables of scene files in one folder, to be used again.

    A robot is loaded in 10 to 800 ms, and a scene has functions that are made at its first use.
    """

    def __init__(self) -> None:
        self._kept: dict[str, OrderedDict[str, Any]] = {}

    def get(self, kind: str, table: Mapping[str, Any], build: Callable[[], Built]) -> Built:
        """What was built from an equal table, or else what `build` returns.

        kind: of what is built. table: JSON-compatible; what else there is, is built anew.
        """
        kept = self._kept.setdefault(kind, OrderedDict())
        try:
            key = json.dumps(table, sort_keys=True)
        except (TypeError, ValueError):  # a date, which will be refused
            return build()
        if key in kept:
            kept.move_to_end(key)
        else:
            kept[key] = build()
        while len(kept) > MOST:
            kept.popitem(last=False)
        found: Built = kept[key]
        return found


def chosen(table: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """The entries of a table under some keys."""
    return {key: table[key] for key in keys if key in table}


def others(table: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """The entries of a table but those under some keys."""
    return {key: value for key, value in table.items() if key not in keys}
