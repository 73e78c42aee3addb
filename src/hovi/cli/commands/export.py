"""`hovi export`: a motion in the file format of another program."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    positional: Annotated[
        Path | None, typer.Argument(metavar="OUT", help="Short for --out.")
    ] = None,
    format_: Annotated[
        str | None, typer.Option("--format", metavar="NAME", help="Format, such as csv.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT", help="Output file; default: FILE with the suffix of the format."
        ),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="Short for --format csv.")] = False,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 1000.0,
) -> None:
    """Export a motion: t, q, v, a and tau as comma-separated values (csv)."""
    from hovi.cli.arguments.files import check_output, load_trajectory
    from hovi.exchange.formats import export_format

    chosen = export_format(_format_name(format_, csv))
    target = check_output(
        _output(positional, out) or file.with_suffix(chosen.suffix), chosen.suffix
    )
    chosen.write(load_trajectory(file), target, rate)
    print(f"wrote {target}")


def _format_name(name: str | None, csv: bool) -> str:
    from hovi.errors import InputError

    if name is None and not csv:
        raise InputError("no export format was given; use --format NAME or --csv.")
    if csv and name not in (None, "csv"):
        raise InputError(f"two formats were given; use --csv or --format {name}.")
    return name or "csv"


def _output(positional: Path | None, out: Path | None) -> Path | None:
    from hovi.errors import InputError

    if positional is not None and out is not None:
        raise InputError(
            f"two output files were given; use {str(positional)!r} or --out {str(out)!r}."
        )
    return positional or out
