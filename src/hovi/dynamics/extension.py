"""Loads the compiled extension that links to CasADi and Pinocchio, and serializes models for it.

`casadi` and `pinocchio` are imported first, since the extension uses their shared libraries, which
are found by name once they are loaded.
"""

from __future__ import annotations

import zlib
from importlib.metadata import version

import casadi  # noqa: F401  (loads libcasadi)
import pinocchio as pin

from hovi.errors import HoviError


class BuildMismatchError(HoviError):
    """The compiled extension does not match the installed libraries."""


try:
    from hovi._native.symbolic import SymbolicModel, pinocchio_version
except ImportError as error:
    raise BuildMismatchError(
        f"hovi's compiled extension does not load with pin {pin.__version__} and casadi "
        f"{version('casadi')} ({error}): reinstall hovi so that it is compiled again."
    ) from error

__all__ = ["BuildMismatchError", "SymbolicModel", "archive"]


def archive(model: pin.Model) -> str:
    """Pinocchio's text archive of a model, after its CRC-32 in hexadecimal and a space.

    Only the same version of Pinocchio can read it, and it trusts every number in it.

    Raises BuildMismatchError if the extension was compiled with another version.
    """
    check_version(pin.__version__, pinocchio_version)
    text: str = model.saveToString()
    return f"{zlib.crc32(text.encode()):08x} {text}"


def check_version(installed: str, compiled: str) -> None:
    """Raise BuildMismatchError unless both versions of Pinocchio are the same."""
    if installed != compiled:
        raise BuildMismatchError(
            f"hovi was compiled against pin {compiled}, but pin {installed} is installed: run "
            f"`pip install pin=={compiled}`, or reinstall hovi so that it is compiled again."
        )
