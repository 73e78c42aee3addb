"""Scripts that were started from a terminal: what stays open until Ctrl-C, and browsers."""

from __future__ import annotations

import atexit
import builtins
import contextlib
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Callable

_waiting: list[tuple[str, Callable[[], bool]]] = []
"""Sentences to print at the end of the script, and whether there is still something to wait for."""


def terminal_script() -> bool:
    """Whether a script runs that somebody started from a terminal, and can end by Ctrl-C.

    Not so in a notebook, in an interpreter, in a thread, or where input or output is no terminal.
    """
    if hasattr(sys, "ps1") or sys.flags.interactive or hasattr(builtins, "__IPYTHON__"):
        return False
    if threading.current_thread() is not threading.main_thread():
        return False
    streams = (sys.stdin, sys.stdout)
    try:
        return all(stream is not None and stream.isatty() for stream in streams)
    except ValueError:  # a closed stream
        return False


def has_browser() -> bool:
    """Whether there is a browser with a window: not one that would take over the terminal."""
    has_display = any(os.environ.get(name) for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"))
    if not has_display and sys.platform not in ("darwin", "win32"):
        return False
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    return True


LOOK_SECONDS = 0.5
"""How often an endless wait looks for Ctrl-C: a signal that comes just before the wait begins, or
that the system hands to another thread, does not end it."""


def wait_for_interrupt() -> None:
    """Wait until Ctrl-C."""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            time.sleep(LOOK_SECONDS)


def wait_at_exit(sentence: str, open_still: Callable[[], bool]) -> None:
    """Let the process wait for Ctrl-C at its end, unless an error ends it.

    sentence: printed then. open_still: whether there is still something to wait for.
    """
    if not _waiting:
        atexit.register(_wait)
    _waiting.append((sentence, open_still))


def _wait() -> None:
    failed = hasattr(sys, "last_exc") or hasattr(sys, "last_value")
    sentences = [sentence for sentence, open_still in _waiting if open_still()]
    if failed or not sentences:
        return
    with contextlib.suppress(OSError):
        print(*sentences, sep="\n", flush=True)
    wait_for_interrupt()
