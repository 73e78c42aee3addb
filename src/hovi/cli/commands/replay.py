"""`hovi replay`: a motion in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hovi.cli.arguments.robots import PackageDirs

if TYPE_CHECKING:
    from hovi.discrete.trajectory import Trajectory


def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE.npz", help="A motion.")],
    speed: Annotated[float, typer.Option(help="1 is real time.")] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Play again and again.")] = False,
    compare: Annotated[
        list[Path] | None,
        typer.Option(metavar="OTHER.npz", help="Another motion, as a ghost; repeatable."),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(metavar="OUT.html", help="Write an offline page instead."),
    ] = None,
    browser: Annotated[
        bool, typer.Option(help="Open the page in a browser, or only print its address.")
    ] = True,
    package_dir: PackageDirs = None,
) -> None:
    """Serve a page that plays a motion until Ctrl-C, or write the page to a file."""
    from hovi.cli.arguments.files import check_output, load_shown

    if html is not None:
        check_output(html, ".html")
    others = [load_shown(each, package_dir) for each in compare or ()]
    motion = load_shown(file, package_dir)
    if html is None:
        _serve(motion, others, speed, loop, browser)
        return
    from hovi.viewing.replay_session import write_html

    write_html(motion, html, compare=others, speed=speed, loop=loop)
    print(f"wrote {html}")


def _serve(
    trajectory: Trajectory, others: list[Trajectory], speed: float, loop: bool, browser: bool
) -> None:
    """Serve the page until Ctrl-C, the regular end of a replay."""
    import contextlib

    from hovi.system.terminal import has_browser, wait_for_interrupt
    from hovi.viewing.replay_session import check_speed, serve

    check_speed(speed)
    with contextlib.suppress(KeyboardInterrupt):
        open_browser = browser and has_browser()
        shown = serve(
            trajectory,
            open_browser=open_browser,
            announce=_announce,
            compare=others,
            speed=speed,
            loop=loop,
        )
        with shown:
            wait_for_interrupt()


def _announce(address: str) -> None:
    print(f"playing at {address}; Ctrl-C ends it", flush=True)
