"""Figures as files: whole or not at all, and the same bytes for the same figure."""

from __future__ import annotations

import os
from pathlib import Path

from matplotlib.figure import Figure

from hovi.errors import DisplayError
from hovi.system.files import reason, whole_file

_DPI = 150
_METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None},
    ".svg": {"Date": None},
}


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, PDF or SVG by its suffix. Raises DisplayError."""
    suffix = Path(path).suffix.lower()
    if suffix not in _METADATA:
        raise DisplayError(
            f"cannot tell what picture {Path(path).name!r} is to be; "
            f"let its name end in {', '.join(_METADATA)}."
        )
    try:
        with whole_file(path) as stream:
            figure.savefig(stream, format=suffix[1:], dpi=_DPI, metadata=_METADATA[suffix])
    except OSError as error:
        raise DisplayError(f"cannot write the picture {str(path)!r}: {reason(error)}.") from error
