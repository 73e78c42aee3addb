"""Optional libraries of export formats, each named in one sentence when it is missing."""

from __future__ import annotations

import importlib
from types import ModuleType

from hovi.errors import DisplayError


def library(module: str, package: str, purpose: str) -> ModuleType:
    """An optional module.

    package: its name for pip. purpose: what needs it, such as "the format 'mcap'".
    Raises DisplayError with the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as missing:
        raise DisplayError(
            f"{purpose} needs the package {package}: run pip install 'hovi[exchange]'."
        ) from missing
