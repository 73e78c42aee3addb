"""`hovi export`: a motion as a file of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    place: Annotated[Path | None, typer.Argument(metavar="OUT", help="The same as --out.")] = None,
    format_: Annotated[
        str | None, typer.Option("--format", metavar="NAME", help="Of the file, such as csv.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="OUT", help="FILE with the format's ending when not given."),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="The same as --format csv.")] = False,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 1000.0,
) -> None:
    """Write a motion for other programs: t, q, v, a and tau as comma-separated values (csv)."""
    from hovi.cli.commands.files import check_output, load_trajectory
    from hovi.exchange.formats import export_format

    chosen = export_format(_format_name(format_, csv))
    target = check_output(_place(place, out) or file.with_suffix(chosen.suffix), chosen.suffix)
    chosen.write(load_trajectory(file), target, rate)
    print(f"wrote {target}")


def _format_name(name: str | None, csv: bool) -> str:
    from hovi.errors import InputError

    if name is None and not csv:
        raise InputError("say which format to export: --format NAME, or --csv.")
    if csv and name not in (None, "csv"):
        raise InputError(f"one format at a time: --csv or --format {name}.")
    return name or "csv"


def _place(place: Path | None, out: Path | None) -> Path | None:
    from hovi.errors import InputError

    if place is not None and out is not None:
        raise InputError(f"one file at a time: {str(place)!r} or --out {str(out)!r}.")
    return place or out
