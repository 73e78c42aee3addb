"""`hovi export`: a motion, or several as one, in the file format of another program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hovi.cli.arguments.robots import PackageDirs

if TYPE_CHECKING:
    from hovi.exchange.formats import ExportFormat


def export(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE.npz",
            help="A motion, or several as one; without --out, the last of two or more is OUT.",
        ),
    ],
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
    then: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE.npz", help="A motion that follows; may be repeated."),
    ] = None,
    gap: Annotated[
        float, typer.Option(help="Seconds for which the robot rests between motions.")
    ] = 0.0,
    lookahead_time: Annotated[
        float | None, typer.Option(help="Of servoj in a urscript, 0.03 to 0.2 s; default 0.1.")
    ] = None,
    gain: Annotated[
        float | None, typer.Option(help="Of servoj in a urscript, 100 to 2000; default 300.")
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
    """Export a motion for other programs, or several as one.

    Formats: csv, numpy, parquet, joint-trajectory, robot-trajectory, urscript, franka, mcap,
    mujoco, rerun, video, gif.
    """
    from hovi.cli.arguments.files import check_output, load_shown
    from hovi.exchange.formats import export as write

    first, given = _motions_and_output(paths, out)
    files = [*first, *(then or [])]
    chosen = _format(format_, csv, given)
    target = check_output(given or _beside(files[0], chosen), *chosen.suffixes)
    _require_no_motion(target)
    motions = [load_shown(each, package_dir) for each in files]
    options: dict[str, Any] = {"lookahead_time": lookahead_time, "gain": gain}
    options |= {"size": size, "camera": camera, "speed": speed}
    write(motions, target, chosen.name, rate, gap=gap, **options)
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


def _beside(file: Path, chosen: ExportFormat) -> Path:
    """The file with another extension, and another name where that says another format."""
    from hovi.cli.arguments.files import next_to

    other = next_to(file, chosen.suffix)
    if not chosen.has_suffix:
        return file.with_name(f"{file.stem}_{chosen.name.replace('-', '_')}{chosen.suffix}")
    return file.with_name(f"{file.stem}_samples{chosen.suffix}") if other == file else other


def _require_no_motion(target: Path) -> None:
    """Raise InputError where a motion would be overwritten, such as the last of several."""
    from hovi.cli.arguments.files import load_trajectory
    from hovi.errors import HoviError, InputError

    try:
        load_trajectory(target)
    except HoviError:
        return
    raise InputError(
        f"{str(target)!r} is a motion itself; choose another output file, with --out to export "
        "several motions as one."
    )


def _motions_and_output(paths: Sequence[Path], out: Path | None) -> tuple[list[Path], Path | None]:
    """The motions and the output file: --out, or the last of several paths; None without one."""
    from hovi.errors import InputError

    if out is None:
        return ([*paths[:-1]], paths[-1]) if len(paths) > 1 else ([*paths], None)
    if len(paths) > 1 and paths[-1].suffix != ".npz":
        raise InputError(
            f"two output files were given; use {str(paths[-1])!r} or --out {str(out)!r}."
        )
    return [*paths], out
