"""Shared by side_by_side.py: the problems on which two checkouts are compared, class by class."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import compared_arms
import compared_scenes
from compared_cases import Case, Family, Group

FAMILIES: dict[str, Family] = compared_arms.FAMILIES | compared_scenes.FAMILIES


def groups_of(kinds: Sequence[str], quick: bool) -> list[Group]:
    """The groups of some classes."""
    return [group for kind in kinds for group in FAMILIES[kind].groups(quick)]


def cases_of(group: Group, seed: int) -> Iterator[Case]:
    """The cases of a group, of which each is set up when it is asked for."""
    return FAMILIES[group.kind].cases(group, seed)
