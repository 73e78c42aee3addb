"""The entry point of the command `hovi`, with Ctrl-C handled from the first import on."""

from __future__ import annotations

import gc
import io
import os
import signal
import sys
import time
from _thread import interrupt_main, start_new_thread
from collections.abc import Iterator
from types import FrameType, TracebackType
from typing import TextIO

EXIT_INTERRUPTED = 130
IMPORTLIB_FILE = "<frozen importlib"
"""Prefix of the file names of frames of Python's import system."""
EXTENSION_MODULE = "hovi._native.dynamics"
"""The module that reports leaked objects at exit, except after an interrupt."""
NEW_OBJECTS = 200_000
"""How many new containers start a search for unreachable ones. Python's own 700 costs a small plan
a tenth of its time: what it imports stays."""
INTERRUPTION_MODULE = "hovi.system.interruption"
"""The module that records interrupts raised where Python drops exceptions, as in a destructor."""
RETRY_DELAY = 0.05
"""Delay in [s] before Ctrl-C is raised again, if it came during an import within a run."""


def run() -> None:
    """Run the command line and exit with its code."""
    _replace_closed_streams()
    gc.set_threshold(NEW_OBJECTS)
    # No plugin of another package changes what a scene file says, and none is searched for.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not in the background
        handle_interrupts()
    try:
        from hovi.cli.application import main

        code = main()
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    except RuntimeError as error:
        # Python 3.11 wraps exceptions raised in __set_name__.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        code = EXIT_INTERRUPTED
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # exiting is all that is left
    # Python remembers an interrupt inside `exec`, which dataclasses use, until the next `exec`,
    # and would otherwise exit with that signal although it was handled.
    exec("")
    code = _flush_output(code)
    try:
        sys.stderr.flush()
    except OSError:
        _discard(sys.stderr)
    gc.freeze()  # Python searches what is left for unreachable cycles, which takes 0.05 s or more
    sys.exit(code)


def handle_interrupts() -> None:
    """Handle Ctrl-C as below, and raise it again where Python drops it.

    That is so in destructors, callbacks of weak references and compiled functions that cannot
    raise, such as the one that loads SciPy's tables for Sobol points.
    """
    signal.signal(signal.SIGINT, _handle_interrupt)
    sys.unraisablehook = _handle_dropped
    sys.excepthook = _print_unless_interrupt  # Cython prints what it drops, too


def _handle_dropped(dropped: sys.UnraisableHookArgs) -> None:
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        start_new_thread(_interrupt_later, ())
    else:
        sys.__unraisablehook__(dropped)


def _print_unless_interrupt(
    kind: type[BaseException], error: BaseException, where: TracebackType | None
) -> None:
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, where)


def _handle_interrupt(number: int, frame: FrameType | None) -> None:
    """Handle Ctrl-C: exit at once during the imports of a command, before any work is done.

    Otherwise raises KeyboardInterrupt. A module imported in the middle of a run may swallow it, so
    there the interrupt is raised again later.
    """
    extension = sys.modules.get(EXTENSION_MODULE)
    if extension is not None and hasattr(extension, "ignore_leaks"):  # completely imported
        extension.ignore_leaks()
    importer = _importing_frame(frame)
    if importer is None:
        interruption = sys.modules.get(INTERRUPTION_MODULE)
        if interruption is not None:
            interruption.record_interrupt()
        raise KeyboardInterrupt
    if not any(map(_is_library_frame, _callers(importer))):
        os._exit(_flush_output(EXIT_INTERRUPTED))  # no work to finish
    # Not a Timer, which takes locks that the interrupted code may hold.
    start_new_thread(_interrupt_later, ())


def _interrupt_later() -> None:
    time.sleep(RETRY_DELAY)
    interrupt_main()


def _importing_frame(frame: FrameType | None) -> FrameType | None:
    """The outermost frame that imports a module; None outside of imports."""
    importer = None
    for each in _callers(frame):
        if each.f_code.co_filename.startswith(IMPORTLIB_FILE):
            importer = each.f_back
    return importer


def _callers(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def _is_library_frame(frame: FrameType) -> bool:
    """Whether a frame belongs to the library, and not to the command line or this module."""
    package, *module = frame.f_globals.get("__name__", "").split(".")[:2]
    return package == "hovi" and module not in ([], ["cli"], ["__main__"])


class _ClosedStream(io.RawIOBase):
    """Stands for a standard stream that was closed when the process began.

    number: its descriptor, which is that of /dev/null now; worker processes inherit it.
    lost: whether something was to be written to it.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number, self.lost = number, False

    def fileno(self) -> int:
        return self.number

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        self.lost = True
        return len(memoryview(data))  # type: ignore[arg-type]


def _replace_closed_streams() -> None:
    """Open /dev/null in place of closed standard streams.

    The next file to be opened would get the number of such a stream, and what is printed to it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # the smallest free number
    for number, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:  # as Python has it
            buffer = io.BufferedWriter(_ClosedStream(number))
            setattr(sys, name, io.TextIOWrapper(buffer, "utf-8", "backslashreplace"))


def _flush_output(code: int) -> int:
    """Flush stdout, with one sentence if that fails; returns the exit code."""
    try:
        sys.stdout.flush()
    except OSError as error:
        _discard(sys.stdout)
        if not isinstance(error, BrokenPipeError):
            _report_lost_output(str(error.strerror))
        return code or 1
    raw = getattr(sys.stdout.buffer, "raw", None)
    if isinstance(raw, _ClosedStream) and raw.lost:
        _report_lost_output("stdout is closed")
        return code or 1
    return code


def _report_lost_output(reason: str) -> None:
    try:
        print(f"error: cannot write the output: {reason}.", file=sys.stderr)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Send what a stream still holds nowhere: Python flushes it again at exit, and would fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


if __name__ == "__main__":
    run()
