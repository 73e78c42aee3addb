"""`hovi demo`: a menu of motions in the browser."""

from __future__ import annotations

from typing import Annotated

import typer


def demo(
    browser: Annotated[
        bool, typer.Option(help="Open the menu in a browser, or only print its address.")
    ] = True,
    port: Annotated[int, typer.Option(help="Port on 127.0.0.1; 0 for any free one.")] = 0,
) -> None:
    """Show eight motions in the browser, each with its scene file to copy, until Ctrl-C."""
    import contextlib
    import webbrowser

    from hovi.system.terminal import has_browser
    from hovi.viewing.documents.demo import DemoServer

    server = DemoServer(port)
    with contextlib.suppress(KeyboardInterrupt):
        print(f"eight motions at {server.url}; Ctrl-C ends it", flush=True)
        if browser and has_browser():
            webbrowser.open(server.url, new=2)
        server.plan_what_is_chosen(lambda line: print(line, flush=True))
    server.close()
