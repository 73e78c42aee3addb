"""What terminals and notebooks show of an object: a title and a few rows."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod

from hovi.system.dataclass import dataclass

LONGEST = 120
"""Length to which texts are cut, in characters."""


@dataclass(frozen=True)
class Summary:
    """A title and rows of a name and a value, as text and as HTML."""

    title: str
    rows: tuple[tuple[str, str], ...] = ()

    @property
    def text(self) -> str:
        """One line for the title and one for each row."""
        width = max((len(name) for name, _ in self.rows), default=0)
        rows = [f"  {name:{width}}  {_cut(value)}" for name, value in self.rows]
        return "\n".join([_cut(self.title), *rows])

    @property
    def html(self) -> str:
        """A table with the title as its caption."""
        rows = "".join(
            f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
            f"<td style='text-align:left'>{html.escape(_cut(value))}</td></tr>"
            for name, value in self.rows
        )
        title = html.escape(_cut(self.title))
        caption = f"<caption style='text-align:left;font-weight:bold'>{title}</caption>"
        return f"<table>{caption}{rows}</table>"


class Summarized(ABC):
    """What is shown by its summary, in fewer than ten lines, however long its arrays are."""

    @abstractmethod
    def _summary(self) -> Summary:
        """The summary; nothing that takes long is computed for it."""

    def __repr__(self) -> str:
        return self._summary().text

    def _repr_html_(self) -> str:
        """What notebooks show."""
        return self._summary().html


def _cut(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"
