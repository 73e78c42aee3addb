"""The command `hovi`: parse, call one library function, print."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer
from typer.exceptions import TyperException

from hovi.cli.application import app
from hovi.errors import HoviError
from hovi.system.files import reason

__all__ = ["app", "main"]

BAD_INPUT = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code.

    arguments: what follows `hovi` on the command line; sys.argv when not given.
    """
    try:
        code = app(args=arguments, prog_name="hovi", standalone_mode=False)
    except HoviError as refused:
        return _refuse(str(refused))
    except TyperException as misuse:
        return _refuse(misuse.format_message())
    except (typer.Abort, KeyboardInterrupt):
        return 130
    except MemoryError:
        return _refuse("this takes more memory than there is: fewer intervals or starts take less.")
    except OSError as refused:
        return _refuse(f"the operating system refuses: {reason(refused)}.")
    return code if isinstance(code, int) else 0


def _refuse(sentence: str) -> int:
    if sentence:  # empty when the help has been printed instead
        print(f"error: {sentence}", file=sys.stderr)
    return BAD_INPUT
