"""`hovi plot`: figures of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hovi.cli.arguments.robots import PackageDirs


def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR|PNG",
            help="Path of the figure (or .pdf, .svg); default: FILE.png.",
        ),
    ] = None,
    package_dir: PackageDirs = None,
) -> None:
    """Plot q, v and tau of a motion; for a planar two-link arm, its swept surface as well."""
    from hovi.cli.arguments.files import check_output, load_shown, next_to
    from hovi.viewing.plotting import plot_all

    target = out or next_to(file, ".png")
    if target.is_dir():
        target = target / f"{file.stem}.png"
    check_output(target, ".png", ".pdf", ".svg")
    for picture in plot_all(load_shown(file, package_dir, warned=False), target):
        print(f"wrote {picture}")
