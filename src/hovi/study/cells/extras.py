"""Packages that are installed with an extra."""

from __future__ import annotations

from importlib.util import find_spec

from hovi.errors import InputError


def require_extra(package: str, extra: str) -> None:
    """Raise InputError, which names the extra, unless a package is installed."""
    if find_spec(package) is None:
        raise InputError(
            f"this needs the package {package!r}, which is not installed: "
            f"pip install 'hovi[{extra}]'."
        )
