"""The limit set of a plan: which of its limits hold, and who publishes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from hovi.conditions.joint_quantity import QUANTITIES
from hovi.planning.problem.arms.limit_set import LimitSet, is_limit_set, limit_set
from hovi.planning.task_file.task import Task


def limit_set_of(task: Task) -> LimitSet | None:
    """The limit set that a task names, perhaps as the base of others; None without one."""
    limits = task.options.limits
    name = limits.get("base", "urdf") if isinstance(limits, Mapping) else limits
    return limit_set(name) if isinstance(name, str) and is_limit_set(name) else None


def limit_set_json(arm: LimitSet | None, order: int) -> dict[str, Any] | None:
    """Its name, the kinds that are not published or do not apply, and the sources."""
    if arm is None:
        return None
    return {
        "name": arm.name,
        "not_applied": list(arm.beyond(order)),
        "unpublished": list(arm.unpublished),
        "sources": [source.url for source in arm.sources],
    }


def limit_set_text(arm: LimitSet, order: int) -> str:
    """One line; order: of the Lagrangian that was minimized."""
    parts = [f"of a {arm.title}"]
    beyond = arm.beyond(order)
    if beyond:
        parts.append(f"without those on {_words(beyond)}, for which a motion needs order 3")
    if arm.unpublished:
        parts.append(f"no limits on {_words(arm.unpublished)} are published")
    return f"{arm.name}, {'; '.join(parts)}"


def source_lines(arm: LimitSet) -> list[str]:
    """One line per source, with the kinds that it confirms."""
    return [
        f"  {', '.join(source.kinds)}: {source.title}, {source.version}, {source.url}"
        for source in arm.sources
    ]


def _words(kinds: Iterable[str]) -> str:
    words = [QUANTITIES[kind] for kind in kinds]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
