"""`hovi replay`: a motion in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from hovi.discrete.trajectory import Trajectory


def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    speed: Annotated[float, typer.Option(help="1 is real time.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Play again and again.")] = False,
    html: Annotated[
        Path | None,
        typer.Option(metavar="OUT.html", help="Write an offline page instead."),
    ] = None,
    browser: Annotated[
        bool, typer.Option(help="Open the page in a browser, or only print its address.")
    ] = True,
) -> None:
    """Serve a page that plays a motion until Ctrl-C, or write the page to a file."""
    from hovi.cli.arguments.files import check_output, load_trajectory

    if html is None:
        _serve(load_trajectory(file), speed, loop, browser)
        return
    from hovi.viewing.replay_session import write_html

    check_output(html, ".html")
    write_html(load_trajectory(file), html, speed=speed, loop=loop)
    print(f"wrote {html}")


def _serve(trajectory: Trajectory, speed: float, loop: bool, browser: bool) -> None:
    """Play the motion and serve the page until Ctrl-C, the regular end of a replay."""
    import contextlib
    import threading

    from hovi.viewing.replay_session import check_speed, serve

    check_speed(speed)
    with contextlib.suppress(KeyboardInterrupt):
        open_browser = browser and _has_browser()
        with serve(trajectory, open_browser=open_browser, announce=_announce) as shown:
            shown.play(speed=speed, loop=loop)
            if not loop:  # a loop has ended by Ctrl-C
                shown.offer_controls()
                threading.Event().wait()


def _announce(address: str) -> None:
    print(f"playing at {address}; Ctrl-C ends it", flush=True)


def _has_browser() -> bool:
    import webbrowser

    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    return True
