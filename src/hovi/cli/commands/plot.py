"""`hovi plot`: pictures of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR|PNG",
            help="Where the picture goes (or .pdf, .svg); FILE.png when not given.",
        ),
    ] = None,
) -> None:
    """Draw q, v, a and tau of a motion over time; for a planar two-link arm, its sweep too."""
    from hovi.cli.commands.files import check_output, load_trajectory
    from hovi.viewing.plotting import plot_all

    target = out or file.with_suffix(".png")
    if target.is_dir():
        target = target / f"{file.stem}.png"
    check_output(target, ".png", ".pdf", ".svg")
    for picture in plot_all(load_trajectory(file), target):
        print(f"wrote {picture}")
