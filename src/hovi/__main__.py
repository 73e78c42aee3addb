"""`python -m hovi` is the command `hovi`; Ctrl-C ends it without noise from the first import on."""

from __future__ import annotations

import os
import signal
import sys
import time
from _thread import interrupt_main, start_new_thread
from collections.abc import Iterator
from types import FrameType

INTERRUPTED = 130
IMPORTING = "<frozen importlib"
"""What the file names of Python's own frames begin with while a module is imported."""
EXTENSION = "hovi._native.dynamics"
"""What counts its objects at the end; those of a program that was interrupted are no leaks."""
MEMORY = "hovi.system.interruption"
"""What remembers an interrupt that comes where Python drops exceptions, as in a destructor."""
PATIENCE = 0.05
"""Seconds after which Ctrl-C is heard again that came while a run imported what it needs."""


def run() -> None:
    """Run the command that the command line asks for and leave with its exit code."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not in the background
        signal.signal(signal.SIGINT, _interrupt)
    try:
        from hovi.cli.application import main

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
    """Ctrl-C. While a command imports what it begins with, the program ends at once.

    Raises KeyboardInterrupt at any other time. A module that is imported in the middle of a run may
    swallow that, so that the run hears of it when the module is there.
    """
    extension = sys.modules.get(EXTENSION)
    if extension is not None and hasattr(extension, "ignore_leaks"):  # imported to its end
        extension.ignore_leaks()
    asking = _asks_for_imports(frame)
    if asking is None:
        memory = sys.modules.get(MEMORY)
        if memory is not None:
            memory.record_interrupt()
        raise KeyboardInterrupt
    if not any(map(_of_a_run, _outward(asking))):
        os._exit(_flushed(INTERRUPTED))  # nothing is there to finish
    start_new_thread(_again, ())  # a Timer takes locks that what was interrupted may hold


def _again() -> None:
    time.sleep(PATIENCE)
    interrupt_main()


def _asks_for_imports(frame: FrameType | None) -> FrameType | None:
    """What imports, and is not imported itself; None where nothing is imported."""
    asking = None
    for each in _outward(frame):
        if each.f_code.co_filename.startswith(IMPORTING):
            asking = each.f_back
    return asking


def _outward(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def _of_a_run(frame: FrameType) -> bool:
    """Whether it is one of the library's own, neither of the commands nor of this module."""
    package, *module = frame.f_globals.get("__name__", "").split(".")[:2]
    return package == "hovi" and module not in ([], ["cli"], ["__main__"])


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
