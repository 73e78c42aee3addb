"""The tables [[keep]]: what a motion keeps all along."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hovi.conditions.kept.keep import Keep
from hovi.conditions.kept.kinds import KINDS, as_kept, kept_of_table
from hovi.errors import HoviError, SceneError
from hovi.planning.task_file.messages import Keys, TomlText
from hovi.robot.robot import Robot


def read_kept(
    tables: Sequence[Mapping[str, Any]], robot: Robot, toml: TomlText, above: Keys = ()
) -> tuple[Keep, ...]:
    """What is kept, in the order of a file, checked against the robot.

    above: the keys of the table in which the tables are.
    """
    found = list[Keep]()
    for i, table in enumerate(tables):
        try:
            found.append(kept_of_table(table, f"keep[{i}]"))
            found[-1].check(robot)
        except HoviError as wrong:
            raise toml.error((*above, "keep", i), str(wrong)) from None
    try:
        return as_kept(found)
    except HoviError as wrong:  # two of one name
        raise toml.error((*above, "keep"), str(wrong)) from None


def keep_table(given: Keep | Mapping[str, Any]) -> dict[str, Any]:
    """The table from which `read_kept` reads this. Raises SceneError for a function."""
    (kept,) = as_kept(given)
    if kept.kind not in KINDS:
        raise SceneError(
            f"scene files cannot store {kept.subject}, which has a function: pass it to "
            "hovi.plan_task, and save the task without it."
        )
    return kept.to_dict()
