"""`hovi report`: a motion as one file for a colleague."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hovi.cli.arguments.robots import PackageDirs


def report(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    html: Annotated[
        Path | None,
        typer.Option(metavar="OUT.html", help="Output file; default: FILE with .html."),
    ] = None,
    package_dir: PackageDirs = None,
) -> None:
    """Write replay, curves, certificate, effects and scene of a motion to one offline file."""
    from hovi.cli.arguments.files import check_output, load_shown, next_to
    from hovi.viewing.documents.report import write_report

    target = check_output(html or next_to(file, ".html"), ".html")
    write_report(load_shown(file, package_dir), target)
    print(f"wrote {target}")
