"""Tables on the terminal, all in one style; rich is imported when there is one to print."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def terminal_table(title: str | None = None) -> Table:
    """An empty table."""
    from rich.box import SIMPLE
    from rich.table import Table

    return Table(box=SIMPLE, pad_edge=False, padding=(0, 1, 0, 0), title=title)


def print_table(table: Table, width: int | None = None) -> None:
    """Print a table.

    width: in columns where stdout is not a terminal; None for rich's default.
    """
    from rich.console import Console

    shown = None if sys.stdout.isatty() else width
    Console(highlight=False, markup=False, width=shown).print(table)
