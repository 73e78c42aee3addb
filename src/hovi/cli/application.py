"""The command `hovi`: its subcommands, and errors as one sentence and an exit code."""

from __future__ import annotations

import importlib
import os
import select
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Annotated, Any, TextIO

import typer
from typer.exceptions import TyperException

from hovi.errors import HoviError, HoviWarning
from hovi.system.files import reason

BAD_INPUT = 2
"""Exit code for invalid input."""
OUTPUT_FAILED = 1
"""Exit code for output that could not be written."""

COMMANDS = (
    "plan",
    "accuracy",
    "simulate",
    "effects",
    "study",
    "replay",
    "report",
    "plot",
    "export",
    "check",
    "schema",
    "info",
    "doctor",
    "demo",
)
"""The commands, in the order of the help; each is a module of that name in `hovi.cli.commands`."""


def _print_version(requested: bool) -> None:
    if requested:
        from hovi.version import __version__

        print(f"hovi {__version__}")
        raise typer.Exit


def application(arguments: Sequence[str]) -> typer.Typer:
    """The command line with the command that the arguments begin with, or else with all of them.

    One by itself, since typer reads the options of all commands that it has, which takes longer
    than a small plan.
    """
    app = typer.Typer(
        help="Least-torque motions of URDF robots by higher-order variational integrators.",
        add_completion=False,
        pretty_exceptions_enable=False,
        no_args_is_help=True,
    )
    app.callback()(_hovi)
    for name in arguments[:1] if arguments and arguments[0] in COMMANDS else COMMANDS:
        module = importlib.import_module(f"hovi.cli.commands.{name}")
        if hasattr(module, "app"):  # a command with commands of its own
            app.add_typer(module.app, name=name)
        else:
            app.command(name)(getattr(module, name))
    return app


def _hovi(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    pass


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code.

    arguments: those after `hovi` on the command line; from sys.argv by default.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("always", HoviWarning)
        warnings.showwarning = _with_own_warnings(warnings.showwarning)
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    with _copied(sys.stdout) as output:
        return _run_with(arguments, output)


def _run_with(arguments: Sequence[str] | None, output: int | None) -> int:
    """Run one command. output: a copy of stdout's descriptor, if it has one."""
    stdout, stderr = sys.stdout, sys.stderr
    try:
        given = sys.argv[1:] if arguments is None else arguments
        code = application(given)(args=given, prog_name="hovi", standalone_mode=False)
    except SystemExit as error:  # how typer and rich end where a pipe is broken, whichever it is
        sys.stdout, sys.stderr = stdout, stderr
        if not isinstance(error.__context__, BrokenPipeError) or _has_no_reader(output):
            return OUTPUT_FAILED
        return _report_error(
            "the connection to another process broke; if it was a worker of several starts, memory "
            "or the number of processes may be limited: use --starts 1."
        )
    except HoviError as error:
        return _report_error(str(error))
    except TyperException as error:
        return _report_error(error.format_message() + _instead(error))
    except (typer.Abort, KeyboardInterrupt):
        return 130
    except MemoryError:
        return _report_error("not enough memory; use fewer intervals or starts.")
    except OSError as error:
        return _report_error(f"the operating system reports: {reason(error)}.")
    return code if isinstance(code, int) else 0


def _instead(error: TyperException) -> str:
    """What `hovi plan` takes instead of an unknown option of another planner, after a colon."""
    option, context = getattr(error, "option_name", None), getattr(error, "ctx", None)
    if option is None or getattr(context, "info_name", None) != "plan":
        return ""
    from hovi.planning.problem.notation.other_planners import COMMAND_LINE, instead_of

    advice = instead_of(option.lstrip("-").replace("-", "_"), COMMAND_LINE)
    return f": {advice}" if advice else ""


def _with_own_warnings(others: Callable[..., None]) -> Any:
    """How warnings are shown: those of hovi as a sentence, each once."""
    reported = set()

    def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
        if not issubclass(category, HoviWarning):
            return others(message, category, *where)
        if str(message) not in reported:
            reported.add(str(message))
            with suppress(OSError):  # stderr may be closed
                print(f"warning: {message}", file=sys.stderr)

    return show


@contextmanager
def _copied(stream: TextIO) -> Iterator[int | None]:
    """A copy of a stream's descriptor; None if it has none or the system refuses one more.

    A copy, since rich redirects stdout itself to /dev/null when its reader has gone.
    """
    try:
        copy = os.dup(stream.fileno())
    except OSError:
        copy = None
    try:
        yield copy
    finally:
        if copy is not None:
            os.close(copy)


def _has_no_reader(descriptor: int | None) -> bool:
    """Whether a descriptor is a pipe, socket or terminal whose other end is closed."""
    if descriptor is None:
        return False
    poll = select.poll()
    poll.register(descriptor, 0)
    return bool(poll.poll(0))


def _report_error(sentence: str) -> int:
    if sentence:  # empty when the help was printed instead
        with suppress(OSError):  # stderr may be closed, too
            print(f"error: {sentence}", file=sys.stderr)
    return BAD_INPUT
