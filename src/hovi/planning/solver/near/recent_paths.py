"""What is known of the paths that were looked at last."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from hovi.discrete.grid import DiscretePath
from hovi.system.dataclass import dataclass

T = TypeVar("T")

KEPT = 3
"""Number of paths: that of the last trial, the current one, and the best so far."""


@dataclass(frozen=True, eq=False)
class RecentPaths(Generic[T]):
    """Something known of each of a few paths, the last one first.

    It is never changed: each method that adds or changes something returns another one.
    """

    entries: tuple[tuple[DiscretePath, T], ...] = ()

    def known(self, path: DiscretePath) -> T | None:
        """What is known of a path; None if it is none of these."""
        return next((known for each, known in self.entries if each is path), None)

    def with_entry(self, path: DiscretePath, known: T) -> RecentPaths[T]:
        """The same with something known of a path, instead of what was known of it."""
        others = tuple(entry for entry in self.entries if entry[0] is not path)
        return RecentPaths(((path, known), *others[: KEPT - 1]))

    def mapped(self, change: Callable[[T], T]) -> RecentPaths[T]:
        """The same with everything that is known changed."""
        return RecentPaths(tuple((path, change(known)) for path, known in self.entries))
