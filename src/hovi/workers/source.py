"""Where a pool takes its items from, one at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Generic, TypeVar

from hovi.system.dataclass import dataclass

Item = TypeVar("Item")


@dataclass(frozen=True)
class Taken(Generic[Item]):
    """An item of a source, which may be None itself."""

    content: Item


class Source(ABC, Generic[Item]):
    """Gives items to a pool, which asks whenever one of its workers is idle."""

    @abstractmethod
    def take(self) -> Taken[Item] | None:
        """The next item; None if there is none now."""

    @property
    @abstractmethod
    def may_give_more(self) -> bool:
        """Whether there is an item now, or may be one after the loss of an item."""

    def again(self, number: int, content: Item) -> Item:
        """What is left to do of an item that is sent again, as it is unknown what became of it.

        number: of the item, in the order of `take`.
        """
        return content


class Listed(Source[Item]):
    """The items of a sequence."""

    def __init__(self, items: Sequence[Item]) -> None:
        self._items, self._next = items, 0

    def take(self) -> Taken[Item] | None:
        """The next one."""
        if not self.may_give_more:
            return None
        self._next += 1
        return Taken(self._items[self._next - 1])

    @property
    def may_give_more(self) -> bool:
        """Whether one is left."""
        return self._next < len(self._items)
