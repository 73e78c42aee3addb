"""`hovi export`: a motion in the file format of another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hovi.cli.arguments.robots import PackageDirs

if TYPE_CHECKING:
    from hovi.exchange.formats import ExportFormat


def export(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    positional: Annotated[
        Path | None, typer.Argument(metavar="OUT", help="Short for --out.")
    ] = None,
    format_: Annotated[
        str | None,
        typer.Option("--format", metavar="NAME", help="Such as csv; default: by the name of OUT."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT", help="Output file; default: FILE with the suffix of the format."
        ),
    ] = None,
    csv: Annotated[bool, typer.Option("--csv", help="Short for --format csv.")] = False,
    rate: Annotated[
        float | None, typer.Option(help="Samples per second; default: that of the format.")
    ] = None,
    size: Annotated[
        str | None, typer.Option(metavar="WIDTHxHEIGHT", help="Pixels of a film, up to 1920x1080.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="VIEW|X,Y,Z[:X,Y,Z]",
            help="Of a film: front, side, top, iso, or its position and what it looks at, in m.",
        ),
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Of a film; 1 is real time.")] = None,
    package_dir: PackageDirs = None,
) -> None:
    """Export a motion for other programs.

    Formats: csv, numpy, parquet, joint-trajectory, mcap, mujoco, rerun, video, gif.
    """
    from hovi.cli.arguments.files import check_output, load_shown
    from hovi.exchange.formats import film_options

    given = _output(positional, out)
    chosen = _format(format_, csv, given)
    target = check_output(given or _beside(file, chosen.suffix), *chosen.suffixes)
    _require_other_file(target, file)
    film = film_options(chosen, size, camera, speed)
    chosen.write(load_shown(file, package_dir), target, rate, **film)
    print(f"wrote {target}")


def _format(name: str | None, csv: bool, out: Path | None) -> ExportFormat:
    """The format with a name, or that of the output file."""
    from hovi.errors import InputError
    from hovi.exchange.formats import FORMATS, export_format, format_of_file

    if csv and name not in (None, "csv"):
        raise InputError(f"two formats were given; use --csv or --format {name}.")
    if name is not None or csv:
        return export_format(name or "csv")
    if out is not None:
        return format_of_file(out)
    names = ", ".join(each.name for each in FORMATS)
    raise InputError(f"no export format was given; use --format with one of {names}.")


def _beside(file: Path, suffix: str) -> Path:
    """The file with another extension, and another name where it has that one itself."""
    from hovi.cli.arguments.files import next_to

    other = next_to(file, suffix)
    return file.with_name(f"{file.stem}_samples{suffix}") if other == file else other


def _require_other_file(target: Path, file: Path) -> None:
    from hovi.errors import InputError

    if target.exists() and file.exists() and target.samefile(file):
        raise InputError(f"{str(target)!r} is the motion itself; choose another output file.")


def _output(positional: Path | None, out: Path | None) -> Path | None:
    from hovi.errors import InputError

    if positional is not None and out is not None:
        raise InputError(
            f"two output files were given; use {str(positional)!r} or --out {str(out)!r}."
        )
    return positional or out
