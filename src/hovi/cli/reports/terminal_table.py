"""Tables on the terminal, all in one style.

They are not those of rich, whose import takes longer than a small plan.
"""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Sequence
from itertools import zip_longest

NARROWEST = 8
"""Least width of a column of text that is folded, in characters."""
GAP = "  "


def print_table(
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    title: str = "",
    texts: Sequence[int] = (0,),
) -> None:
    """Print a table, with an empty line before and after it.

    columns: their names. rows: as many cells each. texts: numbers of the columns of text, which
        begin at the left and are folded where a terminal is too narrow; numbers end at the right.
    """
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    text = table_text(columns, rows, texts, width)
    if not _can_print("─"):
        text = text.replace("─", "-")
    print("\n".join(["", *([f" {title}"] if title else []), text, ""]))


def table_text(
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    texts: Sequence[int] = (0,),
    width: int | None = None,
) -> str:
    """The lines of a table. width: of the terminal, in characters; None for any."""
    widths = [max(map(len, cells)) for cells in zip(columns, *rows, strict=True)]
    spare = sum(max(0, widths[i] - NARROWEST) for i in texts)
    excess = 0 if width is None else 1 + sum(widths) + len(GAP) * (len(widths) - 1) - width
    for _ in range(excess if excess <= spare else 0):  # no fold where it would not suffice
        widths[max(texts, key=widths.__getitem__)] -= 1
    lines = [line for cells in (columns, *rows) for line in _folded(cells, widths, texts)]
    rule = "─" * (sum(widths) + len(GAP) * (len(widths) - 1))
    return "\n".join(f" {line}" for line in [lines[0], rule, *lines[1:]])


def _folded(cells: Sequence[str], widths: Sequence[int], texts: Sequence[int]) -> list[str]:
    """The lines of one row: more than one where a text is folded."""
    parts = [
        (textwrap.wrap(cell, max(widths[i], 1)) or [""]) if i in texts else [cell]
        for i, cell in enumerate(cells)
    ]
    return [
        GAP.join(
            part.ljust(widths[i]) if i in texts else part.rjust(widths[i])
            for i, part in enumerate(line)
        ).rstrip()
        for line in zip_longest(*parts, fillvalue="")
    ]


def _can_print(character: str) -> bool:
    try:
        character.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
