"""Values cached for the last few paths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from hovi.discrete.grid import DiscretePath
from hovi.system.dataclass import dataclass

T = TypeVar("T")

MOST_PATHS = 3
"""Number of paths: the current one, a trial and the best so far are measured in turn."""


@dataclass(frozen=True, eq=False)
class RecentPaths(Generic[T]):
    """A cache of values by the identity of their paths, that measured last first.

    Methods that add or change something return another cache, so that copies stay independent.
    """

    entries: tuple[tuple[DiscretePath, T], ...] = ()

    def get(self, path: DiscretePath) -> T | None:
        """The value of a path; None if it is not cached."""
        return next((value for each, value in self.entries if each is path), None)

    def with_entry(self, path: DiscretePath, value: T) -> RecentPaths[T]:
        """The same with a value for a path, which replaces the one before."""
        others = tuple(entry for entry in self.entries if entry[0] is not path)
        return RecentPaths(((path, value), *others[: MOST_PATHS - 1]))

    def mapped(self, change: Callable[[T], T]) -> RecentPaths[T]:
        """The same with every value changed."""
        return RecentPaths(tuple((path, change(value)) for path, value in self.entries))
