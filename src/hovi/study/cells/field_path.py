"""Dotted paths of the fields of a scene file: goal.q, effects.payload.mass, obstacles[0].radius."""

from __future__ import annotations

import re
from typing import Any

from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

MAX_LENGTH = 500
"""Maximum number of characters of a path."""
_PART = re.compile(r"""(?:^|\.)(?:"([^"]+)"|([^."\[\]\s]+))|\[(\d{1,6})\]""")


@dataclass(frozen=True)
class FieldPath:
    """A field of a scene file.

    text: as it was given. keys: names of tables' entries, and numbers of lists' ones.
    """

    text: str
    keys: tuple[str | int, ...]

    @classmethod
    def of(cls, text: str) -> FieldPath:
        """The path with this notation; names with dots are in quotes. Raises SceneError."""
        keys: list[str | int] = []
        end = 0
        while end < len(text) <= MAX_LENGTH and text[0] != ".":
            part = _PART.match(text, end)
            if part is None or (part[3] and not keys):
                break
            keys.append(int(part[3]) if part[3] else part[1] or part[2])
            end = part.end()
        if not keys or end != len(text):
            raise SceneError(
                f"{text!r} is no field of a scene file: write its keys with dots between them, and "
                "numbers of lists' entries in brackets, such as goal.q, goal.q[2] or "
                "effects.payload.mass."
            )
        return cls(text, tuple(keys))

    def put(self, table: dict[str, Any], value: Any) -> None:
        """Set the field in a table, in place; tables on the way that are missing are created.

        Raises SceneError where something else is on the way, or a list that is too short.
        """
        at: Any = table
        for number, key in enumerate(self.keys):
            last = number == len(self.keys) - 1
            self._check(at, key, number)
            if last:
                at[key] = value
            elif isinstance(key, str):
                at = at.setdefault(key, {})
            else:
                at = at[key]

    def _check(self, at: Any, key: str | int, number: int) -> None:
        """Raise SceneError unless `at` is a table or a list that has a place for a key."""
        above = spelled(self.keys[:number]).removeprefix(".")
        if isinstance(key, str):
            if not isinstance(at, dict):
                raise SceneError(
                    f"the study's field {self.text!r} needs a table under {above!r}, where the "
                    f"scene has {_shown(at)}: write that as a table."
                )
        elif not isinstance(at, list) or key >= len(at):
            raise SceneError(
                f"the study's field {self.text!r} needs a list of at least {key + 1} under "
                f"{above!r}, where the scene has {_shown(at)}: give it all entries."
            )


def spelled(keys: tuple[str | int, ...]) -> str:
    """Keys as they follow those before them in a path."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)


def _shown(value: Any) -> str:
    if value == {}:
        return "nothing"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
