"""`hovi export`: a motion as a table of numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    out: Annotated[
        Path | None, typer.Argument(metavar="[OUT.csv]", help="FILE.csv when not given.")
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="Comma-separated values.")] = False,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 1000.0,
) -> None:
    """Write t, q, v, a and tau of a motion as CSV."""
    from hovi.cli.commands.files import check_output, load_trajectory
    from hovi.errors import InputError
    from hovi.viewing.csv_table import write_csv

    if not csv:
        raise InputError("say which format to export: --csv.")
    target = check_output(out or file.with_suffix(".csv"), ".csv")
    write_csv(load_trajectory(file), target, rate)
    print(f"wrote {target}")
