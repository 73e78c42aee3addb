"""`hovi plot`: pictures of a motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR|PNG", help="Where the picture goes; FILE.png when not given."),
    ] = None,
) -> None:
    """Draw q, v and tau of a motion over time."""
    from hovi.cli.files import check_output, load_trajectory
    from hovi.plotting import plot as draw

    target = out or file.with_suffix(".png")
    if target.is_dir():
        target = target / f"{file.stem}.png"
    draw(load_trajectory(file), check_output(target, ".png"))
    print(f"wrote {target}")
