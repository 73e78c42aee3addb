"""`python -m hovi` is the command `hovi`; Ctrl-C ends it without noise from the first import on."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130
IMPORTING = "<frozen importlib"
"""What the file names of Python's own frames begin with while a module is imported."""


def run() -> None:
    """Run the command that the command line asks for and leave with its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not in the background
        signal.signal(signal.SIGINT, _interrupt)
    try:
        from hovi.cli import main

        code = main()
    except KeyboardInterrupt:
        code = INTERRUPTED
    except RuntimeError as error:
        # Python 3.11 wraps what is raised while a class names its descriptors.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        code = INTERRUPTED
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # what is left is only to leave
    # Python remembers an interrupt inside `exec`, which dataclasses use, until the next `exec`,
    # and would end by that signal although it was handled.
    exec("")
    sys.exit(_flushed(code))


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Ctrl-C. While modules are imported the program ends at once: nothing is there to finish.

    Raises KeyboardInterrupt at any other time; modules that are imported may swallow that.
    """
    while frame is not None:
        if frame.f_code.co_filename.startswith(IMPORTING):
            os._exit(_flushed(INTERRUPTED))
        frame = frame.f_back
    raise KeyboardInterrupt


def _flushed(code: int) -> int:
    """Write out what was printed; what cannot be written is dropped with one sentence."""
    try:
        sys.stdout.flush()
    except OSError as error:
        # Python would flush again at its end, and complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            print(f"error: cannot write the output: {error.strerror}.", file=sys.stderr)
        return code or 1
    return code


if __name__ == "__main__":
    run()
