"""`hovi replay`: a motion in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    speed: Annotated[float, typer.Option(help="1 is real time.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Start again at the end.")] = False,
    html: Annotated[
        Path | None,
        typer.Option(metavar="OUT.html", help="Write one page that plays the motion instead."),
    ] = None,
) -> None:
    """Play a motion in the browser, or write it as a page."""
    from hovi.cli.files import check_output, load_trajectory
    from hovi.playback import replay as play

    if html is not None:
        check_output(html, ".html")
    play(load_trajectory(file), speed=speed, loop=loop, html=html)
    if html is not None:
        print(f"wrote {html}")
